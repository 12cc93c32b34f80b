//! Which client wants which message how often. Every link has its own table, as every ArduPilot channel has.

use halcyon_model::Stamp;
use mavlink::MessageData;
use mavlink::dialects::ardupilotmega as mav;

/// One client's connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LinkId(pub u64);

/// What "the default rate" means to MAV_CMD_SET_MESSAGE_INTERVAL here, microseconds: ArduPilot's simulator streams at 4 Hz.
const DEFAULT_INTERVAL_US: i64 = 250_000;
/// No faster than this, microseconds.
const INTERVAL_MIN_US: i64 = 5_000;

/// Every message that can be streamed or asked for, with the old stream group it belongs to.
pub(crate) const STREAMABLE: &[(u32, mav::MavDataStream)] = {
    use mav::MavDataStream as Group;
    &[
        (mav::RAW_IMU_DATA::ID, Group::MAV_DATA_STREAM_RAW_SENSORS),
        (mav::SCALED_IMU2_DATA::ID, Group::MAV_DATA_STREAM_RAW_SENSORS),
        (mav::SCALED_PRESSURE_DATA::ID, Group::MAV_DATA_STREAM_RAW_SENSORS),
        (mav::SYS_STATUS_DATA::ID, Group::MAV_DATA_STREAM_EXTENDED_STATUS),
        (mav::GPS_RAW_INT_DATA::ID, Group::MAV_DATA_STREAM_EXTENDED_STATUS),
        (mav::MISSION_CURRENT_DATA::ID, Group::MAV_DATA_STREAM_EXTENDED_STATUS),
        (mav::FENCE_STATUS_DATA::ID, Group::MAV_DATA_STREAM_EXTENDED_STATUS),
        (mav::POSITION_TARGET_GLOBAL_INT_DATA::ID, Group::MAV_DATA_STREAM_EXTENDED_STATUS),
        (mav::RC_CHANNELS_DATA::ID, Group::MAV_DATA_STREAM_RC_CHANNELS),
        (mav::SERVO_OUTPUT_RAW_DATA::ID, Group::MAV_DATA_STREAM_RC_CHANNELS),
        (mav::GLOBAL_POSITION_INT_DATA::ID, Group::MAV_DATA_STREAM_POSITION),
        (mav::LOCAL_POSITION_NED_DATA::ID, Group::MAV_DATA_STREAM_POSITION),
        (mav::ATTITUDE_DATA::ID, Group::MAV_DATA_STREAM_EXTRA1),
        (mav::SIMSTATE_DATA::ID, Group::MAV_DATA_STREAM_EXTRA1),
        (mav::VFR_HUD_DATA::ID, Group::MAV_DATA_STREAM_EXTRA2),
        (mav::SYSTEM_TIME_DATA::ID, Group::MAV_DATA_STREAM_EXTRA3),
        (mav::RANGEFINDER_DATA::ID, Group::MAV_DATA_STREAM_EXTRA3),
        (mav::DISTANCE_SENSOR_DATA::ID, Group::MAV_DATA_STREAM_EXTRA3),
        (mav::BATTERY_STATUS_DATA::ID, Group::MAV_DATA_STREAM_EXTRA3),
        (mav::EKF_STATUS_REPORT_DATA::ID, Group::MAV_DATA_STREAM_EXTRA3),
        // Only by MAV_CMD_SET_MESSAGE_INTERVAL or MAV_CMD_REQUEST_MESSAGE: no old group carries them.
        (mav::ATTITUDE_QUATERNION_DATA::ID, Group::MAV_DATA_STREAM_RAW_CONTROLLER),
        (mav::POSITION_TARGET_LOCAL_NED_DATA::ID, Group::MAV_DATA_STREAM_RAW_CONTROLLER),
        (mav::SCALED_IMU_DATA::ID, Group::MAV_DATA_STREAM_RAW_CONTROLLER),
        (mav::RELAY_STATUS_DATA::ID, Group::MAV_DATA_STREAM_RAW_CONTROLLER),
        (mav::EXTENDED_SYS_STATE_DATA::ID, Group::MAV_DATA_STREAM_RAW_CONTROLLER),
        (mav::HOME_POSITION_DATA::ID, Group::MAV_DATA_STREAM_RAW_CONTROLLER),
        (mav::GPS_GLOBAL_ORIGIN_DATA::ID, Group::MAV_DATA_STREAM_RAW_CONTROLLER),
        (mav::AUTOPILOT_VERSION_DATA::ID, Group::MAV_DATA_STREAM_RAW_CONTROLLER),
        (mav::HEARTBEAT_DATA::ID, Group::MAV_DATA_STREAM_RAW_CONTROLLER),
    ]
};

