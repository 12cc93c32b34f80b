//! `[recorder]`: what is recorded, where, and how much of it is kept.

use serde::{Deserialize, Serialize};

/// Configuration of the recorder, TOML section `[recorder]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Folder for the recordings; made if it is not there.
    pub folder: String,
    /// Whether to record pictures (stereo pairs and previews) too: some 1 MB a second at 320×240 and 5 Hz.
    pub pictures: bool,
    /// What was recorded is on the disk after this, seconds of wall time.
    pub flush_s: f64,
    /// A file this large is ended and a new one begun, megabytes.
    pub file_max_mb: f64,
    /// A file this old is ended and a new one begun, seconds of fleet time.
    pub file_max_s: f64,
    /// The oldest recordings of this fleet are deleted when all of them are larger than this, megabytes.
    pub folder_max_mb: f64,
    /// Messages that may wait for the disk.
    pub queue_max_messages: usize,
    /// Megabytes that may wait for the disk.
    pub queue_max_mb: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            folder: "data/recordings".into(),
            pictures: false,
            flush_s: 2.0,
            file_max_mb: 512.0,
            file_max_s: 3600.0,
            folder_max_mb: 8192.0,
            queue_max_messages: 4096,
            queue_max_mb: 64.0,
        }
    }
}

/// Megabytes to bytes; the configuration's limits keep it exact.
#[must_use]
pub(crate) fn bytes(megabytes: f64) -> u64 {
    (megabytes * 1e6) as u64
}

impl halcyon_chassis::Section for Config {
    const NAME: &'static str = "recorder";

    fn validate(&self) -> Result<(), String> {
        if self.folder.trim().is_empty() {
            return Err("folder must name a folder".into());
        }
        // A range holds no NaN.
        for (key, value, range) in [
            ("flush_s", self.flush_s, 0.1..=60.0),
            ("file_max_mb", self.file_max_mb, 1.0..=1e6),
            ("file_max_s", self.file_max_s, 1.0..=1e6),
            ("folder_max_mb", self.folder_max_mb, 1.0..=1e9),
            ("queue_max_mb", self.queue_max_mb, 1.0..=1e4),
        ] {
            if !range.contains(&value) {
                return Err(format!("{key} must be in {} to {}, not {value}", range.start(), range.end()));
            }
        }
        if !(1..=1_000_000).contains(&self.queue_max_messages) {
            return Err(format!("queue_max_messages must be in 1 to 1000000, not {}", self.queue_max_messages));
        }
        if self.folder_max_mb < 2.0 * self.file_max_mb {
            return Err(format!(
                "folder_max_mb must be at least twice file_max_mb ({}), not {}",
                self.file_max_mb, self.folder_max_mb
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halcyon_chassis::Section as _;

    #[test]
    fn limits_are_checked() {
        assert_eq!(Config::default().validate(), Ok(()));
        let refused =
            |config: Config, key: &str| assert!(config.validate().is_err_and(|problem| problem.starts_with(key)), "{key}");
        refused(Config { folder: " ".into(), ..Config::default() }, "folder");
        refused(Config { flush_s: f64::NAN, ..Config::default() }, "flush_s");
        refused(Config { file_max_mb: 0.0, ..Config::default() }, "file_max_mb");
        refused(Config { queue_max_messages: 0, ..Config::default() }, "queue_max_messages");
        refused(Config { folder_max_mb: 600.0, ..Config::default() }, "folder_max_mb");
    }
}
