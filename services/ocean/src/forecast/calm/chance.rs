//! How probable it is that the sea breaks a limit at a moment.

use super::Limits;
use crate::crests::distribution::normal_exceedance;
use crate::forecast::outlook::Outlook;

/// The chance that any limit is broken: at most the sum of each.
pub(super) fn broken(limits: &Limits, outlook: &Outlook) -> f64 {
    let above = |limit: f64, mean: f64, sigma: f64| if limit == f64::INFINITY { 0.0 } else { exceedance(limit - mean, sigma) };
    let Outlook { vertical_speed_mps, vertical_speed_sigma_mps, .. } = *outlook;
    let crest = above(limits.crest_m, outlook.elevation_m, outlook.elevation_sigma_m);
    let rise = above(limits.vertical_speed_mps, vertical_speed_mps, vertical_speed_sigma_mps);
    let fall = above(limits.vertical_speed_mps, -vertical_speed_mps, vertical_speed_sigma_mps);
    crest + rise + fall + steeper(limits.slope, outlook)
}

/// The chance that a normal variable of mean 0 exceeds `by`; NaN for NaN.
fn exceedance(by: f64, sigma: f64) -> f64 {
    if by.is_nan() || sigma.is_nan() {
        f64::NAN
    } else if sigma > 0.0 {
        normal_exceedance(by / sigma)
    } else if by < 0.0 {
        1.0
    } else {
        0.0
    }
}

/// Principal standard errors of the slope, the larger first, each with the mean along its axis.
pub(super) fn axes(outlook: &Outlook) -> ((f64, f64), (f64, f64)) {
    let (nn, ee) = (outlook.slope_north_sigma.powi(2), outlook.slope_east_sigma.powi(2));
    let (half, covariance) = (0.5 * (nn - ee), outlook.slope_covariance);
    let (middle, radius) = (0.5 * (nn + ee), half.hypot(covariance));
    let (sin, cos) = (0.5 * covariance.atan2(half)).sin_cos();
    let (north, east) = (outlook.slope_north, outlook.slope_east);
    let sigma = |variance: f64| variance.max(0.0).sqrt();
    ((sigma(middle + radius), north * cos + east * sin), (sigma(middle - radius), east * cos - north * sin))
}

/// The chance that the slope's magnitude exceeds `limit`: the normal density of its part along the lesser axis times the chance that the
/// other then leaves the circle, by the midpoint rule.
fn steeper(limit: f64, outlook: &Outlook) -> f64 {
    const STEPS: u32 = 24;
    const REACH: f64 = 4.0;
    if limit == f64::INFINITY {
        return 0.0;
    }
    let ((major, along), (minor, across)) = axes(outlook);
    let step = 2.0 * REACH / f64::from(STEPS);
    let (mut sum, mut weights) = (0.0, 0.0);
    for i in 0..STEPS {
        let z = (f64::from(i) + 0.5) * step - REACH;
        let weight = (-0.5 * z * z).exp();
        let side = across + z * minor;
        let room = (limit * limit - side * side).sqrt();
        let outside = if side.abs() > limit || limit < 0.0 {
            1.0
        } else {
            exceedance(room - along, major) + exceedance(room + along, major)
        };
        sum += weight * outside;
        weights += weight;
    }
    sum / weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forecast::outlook::Ignorance;
    use approx::assert_relative_eq;

    fn still() -> Outlook {
        Outlook {
            t_s: 0.0,
            elevation_m: 0.0,
            elevation_sigma_m: 0.0,
            slope_north: 0.0,
            slope_north_sigma: 0.0,
            slope_east: 0.0,
            slope_east_sigma: 0.0,
            slope_covariance: 0.0,
            vertical_speed_mps: 0.0,
            vertical_speed_sigma_mps: 0.0,
            ignorance: Ignorance { elevation: 0.0, slope: 0.0, vertical_speed: 0.0 },
        }
    }

    /// Of one direction alone: the normal tails; of both alike about 0: Rayleigh's exp(−L²/2σ²); turned by 45°: the same as unturned.
    #[test]
    fn chances_of_slopes_are_closed_forms() {
        for limit in [0.05, 0.1, 0.2, 0.3] {
            let round = Outlook { slope_north_sigma: 0.1, slope_east_sigma: 0.1, ..still() };
            // The circle's edge falls between two steps: a few percent where the chance is high, and no matter.
            let rayleigh = (-0.5 * (limit / 0.1_f64).powi(2)).exp();
            assert_relative_eq!(steeper(limit, &round), rayleigh, max_relative = 3e-2);
            let line = Outlook { slope_north: 0.05, slope_north_sigma: 0.1, ..still() };
            let tails = normal_exceedance((limit - 0.05) / 0.1) + normal_exceedance((limit + 0.05) / 0.1);
            assert_relative_eq!(steeper(limit, &line), tails, max_relative = 1e-9);
            let (part, mean) = (0.1 * 0.5f64.sqrt(), 0.05 * 0.5f64.sqrt());
            let turned = Outlook {
                slope_north: mean,
                slope_east: -mean,
                slope_north_sigma: part,
                slope_east_sigma: part,
                slope_covariance: -part * part,
                ..still()
            };
            assert_relative_eq!(steeper(limit, &turned), tails, max_relative = 1e-6);
        }
        assert_eq!(steeper(f64::INFINITY, &still()), 0.0);
    }

    #[test]
    fn chances_add_up_and_doubt_stays_doubt() {
        let outlook = Outlook { elevation_sigma_m: 0.1, vertical_speed_sigma_mps: 0.2, ..still() };
        let limits = Limits { crest_m: 0.1, slope: 0.1, vertical_speed_mps: 0.4 };
        assert_relative_eq!(broken(&limits, &outlook), 0.158_655_254 + 2.0 * 0.022_750_132, max_relative = 1e-6);
        assert!(broken(&Limits { crest_m: f64::NAN, ..limits }, &outlook).is_nan());
        assert!(broken(&Limits { slope: f64::NAN, ..limits }, &outlook).is_nan());
        assert_eq!(broken(&Limits { slope: -0.1, ..limits }, &still()), 1.0);
    }
}
