//! Which messages the autopilot must send and how often, and which of them to ask for (again).
//!
//! A channel of the autopilot has one rate a message, whoever asked for it: a ground station behind the relay, or another program on
//! the same channel, may change it by REQUEST_DATA_STREAM or SET_MESSAGE_INTERVAL. So what comes is counted. A higher rate than ours is
//! left as it is; one that is lowered is asked for again, ever less often.

use std::collections::BTreeMap;

use halcyon_model::Stamp;
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::{Message as _, MessageData as _};

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

    /// MAVLink's name of the message.
    fn name(&self) -> &'static str {
        MavMessage::default_message_from_id(self.message_id).map_or("a message", |message| message.message_name())
    }
}

const fn stream(message_id: u32, interval_us: u32, stall_s: f64) -> Stream {
    Stream { message_id, interval_us, stall_s }
}

/// What is asked for. Heartbeats come faster than the usual 1 Hz, since they tell that the pilot took over.
pub const STREAMS: [Stream; 13] = [
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
    // Where there are two receivers.
    stream(ardu::GPS2_RAW_DATA::ID, 500_000, 8.0),
    stream(ardu::BATTERY_STATUS_DATA::ID, 1_000_000, 8.0),
    stream(ardu::HOME_POSITION_DATA::ID, 1_000_000, 8.0),
    // Where there is a rangefinder.
    stream(ardu::DISTANCE_SENSOR_DATA::ID, 100_000, 8.0),
];

/// What is flown by: people are told when it comes too seldom, even if it never came more often.
const FLOWN_BY: [u32; 3] =
    [ardu::GLOBAL_POSITION_INT_DATA::ID, ardu::ATTITUDE_QUATERNION_DATA::ID, ardu::LOCAL_POSITION_NED_DATA::ID];

/// Asking for one stream again waits at least this long, growing to [`RETRY_S_MAX`] for what the autopilot doesn't have, and while
/// another client takes back what was asked for: of two that want different things, neither asks more than a few times a minute.
const RETRY_S: f64 = 3.0;
const RETRY_S_MAX: f64 = 60.0;
/// A stream is listened to for so long before it is first asked for, seconds: it may come often enough already.
const LOOK_S: f64 = 1.0;
/// A stream's messages are counted for so long, seconds.
const WINDOW_S: f64 = 5.0;
/// Less than this share of what was asked for is too little.
const SLOW_SHARE: f64 = 0.5;
/// And so much of it is what was asked for.
const FULL_SHARE: f64 = 0.9;
/// Looked at less often than this, messages may have waited elsewhere: counts say nothing, seconds.
const HELD_UP_S: f64 = 1.0;

#[derive(Debug, Clone, Copy)]
struct Watch {
    heard: Option<Stamp>,
    /// Asked for, or found to come as often, at that time.
    asked: Option<Stamp>,
    retry_s: f64,
    /// Counting since, and how many came.
    since: Option<Stamp>,
    count: u32,
    /// How often it came at last, if that was too seldom, hertz.
    slow_hz: Option<f64>,
    /// It has come as often as asked for.
    was_full: bool,
    /// Has been neither slow nor silent since.
    good_since: Option<Stamp>,
}

impl Watch {
    const NEW: Self = Self {
        heard: None,
        asked: None,
        retry_s: RETRY_S,
        since: None,
        count: 0,
        slow_hz: None,
        was_full: false,
        good_since: None,
    };

    /// What is dated ahead is silent too: our clock was set back.
    fn is_silent(&self, stream: &Stream, now: Stamp) -> bool {
        self.heard.is_none_or(|heard| !(0.0..stream.stall_s).contains(&now.seconds_since(heard)))
    }

    fn count_anew(&mut self, now: Stamp) {
        self.since = Some(now);
        self.count = 0;
    }

    /// The share of what was asked for that came in `for_s` seconds, of a link that loses `loss`.
    fn share(&self, stream: &Stream, for_s: f64, loss: f64) -> f64 {
        let wanted = for_s * 1e6 / f64::from(stream.interval_us) * (1.0 - loss.clamp(0.0, 0.9));
        f64::from(self.count) / wanted
    }

