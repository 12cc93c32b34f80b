//! The spectra of two aligned series, and what each alone says about the waves.

use super::align::{Pair, SAMPLES_MIN};
use super::compare::{Options, Waves};
use super::cross::CrossSpectrum;
use super::ratio::{Both, Moments};
use super::{CompareError, Which};
use crate::crossing::{Crossing, Wave, WaveStatistics, waves};
use crate::interval::{Interval, SpectralIntervals, WaveIntervals};
use crate::record::Record;
use crate::shape::peak::PeakPeriods;
use crate::welch::SampledSpectrum;

/// Both spectra, steady and finely resolved.
pub(super) struct Spectra {
    band_hz: Interval,
    pub(super) coarse: CrossSpectrum,
    fine: CrossSpectrum,
    a: Moments,
    b: Moments,
}

impl Spectra {
    pub(super) fn of(pair: &Pair, band_hz: Interval, [noise_a, noise_b]: [f64; 2]) -> Result<Self, CompareError> {
        let stretches = pair.stretches();
        let longest = stretches.iter().map(|stretch| stretch.0.len()).max().unwrap_or(0);
        let short = CompareError::TooShort { samples: longest, samples_min: SAMPLES_MIN };
        let of = |parts: usize| CrossSpectrum::of(&stretches, longest / parts, pair.rate_hz).ok_or(short);
        let (coarse, fine) = (of(8)?, of(3)?);
        let none = CompareError::Band { rate_hz: pair.rate_hz, low_hz: band_hz.0 };
        if coarse.lines(band_hz).count() < 3 {
            return Err(none);
        }
        let a = Moments::of(&coarse.aa_m2_per_hz, coarse.df_hz, coarse.lines(band_hz), noise_a);
        let b = Moments::of(&coarse.bb_m2_per_hz, coarse.df_hz, coarse.lines(band_hz), noise_b);
        for (which, moments) in [(Which::A, a), (Which::B, b)] {
            if !(moments.m0_m2 > 0.0 && moments.m0_m2.is_finite()) {
                return Err(CompareError::Flat { which });
            }
        }
        Ok(Self { band_hz, coarse, fine, a, b })
    }

    pub(super) fn both(&self) -> Both<'_> {
        Both { cross: &self.fine, band_hz: self.band_hz, a: self.a, b: self.b }
    }

    pub(super) fn waves(&self, pair: &Pair, which: Which, options: &Options) -> Result<Waves, CompareError> {
        let flat = CompareError::Flat { which };
        let (density, moments) = match which {
            Which::A => (&self.coarse.aa_m2_per_hz, self.a),
            Which::B => (&self.coarse.bb_m2_per_hz, self.b),
        };
        let spectrum = SampledSpectrum::new(self.coarse.df_hz, &density[..]).map_err(|_| flat)?;
        let records: Vec<Record> = pair
            .stretches()
            .into_iter()
            .filter_map(|(a_m, b_m)| Record::new(if which == Which::A { a_m } else { b_m }, pair.rate_hz).ok())
            .collect();
        // Intervals need one record: joined over the gaps, whose few jumps weigh nothing beside the waves.
        let joined: Vec<f64> = records.iter().flat_map(|record| record.samples_m().iter().copied()).collect();
        let joined = Record::new(joined, pair.rate_hz).map_err(|_| flat)?;
        let found = spectrum.statistics(self.band_hz.0, self.band_hz.1).ok_or(flat)?;
        let intervals = SpectralIntervals::of(&joined, &spectrum, &found, self.band_hz).ok_or(flat)?;
        let peak = PeakPeriods::of(&spectrum, self.band_hz).ok_or(flat)?;
        // Beyond the noise of the worse one: both then count the same waves.
        let deadband_m = 2.0 * options.noise_a_m.max(options.noise_b_m);
        let all: Vec<Wave> = records.iter().flat_map(|record| waves(record, Crossing::Up, deadband_m)).collect();
        Ok(Waves {
            h_m0_m: found.h_m0_m,
            h_m0_95_m: intervals.h_m0_m,
            f_p_hz: 1.0 / peak.parabola_s,
            t_p_95_s: intervals.t_p_s,
            crossing: WaveStatistics::of(&all),
            crossing_95: WaveIntervals::of(&all),
            noise_m0_m2: moments.noise_m0_m2,
        })
    }
}
