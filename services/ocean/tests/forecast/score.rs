//! Forecasts against the sea.

use std::time::{Duration, Instant};

use halcyon_ocean::CosTwoS;
use halcyon_ocean::Spectrum;
use halcyon_ocean::forecast::grid::interpolated;
use halcyon_ocean::forecast::{Forecast, Grid, Limits, Options, Prior, Reading, Search, Spot};

use super::seas::{Case, Sea};

/// What the forecaster believes of the sea.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Belief {
    /// The sea's own spectrum and direction.
    Right,
    /// Off by a factor in period and a turn in degrees, believed as it is.
    Wrong(f64, f64),
    /// The same, set right by the readings.
    Tuned(f64, f64),
    /// Welch's spectrum of the record, a spread of s = 8, and the direction from the readings.
    Welch,
    /// Welch's spectrum, all round.
    WelchAllRound,
}

pub(crate) const SPAN_S: f64 = 20.0;
pub(crate) const SPOT: Spot = Spot { north_m: 0.2, east_m: -0.3 };
pub(crate) const LEADS_S: [f64; 6] = [0.0, 1.0, 2.0, 3.0, 5.0, 8.0];

pub(crate) fn prior(case: &Case, belief: Belief, sea: &mut Sea, readings: &[Reading], options: &Options) -> Prior {
    let about = |peak_hz: f64| Grid::about_peak(peak_hz, options.span_s + 10.0, 5.7);
    let spread = |s: f64| CosTwoS::new(s).unwrap();
    let (factor, turn_deg) = match belief {
        Belief::Wrong(factor, turn_deg) | Belief::Tuned(factor, turn_deg) => (factor, turn_deg),
        _ => (1.0, 0.0),
    };
    let (spectrum, towards) = (case.spectrum(factor), sea.towards_rad + f64::to_radians(turn_deg));
    let (s, grid) = (spread(case.s), about(spectrum.peak_hz()));
    let density = |f: f64, rad: f64| spectrum.density_m2_per_hz(f) * s.density_per_rad(rad - towards);
    match belief {
        Belief::Right | Belief::Wrong(..) => grid.directional(density).unwrap(),
        Belief::Tuned(..) => grid.tuned(density, readings, 0.0, options, &Search::near()).unwrap().prior,
        Belief::Welch | Belief::WelchAllRound => {
            let table = sea.welch(SPAN_S);
            let grid = about(table.statistics(0.1, 1.5).unwrap().f_p_hz);
            if belief == Belief::WelchAllRound {
                return grid.spread(interpolated(&table), 0.0, spread(0.0)).unwrap();
            }
            let (at, wide) = (interpolated(&table), spread(8.0));
            let density = |f: f64, rad: f64| at(f) * wide.density_per_rad(rad);
            grid.tuned(density, readings, 0.0, options, &Search::all_round()).unwrap().prior
        }
    }
}

/// Sums over seas, by quantity (elevation, slope north, slope east, vertical speed) and lead.
#[derive(Debug, Default)]
pub(crate) struct Score {
    pub(crate) seas: f64,
    error: [[f64; 6]; 4],
    own: [[f64; 6]; 4],
    inside: [[f64; 6]; 4],
    stated: [f64; 6],
    pub(crate) prior_took: Duration,
    pub(crate) fit_took: Duration,
    pub(crate) outlooks_took: Duration,
}

impl Score {
    pub(crate) fn of(case: Case, belief: Belief, options: &Options, seeds: std::ops::Range<u64>) -> Self {
        let mut score = Self::default();
        for seed in seeds {
            let mut sea = Sea::new(case, seed);
            let readings = sea.readings(SPAN_S);
            let begin = Instant::now();
            let prior = prior(&case, belief, &mut sea, &readings, options);
            score.prior_took += begin.elapsed();
            let begin = Instant::now();
            let forecast = Forecast::fit(&readings, &prior, 0.0, options).unwrap();
            score.fit_took += begin.elapsed();
            let begin = Instant::now();
            let ten_seconds: Vec<f64> = (0..=50).map(|i| 0.2 * f64::from(i)).collect();
            std::hint::black_box(forecast.at_times(SPOT, &ten_seconds));
            score.outlooks_took += begin.elapsed();
            score.seas += 1.0;
            for (i, o) in forecast.at_times(SPOT, &LEADS_S).iter().enumerate() {
                let truth = sea.truth(SPOT.north_m, SPOT.east_m, LEADS_S[i]);
                let means = [o.elevation_m, o.slope_north, o.slope_east, o.vertical_speed_mps];
                let sigmas = [o.elevation_sigma_m, o.slope_north_sigma, o.slope_east_sigma, o.vertical_speed_sigma_mps];
                score.stated[i] += 1.0 - o.ignorance.elevation;
                for q in 0..4 {
                    score.error[q][i] += (means[q] - truth[q]).powi(2);
                    score.own[q][i] += truth[q].powi(2);
                    score.inside[q][i] += f64::from(u8::from((means[q] - truth[q]).abs() <= 1.96 * sigmas[q]));
                }
            }
        }
        score
    }

