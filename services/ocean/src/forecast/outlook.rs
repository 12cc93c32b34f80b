//! What a fit says about a spot and a time.

use nalgebra::DMatrix;

use super::fit::Forecast;
use super::line::Variances;

/// A place on the water, in the axes of the readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Metres north.
    pub north_m: f64,
    /// Metres east.
    pub east_m: f64,
}

/// The sea at a spot and a time, with standard errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlook {
    /// When, seconds of the readings' clock.
    pub t_s: f64,
    /// Elevation over the mean water level, metres.
    pub elevation_m: f64,
    /// Its standard error, metres.
    pub elevation_sigma_m: f64,
    /// Slope northwards: metres up per metre north.
    pub slope_north: f64,
    /// Its standard error.
    pub slope_north_sigma: f64,
    /// Slope eastwards: metres up per metre east.
    pub slope_east: f64,
    /// Its standard error.
    pub slope_east_sigma: f64,
    /// Covariance of both slopes' errors: of waves from the north-east both err together.
    pub slope_covariance: f64,
    /// Speed of the surface at the spot, metres per second, positive up.
    pub vertical_speed_mps: f64,
    /// Its standard error, metres per second.
    pub vertical_speed_sigma_mps: f64,
    /// Shares of the sea's own variances that remain: 0 is known for certain, 1 is nothing known.
    pub ignorance: Ignorance,
}

/// Shares of the sea's own variances that remain after the readings, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ignorance {
    /// Of elevation.
    pub elevation: f64,
    /// Of the less known of both slopes.
    pub slope: f64,
    /// Of vertical speed.
    pub vertical_speed: f64,
}

impl Forecast {
    /// The sea at `spot` and `t_s`. Nothing is known (means of 0, the sea's own errors) of a place or time that is not finite, or farther from the
    /// readings than the prior's lines are good for.
    #[must_use]
    pub fn at(&self, spot: Spot, t_s: f64) -> Outlook {
        self.at_times(spot, &[t_s]).pop().unwrap_or_else(|| self.unknown(t_s))
    }

    /// The sea at `spot` and each of `times_s`: faster than one by one.
    #[must_use]
    pub fn at_times(&self, spot: Spot, times_s: &[f64]) -> Vec<Outlook> {
        let lines = self.prior.lines();
        let sea = self.prior.sea();
        // Columns: elevation, slope north, slope east, vertical speed at each time.
        let mut wanted = DMatrix::zeros(2 * lines.len(), 4 * times_s.len());
        let (north_m, east_m) = (spot.north_m - self.origin.0, spot.east_m - self.origin.1);
        for (place, &t_s) in times_s.iter().enumerate() {
            for (j, line) in lines.iter().enumerate() {
                let root_m = line.variance_m2.sqrt();
                let (k_north, k_east, omega) = (line.k_north_radpm, line.k_east_radpm, line.omega_radps);
                let phase_rad = k_north * north_m + k_east * east_m - omega * (t_s - self.origin.2);
                let (sin, cos) = phase_rad.sin_cos();
                for (column, by) in [(1, k_north), (2, k_east), (3, -omega)] {
                    wanted[(2 * j, 4 * place + column)] = -root_m * by * sin;
                    wanted[(2 * j + 1, 4 * place + column)] = root_m * by * cos;
                }
                wanted[(2 * j, 4 * place)] = root_m * cos;
                wanted[(2 * j + 1, 4 * place)] = root_m * sin;
            }
        }
        let means = wanted.tr_mul(&self.amplitudes);
        let mut told = &self.features * &wanted;
        let solved = self.factor.l_dirty().solve_lower_triangular_mut(&mut told);
        let rest = self.prior.rest().as_array();
        let all = sea.as_array();
        let one = |(place, &t_s): (usize, &f64)| {
            if !solved || !self.reaches(spot, t_s) {
                return self.unknown(t_s);
            }
            let mean = [0, 1, 2, 3].map(|q| means[4 * place + q]);
            // The prior's variance less what the readings tell; rounding must not take more than there is.
            let left = [0, 1, 2, 3].map(|q| (all[q] - rest[q] - told.column(4 * place + q).norm_squared()).max(0.0) + rest[q]);
            let both = told.column(4 * place + 1).dot(&told.column(4 * place + 2));
            outlook(t_s, mean, left, sea.slope_covariance - both, &sea, self.inflation)
        };
        times_s.iter().enumerate().map(one).collect()
    }

    /// The sea's own spread and no more.
    fn unknown(&self, t_s: f64) -> Outlook {
        let sea = self.prior.sea();
        outlook(t_s, [0.0; 4], sea.as_array(), sea.slope_covariance, &sea, self.inflation)
    }
}

fn outlook(t_s: f64, mean: [f64; 4], left: [f64; 4], slope_covariance: f64, sea: &Variances, inflation: f64) -> Outlook {
    let sigma = left.map(|variance| (variance * inflation).sqrt());
    let all = sea.as_array();
    // A slope across long-crested waves has no variance at all: there is nothing not to know.
    let share = |q: usize| if all[q] > 0.0 { (left[q] / all[q]).min(1.0) } else { 0.0 };
    Outlook {
        t_s,
        elevation_m: mean[0],
        elevation_sigma_m: sigma[0],
        slope_north: mean[1],
        slope_north_sigma: sigma[1],
        slope_east: mean[2],
        slope_east_sigma: sigma[2],
        slope_covariance: slope_covariance * inflation,
        vertical_speed_mps: mean[3],
        vertical_speed_sigma_mps: sigma[3],
        ignorance: Ignorance { elevation: share(0), slope: share(1).max(share(2)), vertical_speed: share(3) },
    }
}
