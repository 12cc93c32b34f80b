//! The sea some seconds ahead at a spot, from the readings of the last seconds around it; and its quiet moments.
//!
//! A linear sea is a sum of plane waves that obey the dispersion relation, with independent normal amplitudes whose variances are the
//! spectrum's. Seen so, readings and forecasts are jointly normal, and the forecast of least error, with that error, is the mean and
//! variance given the readings: Bayesian regression over the amplitudes, or a Gaussian process whose covariance is the dispersion
//! relation's (Rasmussen & Williams 2006, eq. 2.11 and 2.25). How far ahead it can see is the sea's doing: waves reach the spot with the
//! speed of their groups, so those that come later than (edge − spot)/c_g have not been seen (Wu 2004, *Phase-resolved wave forecasts*,
//! MIT; Naaijen et al. 2014), but for what a narrow band tells.
//!
//! Bounded work: a fit is of 320 readings and 500 lines at most by default, whatever is given (see [`Options`] and [`Grid`]).
//!
//! | module | holds |
//! |---|---|
//! | [`line`] | a plane wave and its prior variance; what the waves left out add |
//! | [`grid`] | lines for a spectrum and a spread |
//! | [`reading`] | a reading; which are used where there are too many |
//! | [`fit`] | the regression |
//! | [`tune`] | a spectrum set right by the readings |
//! | [`outlook`] | elevation, slopes and vertical speed at a time, with their errors |
//! | [`calm`] | stretches within limits |

pub mod calm;
pub mod fit;
pub mod grid;
pub mod line;
pub mod outlook;
pub mod reading;
pub mod tune;

pub use calm::{Bounds, Limits, Window};
pub use fit::{Forecast, Level, Options};
pub use grid::Grid;
pub use line::{Line, Prior, Variances};
pub use outlook::{Outlook, Spot};
pub use reading::Reading;
pub use tune::{Search, Tuned};

/// Why there is no forecast.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ForecastError {
    /// A line is none.
    #[error("line {index} has a number that is not finite or a negative variance")]
    Line {
        /// Its index.
        index: usize,
    },
    /// No line has any variance.
    #[error("no line has any variance: the sea is flat or unknown")]
    NoLines,
    /// The grid of lines is none.
    #[error("frequencies must rise from above 0 Hz, the span be above 0 s, and the extent not negative")]
    Grid,
    /// The time of the forecast is not finite.
    #[error("now is not a finite time")]
    Now,
    /// No usable reading.
    #[error("none of {given} readings is finite, with an error above 0 and of the last seconds")]
    NoReadings {
        /// Readings given.
        given: usize,
    },
    /// Readings contradict each other beyond the arithmetic's reach.
    #[error("the readings' covariance cannot be factored")]
    Singular,
}

#[cfg(test)]
mod tests;