    /// Root mean square error of elevation, metres.
    pub(crate) fn rmse_m(&self, lead: usize) -> f64 {
        (self.error[0][lead] / self.seas).sqrt()
    }

    /// 1 − mean square error over mean square: of elevation, of both slopes, of vertical speed.
    pub(crate) fn skills(&self, lead: usize) -> [f64; 3] {
        [&[0][..], &[1, 2], &[3]].map(|of| {
            let sum = |what: &[[f64; 6]; 4]| of.iter().map(|&q| what[q][lead]).sum::<f64>();
            1.0 - sum(&self.error) / sum(&self.own)
        })
    }

    /// Mean of 1 − the forecast's own variance over the sea's: the skill that it claims.
    pub(crate) fn stated(&self, lead: usize) -> f64 {
        self.stated[lead] / self.seas
    }

    /// Share within 1.96 standard errors over all quantities and the leads in `of`.
    pub(crate) fn coverage(&self, of: &[usize]) -> f64 {
        of.iter().map(|&lead| (0..4).map(|q| self.inside[q][lead]).sum::<f64>()).sum::<f64>()
            / (4.0 * self.seas * of.len() as f64)
    }
}

/// Windows offered, and of them those in which the sea broke a limit.
#[derive(Debug, Default)]
pub(crate) struct Calm {
    pub(crate) seas: f64,
    pub(crate) seas_with_one: f64,
    pub(crate) offered: f64,
    pub(crate) broken: f64,
    /// Moments as long at random in the same ten seconds that are broken.
    pub(crate) random_broken: f64,
    pub(crate) lead_s: f64,
    pub(crate) length_s: f64,
}

impl Calm {
    /// Limits are `tightness` standard deviations of the sea, of the slope 1.4 times that.
    pub(crate) fn of(case: Case, belief: Belief, options: &Options, tightness: f64, seeds: std::ops::Range<u64>) -> Self {
        let mut calm = Self::default();
        for seed in seeds {
            let mut sea = Sea::new(case, seed);
            let readings = sea.readings(SPAN_S);
            let own = prior(&case, Belief::Right, &mut sea, &readings, options).sea();
            let limits = Limits {
                crest_m: tightness * own.elevation_m2.sqrt(),
                slope: tightness * 1.4 * (own.slope_north + own.slope_east).sqrt(),
                vertical_speed_mps: tightness * own.vertical_speed_m2ps2.sqrt(),
            };
            let prior = prior(&case, belief, &mut sea, &readings, options);
            let forecast = Forecast::fit(&readings, &prior, 0.0, options).unwrap();
            let windows = forecast.calm_windows(SPOT, &limits, 0.0, 10.0, 0.8);
            calm.seas += 1.0;
            calm.seas_with_one += f64::from(u8::from(!windows.is_empty()));
            for window in windows {
                let length_s = window.to_s - window.from_s;
                calm.offered += 1.0;
                calm.lead_s += window.from_s;
                calm.length_s += length_s;
                calm.broken += f64::from(u8::from(breaks(&sea, &limits, window.from_s, length_s)));
                let from_s = 10.0 * sea.dice();
                calm.random_broken += f64::from(u8::from(breaks(&sea, &limits, from_s, length_s)));
            }
        }
        calm
    }
}

fn breaks(sea: &Sea, limits: &Limits, from_s: f64, length_s: f64) -> bool {
    (0..=(length_s / 0.02) as u32).any(|i| {
        let [elevation, north, east, speed] = sea.truth(SPOT.north_m, SPOT.east_m, from_s + 0.02 * f64::from(i));
        elevation > limits.crest_m || north.hypot(east) > limits.slope || speed.abs() > limits.vertical_speed_mps
    })
}
