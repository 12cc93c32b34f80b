//! Which messages the autopilot must send and how often, and which of them to ask for (again).

use std::collections::BTreeMap;

use halcyon_model::Stamp;
use mavlink::MessageData as _;
use mavlink::dialects::ardupilotmega as ardu;

use super::mode::Family;

/// A wanted stream: message id, interval, and the silence after which it is asked for again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stream {
    /// MAVLink message id.
    pub message_id: u32,
    /// Interval, microseconds.
    pub interval_us: u32,
    /// Asked for again after so much silence, seconds.
    pub stall_s: f64,
}

impl Stream {
    /// Whether this firmware has it: each has its own way to say how its estimator is.
    #[must_use]
    pub fn suits(&self, family: Family) -> bool {
        match self.message_id {
            ardu::EKF_STATUS_REPORT_DATA::ID => family == Family::ArduPilot,
            ardu::ESTIMATOR_STATUS_DATA::ID => family == Family::Px4,
            _ => true,
        }
    }
}

const fn stream(message_id: u32, interval_us: u32, stall_s: f64) -> Stream {
    Stream { message_id, interval_us, stall_s }
}

/// What is asked for. Heartbeats come faster than the usual 1 Hz, since they tell that the pilot took over.
pub const STREAMS: [Stream; 12] = [
    stream(ardu::GLOBAL_POSITION_INT_DATA::ID, 100_000, 2.0),
    stream(ardu::ATTITUDE_QUATERNION_DATA::ID, 100_000, 2.0),
    // Where its local frame lies: setpoints with acceleration are taken only there.
    stream(ardu::LOCAL_POSITION_NED_DATA::ID, 100_000, 2.0),
    stream(ardu::HEARTBEAT_DATA::ID, 200_000, 3.0),
    stream(ardu::EXTENDED_SYS_STATE_DATA::ID, 200_000, 3.0),
    stream(ardu::SYS_STATUS_DATA::ID, 500_000, 4.0),
    stream(ardu::EKF_STATUS_REPORT_DATA::ID, 500_000, 4.0),
    stream(ardu::ESTIMATOR_STATUS_DATA::ID, 500_000, 4.0),
    stream(ardu::GPS_RAW_INT_DATA::ID, 500_000, 4.0),
    stream(ardu::BATTERY_STATUS_DATA::ID, 1_000_000, 8.0),
    stream(ardu::HOME_POSITION_DATA::ID, 1_000_000, 8.0),
    // Where there is a rangefinder.
    stream(ardu::DISTANCE_SENSOR_DATA::ID, 100_000, 8.0),
];

/// Asking for one stream again waits at least this long, growing to [`RETRY_S_MAX`] for what the autopilot doesn't have.
const RETRY_S: f64 = 3.0;
const RETRY_S_MAX: f64 = 60.0;

#[derive(Debug, Clone, Copy)]
struct Watch {
    heard: Option<Stamp>,
    asked: Option<Stamp>,
    retry_s: f64,
}

/// Watches the streams.
#[derive(Debug, Clone)]
pub struct Streams(BTreeMap<u32, (Stream, Watch)>);

impl Default for Streams {
    fn default() -> Self {
        let watch = Watch { heard: None, asked: None, retry_s: RETRY_S };
        Self(STREAMS.iter().map(|stream| (stream.message_id, (*stream, watch))).collect())
    }
}

impl Streams {
    /// A message came.
    pub fn observe(&mut self, message_id: u32, now: Stamp) {
        if let Some((_, watch)) = self.0.get_mut(&message_id) {
            watch.heard = Some(now);
            watch.retry_s = RETRY_S;
        }
    }

    /// Streams to ask for now; each is returned once per retry period.
    pub fn due(&mut self, now: Stamp) -> Vec<Stream> {
        let mut due = Vec::new();
        for (stream, watch) in self.0.values_mut() {
            // Asked for at least once, so that it comes at our rate and not at another client's.
            // What is dated ahead is neither: our clock was set back.
            let fresh = watch.heard.is_some_and(|heard| (0.0..stream.stall_s).contains(&now.seconds_since(heard)));
            let waited = watch.asked.is_none_or(|asked| !(0.0..watch.retry_s).contains(&now.seconds_since(asked)));
            if waited && (watch.asked.is_none() || !fresh) {
                if watch.asked.is_some() {
                    watch.retry_s = (watch.retry_s * 2.0).min(RETRY_S_MAX);
                }
                watch.asked = Some(now);
                due.push(*stream);
            }
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_firmware_is_asked_for_its_own_estimators_health() {
        let of = |family| STREAMS.iter().filter(|stream| stream.suits(family)).count();
        assert_eq!((of(Family::ArduPilot), of(Family::Px4)), (STREAMS.len() - 1, STREAMS.len() - 1));
    }

    #[test]
    fn all_are_asked_for_once_and_only_a_stalled_one_again() {
        let mut streams = Streams::default();
        let t0 = Stamp::from_secs_f64(100.0);
        assert_eq!(streams.due(t0).len(), STREAMS.len());
        assert!(streams.due(t0).is_empty());
        for step in 1..=100 {
            let now = t0.plus_secs_f64(f64::from(step) * 0.1);
            for stream in STREAMS {
                if stream.message_id != ardu::GPS_RAW_INT_DATA::ID {
                    streams.observe(stream.message_id, now);
                }
            }
            let due = streams.due(now);
            assert!(due.iter().all(|stream| stream.message_id == ardu::GPS_RAW_INT_DATA::ID));
            assert_eq!(!due.is_empty(), step == 30 || step == 90, "{step}");
        }
    }
}
