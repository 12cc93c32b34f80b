//! A share of a link's capacity: a token bucket. What ground stations send must not fill a serial port's queue, behind which
//! our own setpoints would wait.

use halcyon_model::Stamp;

/// Bytes that may be sent.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    rate_bps: f64,
    burst_bytes: f64,
    left_bytes: f64,
    at: Option<Stamp>,
}

impl Budget {
    /// `rate_bps`: bytes per second; `burst_bytes` at once.
    #[must_use]
    pub fn new(rate_bps: f64, burst_bytes: f64) -> Self {
        Self { rate_bps, burst_bytes, left_bytes: burst_bytes, at: None }
    }

    /// Seconds to wait before the next frame may go; 0 if it may go now. A frame may overdraw: the next one waits for that.
    #[must_use]
    pub fn wait_s(&mut self, now: Stamp) -> f64 {
        let passed_s = self.at.map_or(0.0, |at| now.seconds_since(at)).max(0.0);
        self.at = Some(now);
        self.left_bytes = (self.left_bytes + passed_s * self.rate_bps).min(self.burst_bytes);
        (-self.left_bytes / self.rate_bps).max(0.0)
    }

    /// So much was sent.
    pub fn spend(&mut self, bytes: usize) {
        self.left_bytes -= bytes as f64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn over_a_minute_the_rate_is_kept_to_a_burst() {
        let mut budget = Budget::new(2880.0, 600.0);
        let mut sent = 0;
        for step in 0..60_000_i32 {
            let now = Stamp::from_secs_f64(1000.0).plus_secs_f64(f64::from(step) * 1e-3);
            if budget.wait_s(now) <= 0.0 {
                budget.spend(280);
                sent += 280;
            }
        }
        let expected = 2880.0 * 60.0;
        assert!((f64::from(sent) - expected).abs() <= 600.0 + 280.0, "{sent} of {expected}");
    }
}