    /// Whether to ask for the stream now.
    fn step(&mut self, stream: &Stream, loss: f64, now: Stamp) -> bool {
        let since = *self.since.get_or_insert(now);
        let for_s = now.seconds_since(since);
        let Some(asked) = self.asked else {
            if for_s < LOOK_S {
                return false;
            }
            // Somebody else's rate, if it is higher, is not lowered.
            self.was_full = self.share(stream, for_s, loss) >= FULL_SHARE;
            self.asked = Some(now);
            self.count_anew(now);
            return !self.was_full;
        };
        if for_s >= WINDOW_S {
            let share = self.share(stream, for_s, loss);
            self.slow_hz = (self.count > 0 && share < SLOW_SHARE).then_some(f64::from(self.count) / for_s);
            self.was_full |= share >= FULL_SHARE;
            self.count_anew(now);
        }
        if !self.is_silent(stream, now) && self.slow_hz.is_none() {
            let since = *self.good_since.get_or_insert(now);
            if now.seconds_since(since) >= RETRY_S_MAX {
                self.retry_s = RETRY_S;
            }
            return false;
        }
        self.good_since = None;
        if (0.0..self.retry_s).contains(&now.seconds_since(asked)) {
            return false;
        }
        self.retry_s = (self.retry_s * 2.0).min(RETRY_S_MAX);
        self.asked = Some(now);
        self.count_anew(now);
        true
    }

    /// Whether people should know that it is slow: not of what the autopilot never sent any faster, unless it is flown by.
    fn tells(&self, stream: &Stream) -> Option<f64> {
        self.slow_hz.filter(|_| self.was_full || FLOWN_BY.contains(&stream.message_id))
    }
}

/// Watches the streams.
#[derive(Debug, Clone)]
pub struct Streams {
    watched: BTreeMap<u32, (Stream, Watch)>,
    stepped: Option<Stamp>,
    told: bool,
}

impl Default for Streams {
    fn default() -> Self {
        let watched = STREAMS.iter().map(|stream| (stream.message_id, (*stream, Watch::NEW))).collect();
        Self { watched, stepped: None, told: false }
    }
}

impl Streams {
    /// A message came.
    pub fn observe(&mut self, message_id: u32, now: Stamp) {
        if let Some((stream, watch)) = self.watched.get_mut(&message_id) {
            // One that begins only now, as its sensor does, is not slow for that.
            if watch.asked.is_some() && watch.is_silent(stream, now) {
                watch.count_anew(now);
            }
            watch.heard = Some(now);
            watch.count = watch.count.saturating_add(1);
        }
    }

    /// Streams to ask for now: each once, unless it comes as often as wanted already; and again when it is silent, or comes less
    /// than half as often. `loss` is the share of the autopilot's frames that are lost: what is lost was sent.
    pub fn due(&mut self, loss: f64, now: Stamp) -> Vec<Stream> {
        let held_up = self.stepped.is_some_and(|stepped| !(0.0..=HELD_UP_S).contains(&now.seconds_since(stepped)));
        self.stepped = Some(now);
        let mut due = Vec::new();
        for (stream, watch) in self.watched.values_mut() {
            if held_up {
                watch.count_anew(now);
                watch.good_since = None;
            }
            if watch.step(stream, loss, now) {
                due.push(*stream);
            }
        }
        due
    }

