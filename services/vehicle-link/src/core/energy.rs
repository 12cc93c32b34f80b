//! The charge that it takes to fly home, by what the flight has used so far.

use std::collections::VecDeque;

/// A reading is kept every so many seconds, so many of them: the last one to two and a half minutes.
const MARK_S: f64 = 30.0;
const MARKS_MAX: usize = 6;
/// Believed once it spans so long, seconds: readings come in whole percents.
const SPAN_S_MIN: f64 = 60.0;
/// A measured rate is believed within these multiples of the configured one.
const RATE_SHARE: (f64, f64) = (0.25, 4.0);

/// How fast the battery empties in flight.
#[derive(Debug, Clone, Default)]
pub struct Consumption {
    flown_s: f64,
    /// Seconds flown, and the fraction left then.
    marks: VecDeque<(f64, f64)>,
    newest: Option<f64>,
}

impl Consumption {
    /// Takes the fraction left, `dt_s` after the last time; one that isn't known just takes its time.
    pub fn observe(&mut self, fraction: Option<f64>, dt_s: f64) {
        self.flown_s += dt_s;
        let Some(fraction) = fraction else { return };
        self.newest = Some(fraction);
        if self.marks.back().is_none_or(|(at_s, _)| self.flown_s - at_s >= MARK_S) {
            self.marks.push_back((self.flown_s, fraction));
            if self.marks.len() > MARKS_MAX {
                self.marks.pop_front();
            }
        }
    }

    /// Fraction used a second; `endurance_s`, from full to empty, until it is measured.
    #[must_use]
    pub fn rate_hz(&self, endurance_s: f64) -> f64 {
        let usual_hz = 1.0 / endurance_s;
        let measured_hz = self.marks.front().zip(self.newest).and_then(|((at_s, then), now)| {
            let span_s = self.flown_s - at_s;
            (span_s >= SPAN_S_MIN).then(|| (then - now) / span_s)
        });
        measured_hz.map_or(usual_hz, |hz| hz.clamp(RATE_SHARE.0 * usual_hz, RATE_SHARE.1 * usual_hz))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_whole_percents_is_measured_and_until_then_the_configured_one_counts() {
        let mut consumption = Consumption::default();
        for step in 0..3000u32 {
            let flown_s = f64::from(step) * 0.1;
            // Empty in 600 s.
            let fraction = ((0.9 - flown_s / 600.0) * 100.0).ceil() / 100.0;
            consumption.observe((step % 3 == 0).then_some(fraction), 0.1);
            let rate_hz = consumption.rate_hz(1200.0);
            if flown_s < 59.0 {
                assert_eq!(rate_hz, 1.0 / 1200.0);
            } else if flown_s > 61.0 {
                // One percent of rounding over at least a minute.
                assert!((rate_hz - 1.0 / 600.0).abs() <= 0.0101 / 60.0, "{flown_s} {rate_hz}");
            }
        }
        assert!((consumption.rate_hz(1200.0) * 600.0 - 1.0).abs() < 0.06);
    }

    #[test]
    fn a_battery_that_seems_to_fill_up_is_not_believed() {
        let mut consumption = Consumption::default();
        for step in 0..200 {
            consumption.observe(Some(0.5 + 0.002 * f64::from(step)), 1.0);
        }
        assert_eq!(consumption.rate_hz(1000.0), 0.25 / 1000.0);
        assert_eq!(Consumption::default().rate_hz(1000.0), 1.0 / 1000.0);
    }
}