/// Whether a message can be streamed.
pub(crate) fn is_streamable(message_id: u32) -> bool {
    STREAMABLE.iter().any(|(id, _)| *id == message_id)
}

/// One link's wishes.
#[derive(Debug, Clone)]
pub(crate) struct Link {
    pub(crate) id: LinkId,
    /// Message, interval in microseconds, next due.
    streams: Vec<(u32, i64, Stamp)>,
    /// Next parameter to send while a list is under way.
    pub(crate) next_param: Option<usize>,
}

impl Link {
    /// Only heartbeats, every second.
    pub(crate) fn new(id: LinkId, now: Stamp) -> Self {
        Self { id, streams: vec![(mav::HEARTBEAT_DATA::ID, 1_000_000, now)], next_param: None }
    }

    /// Sets a message's interval: 0 the default, negative stops it.
    pub(crate) fn set_interval(&mut self, message_id: u32, interval_us: i64, now: Stamp) {
        self.streams.retain(|(id, ..)| *id != message_id);
        if interval_us >= 0 {
            let wanted_us = if interval_us == 0 { DEFAULT_INTERVAL_US } else { interval_us.max(INTERVAL_MIN_US) };
            self.streams.push((message_id, wanted_us, now));
        }
    }

    /// A message's interval, microseconds; `None` when it is not streamed.
    pub(crate) fn interval_us(&self, message_id: u32) -> Option<i64> {
        self.streams.iter().find(|(id, ..)| *id == message_id).map(|(_, interval_us, _)| *interval_us)
    }

    /// Sets all of an old stream group: `rate_hz` 0 stops it.
    pub(crate) fn set_group(&mut self, group: mav::MavDataStream, rate_hz: u16, now: Stamp) {
        let all = group == mav::MavDataStream::MAV_DATA_STREAM_ALL;
        let interval_us = if rate_hz == 0 { -1 } else { 1_000_000 / i64::from(rate_hz) };
        for (message_id, member_of) in STREAMABLE {
            let named = *member_of == group && group != mav::MavDataStream::MAV_DATA_STREAM_RAW_CONTROLLER;
            if named || (all && *member_of != mav::MavDataStream::MAV_DATA_STREAM_RAW_CONTROLLER) {
                self.set_interval(*message_id, interval_us, now);
            }
        }
    }

    /// Makes a message due now.
    pub(crate) fn hurry(&mut self, message_id: u32, now: Stamp) {
        if let Some(stream) = self.streams.iter_mut().find(|(id, ..)| *id == message_id) {
            stream.2 = now;
        }
    }

    /// Calls `send` for each message that is due.
    pub(crate) fn due(&mut self, now: Stamp, mut send: impl FnMut(u32)) {
        for (message_id, interval_us, due) in &mut self.streams {
            if now < *due {
                continue;
            }
            send(*message_id);
            let interval_s = *interval_us as f64 * 1e-6;
            *due = due.plus_secs_f64(interval_s);
            if *due <= now {
                // Far behind: no burst.
                *due = now.plus_secs_f64(interval_s);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_keeps_its_rate_and_stops() {
        let start = Stamp::from_nanos(1_000_000_000);
        let mut link = Link::new(LinkId(1), start);
        link.set_interval(mav::ATTITUDE_DATA::ID, 20_000, start);
        let count = |link: &mut Link, from_step: i64| {
            let (mut attitudes, mut heartbeats) = (0, 0);
            for step in from_step..from_step + 4000 {
                link.due(Stamp::from_nanos(1_000_000_000 + step * 2_500_000), |id| {
                    attitudes += usize::from(id == mav::ATTITUDE_DATA::ID);
                    heartbeats += usize::from(id == mav::HEARTBEAT_DATA::ID);
                });
            }
            (attitudes, heartbeats)
        };
        assert_eq!(count(&mut link, 0), (500, 10));
        link.set_interval(mav::ATTITUDE_DATA::ID, -1, start);
        assert_eq!(count(&mut link, 4000), (0, 10));
    }

    #[test]
    fn an_old_group_sets_its_members_only() {
        let mut link = Link::new(LinkId(1), Stamp::default());
        link.set_group(mav::MavDataStream::MAV_DATA_STREAM_POSITION, 10, Stamp::default());
        assert_eq!(link.interval_us(mav::GLOBAL_POSITION_INT_DATA::ID), Some(100_000));
        assert_eq!(link.interval_us(mav::ATTITUDE_DATA::ID), None);
        link.set_group(mav::MavDataStream::MAV_DATA_STREAM_ALL, 0, Stamp::default());
        assert_eq!(link.interval_us(mav::GLOBAL_POSITION_INT_DATA::ID), None);
        assert_eq!(link.interval_us(mav::HEARTBEAT_DATA::ID), Some(1_000_000));
    }
}