    /// What comes too seldom, in words; told once, until all has been well for a while.
    pub fn complaint(&mut self) -> Option<String> {
        let slow = self.watched.values().filter_map(|(stream, watch)| Some((stream, watch.tells(stream)?)));
        let slow: Vec<String> = slow
            .map(|(stream, rate_hz)| format!("{} {rate_hz:.1} of {:.0} Hz", stream.name(), 1e6 / f64::from(stream.interval_us)))
            .collect();
        let wary = |(_, watch): &(Stream, Watch)| watch.was_full && watch.retry_s > RETRY_S;
        if slow.is_empty() {
            self.told &= self.watched.values().any(wary);
            return None;
        }
        (!std::mem::replace(&mut self.told, true)).then(|| slow.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn t(s: f64) -> Stamp {
        Stamp::from_secs_f64(100.0).plus_secs_f64(s)
    }

    /// An autopilot that sends each stream at its own rate, as it was set last.
    struct Sender {
        streams: Streams,
        /// Message, hertz, phase.
        sent: BTreeMap<u32, (f64, f64)>,
        tenths: u32,
        /// When a stream was asked for, seconds.
        asked: Vec<(f64, u32)>,
        complaints: Vec<String>,
        loss: f64,
    }

    const POSITION: u32 = ardu::GLOBAL_POSITION_INT_DATA::ID;
    const POSITION_HZ: f64 = 10.0;

    impl Sender {
        fn new() -> Self {
            let (streams, sent) = (Streams::default(), BTreeMap::new());
            Self { streams, sent, tenths: 0, asked: Vec::new(), complaints: Vec::new(), loss: 0.0 }
        }

        fn set(&mut self, message_id: u32, rate_hz: f64) {
            self.sent.entry(message_id).or_default().0 = rate_hz;
        }

        /// `can_hz`: no faster than this, whatever is asked; `each` sees every tenth of a second first.
        fn run(&mut self, seconds: f64, can_hz: f64, mut each: impl FnMut(&mut Self)) {
            for _ in 0..(seconds * 10.0).round() as u32 {
                self.tenths += 1;
                each(self);
                let now_s = f64::from(self.tenths) * 0.1;
                for (message_id, (rate_hz, phase)) in &mut self.sent {
                    *phase += *rate_hz * 0.1;
                    while *phase >= 1.0 {
                        *phase -= 1.0;
                        self.streams.observe(*message_id, t(now_s));
                    }
                }
                for stream in self.streams.due(self.loss, t(now_s)) {
                    self.asked.push((now_s, stream.message_id));
                    self.set(stream.message_id, (1e6 / f64::from(stream.interval_us)).min(can_hz));
                }
                self.complaints.extend(self.streams.complaint());
            }
        }

        fn asked_for(&self, message_id: u32) -> Vec<f64> {
            self.asked.iter().filter(|(_, id)| *id == message_id).map(|(at_s, _)| *at_s).collect()
        }
    }

    #[test]
    fn each_firmware_is_asked_for_its_own_estimators_health() {
        let of = |family| STREAMS.iter().filter(|stream| stream.suits(family)).count();
        assert_eq!((of(Family::ArduPilot), of(Family::Px4)), (STREAMS.len() - 1, STREAMS.len() - 1));
    }

    #[test]
    fn all_are_asked_for_once_and_only_a_stalled_one_again() {
        let mut sender = Sender::new();
        sender.run(60.0, 1e3, |sender| sender.sent.retain(|id, _| *id != ardu::GPS_RAW_INT_DATA::ID));
        for stream in STREAMS {
            let asked_s = sender.asked_for(stream.message_id);
            let silent = stream.message_id == ardu::GPS_RAW_INT_DATA::ID;
            assert_eq!(asked_s.len(), if silent { 5 } else { 1 }, "{stream:?}: {asked_s:?}");
            // A second's look; then after 3, 6, 12 and 24 s.
            let expected_s = [1.1, 4.1, 10.1, 22.1, 46.1];
            assert!(asked_s.iter().zip(expected_s).all(|(at_s, s)| (at_s - s).abs() < 0.15), "{asked_s:?}");
        }
        assert!(sender.complaints.is_empty(), "{:?}", sender.complaints);
    }

    #[test]
    fn what_comes_often_enough_already_is_left_alone_and_what_comes_at_4_hz_is_not() {
        let mut sender = Sender::new();
        sender.set(POSITION, 50.0);
        sender.set(ardu::ATTITUDE_QUATERNION_DATA::ID, 4.0);
        sender.run(30.0, 1e3, |_| {});
        assert!(sender.asked_for(POSITION).is_empty(), "50 Hz would have become 10");
        assert_eq!(sender.asked_for(ardu::ATTITUDE_QUATERNION_DATA::ID).len(), 1);
    }

    #[test]
    fn a_rate_that_a_ground_station_lowers_is_asked_for_again_and_told_once() {
        let mut sender = Sender::new();
        sender.run(20.0, 1e3, |_| {});
        sender.set(POSITION, 1.0);
        sender.run(12.0, 1e3, |_| {});
        assert_eq!(sender.asked_for(POSITION).len(), 2, "{:?}", sender.asked_for(POSITION));
        assert_eq!(sender.sent[&POSITION].0, POSITION_HZ);
        // The window in which it was lowered may hold some at the old rate.
        assert_eq!(sender.complaints.len(), 1, "{:?}", sender.complaints);
        assert!(sender.complaints[0].starts_with("GLOBAL_POSITION_INT ") && sender.complaints[0].ends_with(" of 10 Hz"));
        // Well for long, and lowered again: that is news.
        sender.run(100.0, 1e3, |_| {});
        sender.set(POSITION, 1.0);
        sender.run(12.0, 1e3, |_| {});
        assert_eq!((sender.asked_for(POSITION).len(), sender.complaints.len()), (3, 2));
    }

    #[test]
    fn a_station_that_insists_is_not_fought_more_than_a_few_times_a_minute() {
        for insists_s in [0.5, 4.0, 7.0, 20.0] {
            let mut sender = Sender::new();
            let mut next_s = 10.0;
            sender.run(600.0, 1e3, |sender| {
                if f64::from(sender.tenths) * 0.1 >= next_s {
                    next_s += insists_s;
                    sender.set(POSITION, 1.0);
                }
            });
            let asked_s = sender.asked_for(POSITION);
            let most = asked_s.iter().map(|from| asked_s.iter().filter(|at| (0.0..60.0).contains(&(*at - from))).count()).max();
            assert!(most.unwrap() <= 5, "every {insists_s} s: {asked_s:?}");
            assert!(asked_s.len() <= 16, "every {insists_s} s: {asked_s:?}");
            assert_eq!(sender.complaints.len(), 1, "every {insists_s} s: {:?}", sender.complaints);
        }
    }

    #[test]
    fn an_autopilot_that_cannot_is_asked_once_a_minute_in_the_end() {
        let mut sender = Sender::new();
        sender.run(600.0, 2.0, |_| {});
        let asked_s = sender.asked_for(POSITION);
        assert!((10..=16).contains(&asked_s.len()), "{asked_s:?}");
        let last_s = asked_s[asked_s.len() - 1] - asked_s[asked_s.len() - 2];
        assert!((last_s - RETRY_S_MAX).abs() < 0.2, "{asked_s:?}");
        // What is flown by is told; a heartbeat that was never faster is not.
        assert_eq!(sender.complaints.len(), 1);
        assert!(!sender.complaints[0].contains("HEARTBEAT"), "{:?}", sender.complaints);
    }

    /// Frames that are lost were sent: asking for more would drown the link.
    #[test]
    fn a_lossy_link_is_no_slow_stream() {
        let asked = |loss| {
            let mut sender = Sender::new();
            sender.run(20.0, 1e3, |_| {});
            sender.loss = loss;
            sender.run(60.0, 1e3, |sender| sender.set(POSITION, 10.0 * 0.4 + 1e-9));
            sender.asked_for(POSITION).len()
        };
        assert_eq!(asked(0.6), 1);
        assert!(asked(0.0) > 1);
    }

    /// An autopilot tells its place once it has one, in the middle of anything.
    #[test]
    fn a_stream_that_begins_late_is_not_slow() {
        for begins_s in [7.0, 8.5, 10.3] {
            let mut sender = Sender::new();
            sender.run(begins_s, 1e3, |sender| sender.sent.retain(|id, _| *id != POSITION));
            sender.set(POSITION, POSITION_HZ);
            sender.run(30.0, 1e3, |_| {});
            assert!(sender.complaints.is_empty(), "{begins_s} s: {:?}", sender.complaints);
        }
    }

    /// Messages that waited while this program was held up say nothing of their rate.
    #[test]
    fn a_pause_of_our_own_is_no_slow_stream() {
        let mut sender = Sender::new();
        sender.run(23.0, 1e3, |_| {});
        sender.tenths += 40;
        sender.run(20.0, 1e3, |_| {});
        assert_eq!(sender.asked_for(POSITION).len(), 1);
    }
}
