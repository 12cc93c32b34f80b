//! One hour of a sea at 10 Hz, step by step: `cargo bench --profile dev -p halcyon-ocean --bench waves`.
//!
//! The profile is the one that `make run` uses. "analysis" is all of it but the intervals: quality, waves up and down with their
//! statistics, spectrum and moments; it is to take 10 ms at most.

#![allow(missing_docs, reason = "criterion's macros make functions without any")]
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a bench that cannot run says why and ends")]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use halcyon_ocean::crossing::{Crossing, Wave, WaveStatistics, waves};
use halcyon_ocean::interval::{SpectralIntervals, WaveIntervals};
use halcyon_ocean::quality::{Assessment, Limits, RawSeries, assess};
use halcyon_ocean::shape::{Estimate, NoiseFloor, PeakPeriods, Scatter, systems};
use halcyon_ocean::{Jonswap, Record, SampledSpectrum, SpectralStatistics, Spectrum, Welch};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use realfft::RealFftPlanner;

const RATE_HZ: f64 = 10.0;
const SAMPLES: usize = 36_000;
const SEGMENT_S: f64 = 120.0;
const BAND_HZ: (f64, f64) = (0.04, 2.0);

/// A Gaussian sea of a JONSWAP spectrum with a millimetre of noise, as instruments have.
fn sea() -> Vec<f64> {
    let spectrum = Jonswap::new(0.3, 2.5, 3.3).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let df_hz = RATE_HZ / SAMPLES as f64;
    let fft = RealFftPlanner::<f64>::new().plan_fft_inverse(SAMPLES);
    let mut lines = fft.make_input_vec();
    let last = lines.len() - 1;
    for (i, line) in lines.iter_mut().enumerate().take(last).skip(1) {
        let deviation_m = (spectrum.density_m2_per_hz(i as f64 * df_hz) * df_hz).sqrt() * 0.5;
        let (re, im): (f64, f64) = (random.sample(StandardNormal), random.sample(StandardNormal));
        (line.re, line.im) = (deviation_m * re, deviation_m * im);
    }
    let mut samples_m = fft.make_output_vec();
    fft.process(&mut lines, &mut samples_m).unwrap();
    samples_m.iter_mut().for_each(|x| *x += 0.001 * random.sample::<f64, _>(StandardNormal));
    samples_m
}

fn both_ways(record: &Record) -> (Vec<Wave>, [Option<WaveStatistics>; 2]) {
    let [up, down] = [Crossing::Up, Crossing::Down].map(|crossing| waves(record, crossing, 0.002));
    let statistics = [WaveStatistics::of(&up), WaveStatistics::of(&down)];
    (up, statistics)
}

fn spectrum(record: &Record) -> SampledSpectrum {
    Welch::with_segments_of_s(SEGMENT_S, record).spectrum(record).unwrap()
}

fn moments(spectrum: &SampledSpectrum) -> (SpectralStatistics, [f64; 3]) {
    let (low_hz, high_hz) = BAND_HZ;
    let shape =
        [spectrum.width_epsilon(low_hz, high_hz), spectrum.width_nu(low_hz, high_hz), spectrum.peakedness(low_hz, high_hz)];
    (spectrum.statistics(low_hz, high_hz).unwrap(), shape)
}

fn analysis(raw: RawSeries<'_>, limits: &Limits) -> impl Sized {
    let quality: Assessment = assess(raw, limits);
    let record = quality.even.as_ref().unwrap().record.clone().without_trend();
    let waves = both_ways(&record);
    let spectrum = spectrum(&record);
    let moments = moments(&spectrum);
    (quality, waves, (record.skewness(), record.kurtosis()), spectrum, moments)
}

fn hour(criterion: &mut Criterion) {
    let elevation_m = sea();
    let stamp_s: Vec<f64> = (0..SAMPLES).map(|i| 1.7e9 + i as f64 / RATE_HZ).collect();
    let raw = RawSeries { stamp_s: &stamp_s, elevation_m: &elevation_m };
    let limits = Limits::default();
    let record = Record::new(elevation_m.clone(), RATE_HZ).unwrap().without_trend();
    let (up, _) = both_ways(&record);
    let density = spectrum(&record);
    let (found, _) = moments(&density);
    let scatter = Scatter::of(&Welch::with_segments_of_s(SEGMENT_S, &record), SAMPLES).unwrap();
    let estimate = Estimate { spectrum: &density, scatter: &scatter, band_hz: BAND_HZ, noise_m2_per_hz: 2e-7 };

    let mut group = criterion.benchmark_group("an hour at 10 Hz");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    group.bench_function("quality", |bencher| bencher.iter(|| assess(black_box(raw), &limits)));
    group.bench_function("waves up and down", |bencher| bencher.iter(|| both_ways(black_box(&record))));
    group.bench_function("spectrum", |bencher| bencher.iter(|| spectrum(black_box(&record))));
    group.bench_function("moments", |bencher| bencher.iter(|| moments(black_box(&density))));
    group.bench_function("analysis", |bencher| bencher.iter(|| analysis(black_box(raw), &limits)));
    group.bench_function("intervals of waves", |bencher| bencher.iter(|| WaveIntervals::of(black_box(&up))));
    group.bench_function("intervals of the spectrum", |bencher| {
        bencher.iter(|| SpectralIntervals::of(black_box(&record), &density, &found, BAND_HZ));
    });
    group.bench_function("scatter, peak, noise, systems", |bencher| {
        bencher.iter(|| {
            let scatter = Scatter::of(&Welch::with_segments_of_s(SEGMENT_S, &record), SAMPLES).unwrap();
            let noise = NoiseFloor::estimated(&density, &scatter, (1.2, 5.0)).unwrap();
            (PeakPeriods::of(&density, BAND_HZ), systems(&noise.removed(&density), &scatter, BAND_HZ), noise)
        });
    });
    group.bench_function("fit of JONSWAP", |bencher| bencher.iter(|| black_box(&estimate).jonswap().unwrap()));
    group.bench_function("fit of Pierson-Moskowitz", |bencher| {
        bencher.iter(|| black_box(&estimate).pierson_moskowitz().unwrap());
    });
    group.finish();
}

criterion_group!(benches, hour);
criterion_main!(benches);
