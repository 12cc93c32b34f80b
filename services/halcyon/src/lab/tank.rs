//! The wave tank in time and frequency: figures 5-22 … 5-30.

use std::f64::consts::TAU;

use halcyon_ocean::outlier::replace_out_of_range;
use halcyon_ocean::{Crossing, Record, WaveStatistics, Welch, crossing};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::context::{Lab, LabError};
use super::exhibit::Exhibit;
use super::flat::crests_and_troughs;
use crate::accuracy::{PROBE_HZ, TankErrors, TankRecord, TankRun, tank};
use crate::report::{Bars, Chart, Series};

const MM: f64 = 1e3;
/// Pairs, and ultrasonic readings with them, a second.
const RATE_HZ: f64 = 3.5;
/// Cameras and ultrasonic sensor above the water, metres.
const HEIGHT_M: f64 = 0.99;
/// The thesis's ultrasonic sensor told centimetres, sometimes out of range.
const ULTRASONIC_STEP_M: f64 = 0.01;
const ULTRASONIC_SIGMA_M: f64 = 0.003;
const ULTRASONIC_SPIKES: f64 = 0.04;
/// Highest frequency that the charts show, hertz.
const SHOWN_HZ: f64 = 1.0;

/// One run, three sensors.
struct Sensors<'a> {
    record: &'a TankRecord,
    /// Elevation by the ultrasonic sensor as it came, metres.
    ultrasonic_raw_m: Vec<f64>,
    /// And within its range.
    ultrasonic_m: Vec<f64>,
}

impl<'a> Sensors<'a> {
    fn new(record: &'a TankRecord, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let every = PROBE_HZ / RATE_HZ;
        let readings = (record.probe_m.len() as f64 / every) as usize;
        let reading = |i: usize| {
            let elevation_m = record.probe_m[((i as f64 * every) as usize).min(record.probe_m.len() - 1)];
            let noise: f64 = StandardNormal.sample(&mut random);
            let distance_m = if random.random_bool(ULTRASONIC_SPIKES) {
                random.random_range(1.5..4.0)
            } else {
                HEIGHT_M - elevation_m + ULTRASONIC_SIGMA_M * noise
            };
            HEIGHT_M - (distance_m / ULTRASONIC_STEP_M).round() * ULTRASONIC_STEP_M
        };
        let ultrasonic_raw_m: Vec<f64> = (0..readings).map(reading).collect();
        let mut ultrasonic_m = ultrasonic_raw_m.clone();
        replace_out_of_range(&mut ultrasonic_m, &(-0.2..=0.2));
        Self { record, ultrasonic_raw_m, ultrasonic_m }
    }

    fn stereo_m(&self) -> Vec<f64> {
        self.record.stereo.trace.iter().map(|point| point.1).collect()
    }

