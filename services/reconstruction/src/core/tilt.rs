//! How much of a patch's tilt is the autopilot's error?
//!
//! A tenth of a degree of attitude error tilts a 5 m patch by a centimetre from edge to edge: as much as the waves of a calm
//! lake. Taking all tilt out hides waves longer than the footprint; leaving it in adds waves that are not there. The mean water
//! surface is level, so a tilt that *stays* (in the body's axes) is a misalignment and is removed; of what comes and goes, the
//! share is removed that attitude noise of the stated size explains: the Wiener gain attitude variance / observed variance.
//! What is left in doubt goes into each cell's standard deviation.

use nalgebra::{Rotation2, Vector2};

use halcyon_model::Stamp;

/// Over this time the variance of the tilt is learnt, seconds: several waves.
const VARIANCE_MEMORY_S: f64 = 15.0;
/// Before anything is learnt: an r.m.s. slope of the fitted plane that waves may make …
const SLOPE_PRIOR: f64 = 0.015;
/// … believed as much as this time of observing, seconds. Too small a start would take the first waves for misalignment.
const PRIOR_S: f64 = 1.0;
/// Slopes of one wave are no independent witnesses: one counts in this time, seconds.
const CORRELATION_S: f64 = 1.0;
/// Over this time a misalignment may wander, seconds.
const BIAS_MEMORY_S: f64 = 300.0;
/// After a gap this long nothing learnt holds, seconds.
const GAP_MAX_S: f64 = 10.0;

/// What to take out of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TiltCorrection {
    /// Slope to subtract: metres up per metre north, and east.
    pub slope: Vector2<f64>,
    /// One standard deviation of the slope that is still wrong after that, each axis.
    pub sigma: f64,
}

/// Learns, patch by patch, what tilt is to be expected. Until it has, it takes little out and says how unsure it is.
#[derive(Debug, Clone, Copy, Default)]
pub struct TiltFilter {
    learnt: Option<Learnt>,
}

#[derive(Debug, Clone, Copy)]
struct Learnt {
    stamp: Stamp,
    /// For how long, seconds.
    observed_s: f64,
    /// Misalignment: slope in the body's forward and right axes, and its variance.
    bias: Vector2<f64>,
    bias_variance: f64,
    /// Variance of the slope about the bias, each axis.
    variance: f64,
}

impl TiltFilter {
    /// The correction for a patch whose fitted plane rises by `slope` (north, east) in the frame that the autopilot's attitude
    /// defines, which is itself uncertain by `attitude_sigma_rad`.
    pub fn observe(&mut self, stamp: Stamp, slope: Vector2<f64>, heading_rad: f64, attitude_sigma_rad: f64) -> TiltCorrection {
        let attitude_variance = attitude_sigma_rad * attitude_sigma_rad;
        if attitude_variance == 0.0 {
            // Attitude known: whatever the tilt, it is water.
            return TiltCorrection { slope: Vector2::zeros(), sigma: 0.0 };
        }
        let body_from_north_east = Rotation2::new(-heading_rad);
        let seen = body_from_north_east * slope;
        let fresh = Learnt {
            stamp,
            observed_s: 0.0,
            bias: Vector2::zeros(),
            bias_variance: attitude_variance,
            variance: attitude_variance + SLOPE_PRIOR * SLOPE_PRIOR,
        };
        let mut learnt = match self.learnt {
            Some(learnt) if (0.0..=GAP_MAX_S).contains(&stamp.seconds_since(learnt.stamp)) => learnt,
            _ => fresh,
        };
        let dt_s = stamp.seconds_since(learnt.stamp);
        learnt.stamp = stamp;
        // A scalar Kalman filter for each axis of a bias that wanders slowly.
        learnt.bias_variance = (learnt.bias_variance + attitude_variance * dt_s / BIAS_MEMORY_S).min(attitude_variance);
        let witness = learnt.variance * (CORRELATION_S / dt_s.max(1e-3)).max(1.0);
        let gain = learnt.bias_variance / (learnt.bias_variance + witness);
        let off = seen - learnt.bias;
        learnt.bias += off * gain;
        learnt.bias_variance *= 1.0 - gain;
        learnt.observed_s += dt_s;
        let blend = dt_s / (learnt.observed_s + PRIOR_S).min(VARIANCE_MEMORY_S);
        learnt.variance += (off.norm_squared() / 2.0 - learnt.variance) * blend.min(1.0);
        let share = (attitude_variance / learnt.variance.max(1e-12)).min(1.0);
        let correction = learnt.bias + (seen - learnt.bias) * share;
        self.learnt = Some(learnt);
        TiltCorrection {
            slope: body_from_north_east.inverse() * correction,
            sigma: (attitude_variance * (1.0 - share) + learnt.bias_variance).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn normal(random: &mut ChaCha8Rng) -> f64 {
        // Sum of twelve uniform numbers: close enough to normal, and nothing to import.
        (0..12).map(|_| rand::Rng::random::<f64>(random)).sum::<f64>() - 6.0
    }

    /// Slopes left after correction, root mean square over the second half of a minute at 5 Hz.
    fn left_over(attitude_sigma_rad: f64, wave: f64, bias: f64) -> f64 {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut filter = TiltFilter::default();
        let mut sum = 0.0;
        for i in 0..600 {
            let t_s = f64::from(i) * 0.2;
            let true_slope = Vector2::new(wave * (t_s * 2.1).sin(), 0.0);
            let error = Vector2::new(attitude_sigma_rad * normal(&mut random) + bias, attitude_sigma_rad * normal(&mut random));
            let correction = filter.observe(Stamp::from_secs_f64(t_s), true_slope + error, 0.0, attitude_sigma_rad.hypot(bias));
            if i >= 300 {
                sum += (true_slope + error - correction.slope - true_slope).norm_squared();
            }
        }
        (sum / 300.0_f64).sqrt()
    }

    #[test]
    fn on_calm_water_attitude_noise_goes() {
        assert!(left_over(0.004, 0.0, 0.0) < 0.3 * 0.004 * 2f64.sqrt());
    }

    #[test]
    fn a_misalignment_goes_even_under_waves() {
        assert!(left_over(0.002, 0.05, 0.01) < 0.012 * 0.6);
    }

    #[test]
    fn waves_far_above_the_noise_stay() {
        // Water slope of 5 % (3.5 % r.m.s.): at most a tenth of it may be mistaken for attitude noise.
        let left_over = left_over(0.002, 0.05, 0.0);
        assert!(left_over < 0.0035, "{left_over}");
    }

    #[test]
    fn a_known_attitude_is_taken_at_its_word() {
        let correction = TiltFilter::default().observe(Stamp::from_secs_f64(0.0), Vector2::new(0.1, 0.2), 1.0, 0.0);
        assert_eq!(correction, TiltCorrection { slope: Vector2::zeros(), sigma: 0.0 });
    }
}