    /// Name, samples and rate of each sensor: the probe first.
    fn all(&self) -> [(&'static str, Vec<f64>, f64); 3] {
        let stereo_hz = rate_hz(&self.record.stereo.trace);
        [
            ("wave probe", self.record.probe_m.clone(), PROBE_HZ),
            ("stereo", self.stereo_m(), stereo_hz),
            ("ultrasonic", self.ultrasonic_m.clone(), RATE_HZ),
        ]
    }
}

/// Mean rate of a record.
fn rate_hz(trace: &[(f64, f64)]) -> f64 {
    match (trace.first(), trace.last()) {
        (Some(first), Some(last)) if last.0 > first.0 => (trace.len() - 1) as f64 / (last.0 - first.0),
        _ => RATE_HZ,
    }
}

pub(super) fn run(lab: &Lab) -> Result<Exhibit, LabError> {
    let mut exhibit = Exhibit::default();
    exhibit.text(
        "Regular waves in a tank 0.6 m deep, cameras 0.99 m above. The probe is the formula of the water and errs by nothing. The ultrasonic \
         sensor is simulated as the thesis describes its own: it tells whole centimetres, and is out of range now and then.",
    );
    let records = tank(&lab.choose(TankRun::thesis(), TankRun::quick()))?;
    let errors = TankErrors::of(&records);
    exhibit.find("mean |error| of H_m, stereo", "mm", MM * errors.h_mean_m, Some(4.0));
    exhibit.find("mean |error| of H_s, stereo", "mm", MM * errors.h_s_m, Some(7.8));
    exhibit.find("largest |error| of the peak frequency, stereo", "Hz", errors.peak_hz, Some(0.02));
    if let Some(r_squared) = errors.r_squared {
        exhibit.find("R² of peak amplitude (figure 5-29)", "1", r_squared, Some(0.93));
    }
    exhibit.find("mean |error| of peak amplitude", "mm", 1e3 * errors.amplitude_m, None);
    let sensors: Vec<Sensors> = records.iter().zip(100..).map(|(record, seed)| Sensors::new(record, seed)).collect();
    heights(&mut exhibit, &sensors)?;
    // The middle height of each frequency stands for it in the charts.
    let mut shown: Vec<&Sensors> = Vec::new();
    for one in &sensors {
        let is_new = shown.iter().all(|other| other.record.frequency_hz != one.record.frequency_hz);
        if is_new || one.record.height_m == 0.04 {
            shown.retain(|other| other.record.frequency_hz != one.record.frequency_hz);
            shown.push(one);
        }
    }
    for (index, one) in shown.iter().enumerate() {
        in_time(&mut exhibit, one, index == 0)?;
    }
    for (index, one) in shown.iter().enumerate() {
        in_frequency(&mut exhibit, one, index == 0)?;
    }
    regression(&mut exhibit, &records)?;
    Ok(exhibit)
}

/// Figure 5-25: H_m and H_s by all three.
fn heights(exhibit: &mut Exhibit, sensors: &[Sensors]) -> Result<(), LabError> {
    let mut errors = [0.0; 2];
    let (mut h_mean_mm, mut h_s_mm): ([Vec<f64>; 3], [Vec<f64>; 3]) = Default::default();
    for one in sensors {
        let ultrasonic = Record::new(one.ultrasonic_m.clone(), RATE_HZ)?.without_mean();
        // Whole centimetres flicker: crossings within the step are none.
        let found = WaveStatistics::of(&crossing::waves(&ultrasonic, Crossing::Up, ULTRASONIC_STEP_M / 2.0));
        let (mean_m, s_m) = found.map_or((f64::NAN, f64::NAN), |found| (found.h_mean_m, found.h_s_m));
        errors[0] += (mean_m - one.record.height_m).abs() / sensors.len() as f64;
        errors[1] += (s_m - one.record.height_m).abs() / sensors.len() as f64;
        for (k, value_m) in [one.record.height_m, one.record.stereo.h_mean_m, mean_m].into_iter().enumerate() {
            h_mean_mm[k].push(MM * value_m);
        }
        for (k, value_m) in [one.record.height_m, one.record.stereo.h_s_m, s_m].into_iter().enumerate() {
            h_s_mm[k].push(MM * value_m);
        }
    }
    exhibit.find("mean |error| of H_m, ultrasonic", "mm", MM * errors[0], Some(11.0));
    exhibit.find("mean |error| of H_s, ultrasonic", "mm", MM * errors[1], Some(9.7));
    for (name, values) in [("H_m", h_mean_mm), ("H_s", h_s_mm)] {
        let groups = sensors.iter().map(|one| format!("{} Hz", one.record.frequency_hz)).collect();
        let mut bars = Bars::new(format!("{name}, mm"), groups);
        for (sensor, values) in ["wave probe", "stereo", "ultrasonic"].into_iter().zip(values) {
            bars = bars.with(sensor, values);
        }
        exhibit.chart(bars.svg(), format!("Figure 5-25: {name} by each sensor, run by run"))?;
    }
    Ok(())
}

/// Figures 5-22, 5-23 and 5-24.
fn in_time(exhibit: &mut Exhibit, one: &Sensors, is_first: bool) -> Result<(), LabError> {
    let hz = one.record.frequency_hz;
    let at =
        |samples_m: &[f64], rate_hz: f64| samples_m.iter().enumerate().map(|(i, m)| (i as f64 / rate_hz, MM * m)).collect();
    let chart = || Chart::new("time, s", "elevation, mm");
    if is_first {
        let raw = chart().with(Series::points("", at(&one.ultrasonic_raw_m, RATE_HZ)));
        exhibit.chart(raw.svg(), "Figure 5-22, top: the ultrasonic sensor as it reads")?;
        let filtered = chart().with(Series::points("", at(&one.ultrasonic_m, RATE_HZ)));
        exhibit.chart(filtered.svg(), "Figure 5-22, bottom: readings out of range replaced by their neighbour")?;
    }
    let trace = &one.record.stereo.trace;
    let stereo: Vec<(f64, f64)> = trace.iter().map(|(t_s, m)| (*t_s, MM * m)).collect();
    let all = chart()
        .with(Series::line("stereo", stereo.clone()))
        .with(Series::dashed("wave probe", at(&one.record.probe_m, PROBE_HZ)))
        .with(Series::points("ultrasonic", at(&one.ultrasonic_m, RATE_HZ)));
    exhibit.chart(all.svg(), format!("Figure 5-23: water surface at {hz} Hz"))?;
    if is_first {
        let (crests, troughs) = crests_and_troughs(trace, rate_hz(trace))?;
        let in_mm = |points: Vec<(f64, f64)>| points.into_iter().map(|(t_s, m)| (t_s, MM * m)).collect();
        let found = chart()
            .with(Series::line("stereo", stereo))
            .with(Series::points("crests", in_mm(crests)))
            .with(Series::points("troughs", in_mm(troughs)));
        exhibit.chart(found.svg(), format!("Figure 5-24: crests and troughs at {hz} Hz"))?;
    }
    Ok(())
}

/// Amplitude at each frequency of a discrete Fourier transform up to [`SHOWN_HZ`].
fn amplitudes(samples: &[f64], rate_hz: f64) -> Vec<(f64, f64)> {
    let n = samples.len().max(1) as f64;
    let mean = samples.iter().sum::<f64>() / n;
    let amplitude = |k: usize| {
        let (mut re, mut im) = (0.0, 0.0);
        for (i, sample) in samples.iter().enumerate() {
            let (sin, cos) = (TAU * k as f64 * i as f64 / n).sin_cos();
            re += (sample - mean) * cos;
            im += (sample - mean) * sin;
        }
        2.0 * re.hypot(im) / n
    };
    let last = (SHOWN_HZ.min(0.5 * rate_hz) * n / rate_hz) as usize;
    (1..=last).map(|k| (k as f64 * rate_hz / n, amplitude(k))).collect()
}

/// Figures 5-26, 5-27, 5-28 and 5-30.
fn in_frequency(exhibit: &mut Exhibit, one: &Sensors, is_first: bool) -> Result<(), LabError> {
    let hz = one.record.frequency_hz;
    let mut chart = Chart::new("frequency, Hz", "amplitude, mm").from_zero();
    for (name, samples_m, rate_hz) in one.all() {
        let found: Vec<(f64, f64)> = amplitudes(&samples_m, rate_hz).into_iter().map(|(f, a)| (f, MM * a)).collect();
        let peak = found.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(f64::NAN, |peak| peak.0);
        exhibit.find(format!("highest peak at {hz} Hz, {name}"), "Hz", peak, None);
        chart = chart.with(Series::line(name, found));
    }
    let which = if is_first { "Figures 5-26 and 5-27" } else { "As figure 5-28" };
    exhibit.chart(chart.svg(), format!("{which}: amplitudes at {hz} Hz"))?;
    if is_first {
        let mut chart = Chart::new("frequency, Hz", "density, m²/Hz").log_y();
        for (name, samples_m, rate_hz) in one.all().into_iter().take(2) {
            let record = Record::new(samples_m, rate_hz)?.without_mean();
            let spectrum = Welch::new(record.samples_m().len()).spectrum(&record)?;
            let density =
                spectrum.density_m2_per_hz().iter().enumerate().skip(1).map(|(i, s)| (i as f64 * spectrum.df_hz(), *s));
            chart = chart.with(Series::line(name, density.take_while(|point| point.0 <= SHOWN_HZ).collect()));
        }
        exhibit.chart(chart.svg(), format!("Figure 5-30: periodogram of the whole record (Hann window) at {hz} Hz"))?;
    }
    Ok(())
}

/// Figure 5-29.
fn regression(exhibit: &mut Exhibit, records: &[TankRecord]) -> Result<(), LabError> {
    let points: Vec<(f64, f64)> = records.iter().map(|record| (MM * 0.5 * record.height_m, MM * record.peak.1)).collect();
    let ends =
        points.iter().map(|point| point.0).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    let chart = Chart::new("amplitude by the wave probe, mm", "amplitude by stereo, mm")
        .with(Series::points("runs", points))
        .with(Series::dashed("equality", vec![(ends.0, ends.0), (ends.1, ends.1)]))
        .low_legend();
    exhibit.chart(chart.svg(), "Figure 5-29: peak amplitudes of stereo against wave probe")?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_has_one_amplitude() {
        let sine: Vec<f64> = (0..100).map(|i| 3.0 + 0.02 * (TAU * 0.2 * f64::from(i) / 5.0).sin()).collect();
        let found = amplitudes(&sine, 5.0);
        for (f, amplitude) in found {
            let expected = if (f - 0.2).abs() < 1e-9 { 0.02 } else { 0.0 };
            assert!((amplitude - expected).abs() < 1e-12, "{f} Hz: {amplitude}");
        }
    }
}
