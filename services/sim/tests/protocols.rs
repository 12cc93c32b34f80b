//! What ground stations say to an autopilot beside flying it: items, signatures, clocks, payloads, sensors.
#![allow(deprecated, reason = "ArduPilot still speaks much that MAVLink has deprecated")]
#![allow(clippy::expect_used, clippy::panic, reason = "a test without its vehicle cannot go on")]

mod field;

use field::{Field, LINK, POSITION, perfect, real};
use halcyon_model::Stamp;
use halcyon_sim::autopilot::{LinkId, Mode};
use halcyon_sim::{SimConfig, SimVehicle};
use mav::MavMissionResult as Answer;
use mav::MavMissionType as Type;
use mavlink::dialects::ardupilotmega as mav;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage, MavResult};
use mavlink::{MAVLinkMessageRaw, MAVLinkV2MessageRaw, MavHeader, MavlinkVersion, SigningConfig, SigningData};

const FENCE: Type = Type::MAV_MISSION_TYPE_FENCE;
const RALLY: Type = Type::MAV_MISSION_TYPE_RALLY;
/// The field's origin, 10⁻⁷ degrees, and how many of them are a metre north and east there.
const ORIGIN: (i32, i32) = (531_000_000, -29_000_000);
const NORTH_PER_M: f64 = 89.84;
const EAST_PER_M: f64 = 149.3;

fn at(north_m: f64, east_m: f64) -> (i32, i32) {
    (ORIGIN.0 + (north_m * NORTH_PER_M) as i32, ORIGIN.1 + (east_m * EAST_PER_M) as i32)
}

fn item(mission_type: Type, command: MavCmd, param1: f32, place: (i32, i32), z: f32) -> mav::MISSION_ITEM_INT_DATA {
    mav::MISSION_ITEM_INT_DATA {
        mission_type,
        command,
        param1,
        x: place.0,
        y: place.1,
        z,
        frame: mav::MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT,
        target_system: 1,
        target_component: 1,
        ..Default::default()
    }
}

/// A square to stay in, `half_m` about the origin, as four items.
fn square(half_m: f64) -> Vec<mav::MISSION_ITEM_INT_DATA> {
    let corners = [(half_m, half_m), (half_m, -half_m), (-half_m, -half_m), (-half_m, half_m)];
    let vertex = MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION;
    corners.iter().map(|(north_m, east_m)| item(FENCE, vertex, 4.0, at(*north_m, *east_m), 0.0)).collect()
}

/// Uploads as a ground station does, and returns the answer.
#[track_caller]
fn upload(field: &mut Field, mission_type: Type, items: &[mav::MISSION_ITEM_INT_DATA]) -> Answer {
    field.heard.clear();
    field.say(MavMessage::MISSION_COUNT(mav::MISSION_COUNT_DATA {
        count: items.len() as u16,
        mission_type,
        target_system: 1,
        target_component: 1,
        opaque_id: 0,
    }));
    for _ in 0..=items.len() {
        match field.heard.last() {
            Some(MavMessage::MISSION_REQUEST(ask)) if ask.mission_type == mission_type => {
                let seq = ask.seq;
                let data = items[usize::from(seq)].clone();
                field.say(MavMessage::MISSION_ITEM_INT(mav::MISSION_ITEM_INT_DATA { seq, ..data }));
            }
            Some(MavMessage::MISSION_ACK(ack)) if ack.mission_type == mission_type => return ack.mavtype,
            other => panic!("{other:?}"),
        }
    }
    panic!("never acknowledged: {:?}", field.heard.last())
}

fn download(field: &mut Field, mission_type: Type) -> Vec<mav::MISSION_ITEM_INT_DATA> {
    let list = mav::MISSION_REQUEST_LIST_DATA { mission_type, target_system: 1, target_component: 1 };
    field.say(MavMessage::MISSION_REQUEST_LIST(list));
    let Some(MavMessage::MISSION_COUNT(count)) = field.heard.last().cloned() else { panic!("no count") };
    let ask = |seq| mav::MISSION_REQUEST_INT_DATA { seq, mission_type, target_system: 1, target_component: 1 };
    (0..count.count)
        .map(|seq| {
            field.say(MavMessage::MISSION_REQUEST_INT(ask(seq)));
            let Some(MavMessage::MISSION_ITEM_INT(item)) = field.heard.last().cloned() else { panic!("no item {seq}") };
            assert_eq!((item.seq, item.mission_type), (seq, mission_type));
            item
        })
        .collect()
}

/// The latest message of a kind, asked for.
macro_rules! ask {
    ($field:expr, $kind:ident, $id:expr) => {{
        let asked = $field.command(MavCmd::MAV_CMD_REQUEST_MESSAGE, [$id as f32, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(asked, MavResult::MAV_RESULT_ACCEPTED);
        let found = $field.heard.iter().rev().find_map(|message| match message {
            MavMessage::$kind(data) => Some(data.clone()),
            _ => None,
        });
        found.expect("it came")
    }};
}

fn number(command: MavCmd, p1: f32, p2: f32) -> (MavCmd, [f32; 7]) {
    (command, [p1, p2, 0.0, 0.0, 0.0, 0.0, 0.0])
}

#[test]
fn a_fence_comes_back_as_it_was_and_a_bad_one_changes_nothing() {
    let mut field = Field::new(&perfect());
    field.run(2.0);
    let mut items = square(50.0);
    items.push(item(FENCE, MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION, 7.25, at(20.0, 10.0), 0.0));
    items.push(item(FENCE, MavCmd::MAV_CMD_NAV_FENCE_RETURN_POINT, 0.0, at(1.0, 1.0), 0.0));
    assert_eq!(upload(&mut field, FENCE, &items), Answer::MAV_MISSION_ACCEPTED);
    let key = |item: &mav::MISSION_ITEM_INT_DATA| (item.command, item.param1.to_bits(), item.x, item.y);
    let stored: Vec<_> = items.iter().map(key).collect();
    assert_eq!(download(&mut field, FENCE).iter().map(key).collect::<Vec<_>>(), stored);
    // One vertex short, a circle of no size, a waypoint.
    assert_eq!(upload(&mut field, FENCE, &items[1..]), Answer::MAV_MISSION_ERROR);
    let nothing = item(FENCE, MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, 0.0, at(0.0, 0.0), 0.0);
    assert_eq!(upload(&mut field, FENCE, &[nothing]), Answer::MAV_MISSION_ERROR);
    let waypoint = item(FENCE, MavCmd::MAV_CMD_NAV_WAYPOINT, 0.0, at(0.0, 0.0), 5.0);
    assert_eq!(upload(&mut field, FENCE, &[waypoint]), Answer::MAV_MISSION_UNSUPPORTED);
    assert_eq!(download(&mut field, FENCE).iter().map(key).collect::<Vec<_>>(), stored);
    for mission_type in [FENCE, Type::MAV_MISSION_TYPE_ALL] {
        let clear = mav::MISSION_CLEAR_ALL_DATA { mission_type, target_system: 1, target_component: 1 };
        field.say(MavMessage::MISSION_CLEAR_ALL(clear));
        let Some(MavMessage::MISSION_ACK(ack)) = field.heard.last() else { panic!("no answer") };
        // ArduPilot clears one kind at a time.
        let expected = if mission_type == FENCE { Answer::MAV_MISSION_ACCEPTED } else { Answer::MAV_MISSION_UNSUPPORTED };
        assert_eq!(ack.mavtype, expected);
    }
    assert!(download(&mut field, FENCE).is_empty());
}

#[test]
fn an_upload_asks_again_says_what_it_expects_and_gives_up() {
    let mut field = Field::new(&perfect());
    field.run(2.0);
    let count = mav::MISSION_COUNT_DATA { count: 2, mission_type: FENCE, target_system: 1, target_component: 1, opaque_id: 0 };
    field.say(MavMessage::MISSION_COUNT(count.clone()));
    field.heard.clear();
    field.run(3.5);
    let asks = field.heard.iter().filter(|message| matches!(message, MavMessage::MISSION_REQUEST(ask) if ask.seq == 0));
    assert_eq!(asks.count(), 3);
    let circle = |seq| mav::MISSION_ITEM_INT_DATA {
        seq,
        ..item(FENCE, MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, 30.0, at(0.0, 0.0), 0.0)
    };
    field.say(MavMessage::MISSION_ITEM_INT(circle(1)));
    assert!(
        matches!(field.heard.last(), Some(MavMessage::MISSION_ACK(ack)) if ack.mavtype == Answer::MAV_MISSION_INVALID_SEQUENCE)
    );
    field.say(MavMessage::MISSION_ITEM_INT(circle(0)));
    assert!(matches!(field.heard.last(), Some(MavMessage::MISSION_REQUEST(ask)) if ask.seq == 1));
    field.heard.clear();
    field.run(9.0);
    assert!(field.heard_text("Fence upload timeout"));
    let cancelled = |message: &MavMessage| matches!(message, MavMessage::MISSION_ACK(ack) if ack.mavtype == Answer::MAV_MISSION_OPERATION_CANCELLED);
    assert!(field.heard.iter().any(cancelled));
    assert!(download(&mut field, FENCE).is_empty());
}

#[test]
fn old_clients_upload_and_read_items_of_floats() {
    let mut field = Field::new(&perfect());
    field.run(2.0);
    let count = mav::MISSION_COUNT_DATA { count: 2, target_system: 1, target_component: 1, ..Default::default() };
    field.say(MavMessage::MISSION_COUNT(count));
    for seq in 0..2 {
        field.say(MavMessage::MISSION_ITEM(mav::MISSION_ITEM_DATA {
            seq,
            command: MavCmd::MAV_CMD_NAV_WAYPOINT,
            frame: mav::MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT,
            x: 53.1005,
            y: -2.9,
            z: 6.0,
            target_system: 1,
            target_component: 1,
            ..Default::default()
        }));
    }
    assert!(field.heard_text("Flight plan received"));
    let ask = mav::MISSION_REQUEST_DATA { seq: 1, target_system: 1, target_component: 1, ..Default::default() };
    field.say(MavMessage::MISSION_REQUEST(ask));
    let Some(MavMessage::MISSION_ITEM(back)) = field.heard.last() else { panic!("no item") };
    assert!((back.x - 53.1005).abs() < 1e-5 && back.z == 6.0);
}

#[test]
fn outside_the_fence_it_returns_and_the_mode_is_kept() {
    let mut field = Field::new(&perfect());
    field.take_off(5.0);
    field.target(POSITION, [40.0, 0.0, -5.0], [0.0; 3]);
    field.run(20.0);
    assert_eq!(upload(&mut field, FENCE, &square(25.0)), Answer::MAV_MISSION_ACCEPTED);
    field.run(1.0);
    assert_eq!(field.vehicle.autopilot().mode(), Mode::Guided, "FENCE_ENABLE is off by default");
    field.set_param("RTL_ALT", 500.0);
    field.set_param("FENCE_ENABLE", 1.0);
    let after_s = field.until(1.0, "the fence", |vehicle| vehicle.autopilot().mode() == Mode::Rtl);
    assert!(after_s <= 0.1 && field.heard_text("Polygon fence breached"), "{after_s} {:?}", field.texts());
    let status = ask!(field, FENCE_STATUS, 162);
    assert_eq!((status.breach_status, status.breach_type), (1, mav::FenceBreach::FENCE_BREACH_BOUNDARY));
    assert_eq!(field.set_mode(Mode::Guided), MavResult::MAV_RESULT_FAILED);
    assert!(field.heard_text("in fence recovery"));
    let inside = |vehicle: &halcyon_sim::vehicle::Vehicle| vehicle.truth().position_ned_m.x < 24.5;
    field.until(20.0, "inside again", inside);
    field.run(0.2);
    assert!(field.heard_text("Fence breach cleared"));
    assert_eq!(field.set_mode(Mode::Guided), MavResult::MAV_RESULT_ACCEPTED);
    // A target outside is not gone to.
    field.run(3.0);
    let before = field.vehicle.truth().position_ned_m;
    field.target(POSITION, [40.0, 0.0, -5.0], [0.0; 3]);
    field.run(5.0);
    assert!((field.vehicle.truth().position_ned_m - before).norm() < 1.0);
}

#[test]
fn rtl_lands_at_the_nearest_rally_point() {
    let mut field = Field::new(&perfect());
    field.take_off(5.0);
    let points = [at(35.0, 5.0), at(-200.0, 0.0)].map(|place| item(RALLY, MavCmd::MAV_CMD_NAV_RALLY_POINT, 0.0, place, 8.75));
    assert_eq!(upload(&mut field, RALLY, &points), Answer::MAV_MISSION_ACCEPTED);
    assert!(field.heard_text("Rally points received"));
    let back = download(&mut field, RALLY);
    // Heights are stored in whole metres.
    assert_eq!(
        back.iter().map(|point| (point.x, point.y, point.z)).collect::<Vec<_>>(),
        points.clone().map(|p| (p.x, p.y, 8.0))
    );
    field.target(POSITION, [30.0, 0.0, -5.0], [0.0; 3]);
    field.run(15.0);
    field.set_param("RTL_ALT", 500.0);
    field.set_mode(Mode::Rtl);
    field.until(60.0, "the landing", |vehicle| !vehicle.autopilot().is_armed());
    let place = field.vehicle.truth().position_ned_m.xy();
    assert!((place - nalgebra::Vector2::new(35.0, 5.0)).norm() < 0.4, "{place}");
}

#[test]
fn with_a_key_only_what_is_signed_anew_is_heard() {
    let mut field = Field::new(&perfect());
    field.run(2.0);
    let key = [7_u8; 32];
    field.say(MavMessage::SETUP_SIGNING(mav::SETUP_SIGNING_DATA {
        initial_timestamp: 1,
        target_system: 1,
        target_component: 1,
        secret_key: key,
    }));
    assert!(field.vehicle.autopilot().is_signing());
    field.run(0.01);
    let ping = |system_id: u32| {
        let message = MavMessage::PING(mav::PING_DATA { seq: 9, ..Default::default() });
        (MavHeader { system_id, component_id: 190, sequence: 0 }, message)
    };
    // What it says is signed, each frame later than the last.
    let mut last = 0;
    for sequence in 0..3 {
        let outbound = halcyon_sim::autopilot::Outbound::Message(ping(1).1);
        let mut bytes = Vec::new();
        field.vehicle.encode(LinkId(5), &outbound, MavlinkVersion::V2, sequence, &mut bytes);
        let MAVLinkMessageRaw::V2(frame) =
            mavlink::MavlinkReader::new(&bytes[..]).read_any_raw_message::<MavMessage>().expect("a frame")
        else {
            panic!("version 1")
        };
        let mut expected = [0; 6];
        frame.calculate_signature(&key, &mut expected);
        assert_eq!((frame.signature_value(), frame.signature_link_id()), (&expected[..], 5));
        assert!(frame.signature_timestamp() > last);
        last = frame.signature_timestamp();
    }
    // 1 760 000 000 s of Unix time is 339 929 600 s after 1 January 2015, in units of 10 µs.
    assert!((339_929_602..339_929_603).contains(&(last / 100_000)), "{last}");
    let signed = |data: &SigningData, from: u32| {
        let (header, message) = ping(from);
        let mut frame = MAVLinkV2MessageRaw::new();
        frame.serialize_message_for_signing(header, &message);
        data.sign_message(&mut frame);
        MAVLinkMessageRaw::V2(frame)
    };
    let mut heard = |frame: &MAVLinkMessageRaw| {
        field.heard.clear();
        field.vehicle.receive(LINK, frame);
        field.listen();
        field.heard.iter().any(|message| matches!(message, MavMessage::PING(_)))
    };
    let (header, message) = ping(255);
    let mut unsigned = MAVLinkV2MessageRaw::new();
    unsigned.serialize_message(header, &message);
    assert!(!heard(&MAVLinkMessageRaw::V2(unsigned)), "unsigned");
    let ours = SigningData::from_config(SigningConfig::new(key, 3, true, false));
    let frame = signed(&ours, 255);
    assert!(heard(&frame), "signed");
    assert!(!heard(&frame), "the same once more");
    assert!(heard(&signed(&ours, 255)), "signed anew");
    let theirs = SigningData::from_config(SigningConfig::new([8; 32], 4, true, false));
    assert!(!heard(&signed(&theirs, 254)), "another key");
}

#[test]
fn timesync_is_answered_in_nanoseconds_since_boot_and_asked_now_and_then() {
    let mut field = Field::new(&perfect());
    field.run(25.0);
    let asked = field.heard.iter().filter(|message| matches!(message, MavMessage::TIMESYNC(ask) if ask.tc1 == 0)).count();
    assert_eq!(asked, 2);
    field.heard.clear();
    field.say(MavMessage::TIMESYNC(mav::TIMESYNC_DATA { tc1: 0, ts1: 42, target_system: 0, target_component: 0 }));
    let Some(MavMessage::TIMESYNC(answer)) = field.heard.last().cloned() else { panic!("no answer") };
    assert_eq!((answer.ts1, answer.target_system, answer.target_component), (42, 255, 190));
    assert!((24_900_000_000..=25_100_000_000).contains(&answer.tc1), "{}", answer.tc1);
    // An answer is not answered.
    field.heard.clear();
    field.say(MavMessage::TIMESYNC(answer));
    assert!(field.heard.is_empty());
}

#[test]
fn gripper_servo_and_relay_do_what_their_parameters_allow() {
    let mut field = Field::new(&perfect());
    field.run(2.0);
    let [release, grab] = [0.0, 1.0].map(|action| number(MavCmd::MAV_CMD_DO_GRIPPER, 1.0, action));
    assert_eq!(field.command(release.0, release.1), MavResult::MAV_RESULT_FAILED);
    field.set_param("GRIP_ENABLE", 1.0);
    field.set_param("SERVO9_FUNCTION", 28.0);
    assert_eq!(field.vehicle.autopilot().servo_us(9), 1500);
    assert_eq!(field.command(grab.0, grab.1), MavResult::MAV_RESULT_ACCEPTED);
    assert!(field.heard_text("Gripper load grabbing"));
    assert_eq!(ask!(field, SERVO_OUTPUT_RAW, 36).servo9_raw, 1900);
    field.run(0.6);
    assert!(field.heard_text("Gripper load grabbed"));
    assert_eq!(field.command(release.0, release.1), MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(field.vehicle.autopilot().servo_us(9), 1100);
    // A propeller's output is not anybody's.
    let motor = number(MavCmd::MAV_CMD_DO_SET_SERVO, 2.0, 1900.0);
    assert_eq!(field.command(motor.0, motor.1), MavResult::MAV_RESULT_FAILED);
    assert!(field.heard_text("Channel 2 is already in use"));
    let relay = number(MavCmd::MAV_CMD_DO_SET_RELAY, 0.0, 1.0);
    assert_eq!(field.command(relay.0, relay.1), MavResult::MAV_RESULT_FAILED);
    field.set_param("RELAY1_FUNCTION", 1.0);
    assert_eq!(field.command(relay.0, relay.1), MavResult::MAV_RESULT_ACCEPTED);
    let status = ask!(field, RELAY_STATUS, 376);
    assert_eq!((status.present, status.on), (1, 1));
}

#[test]
fn the_rangefinder_sees_the_wave_below_along_a_tilted_beam() {
    let mut vehicles = SimVehicle::fleet(0, 1);
    vehicles[0].north_m = 0.0;
    let mut config = SimConfig { vehicles, ..perfect() };
    config.rangefinder.sigma_m = 0.0;
    config.wind = halcyon_sim::wind::WindConfig { speed_mps: 8.0, direction_from_deg: 0.0, gust_scale: 0.0 };
    let mut field = Field::new(&config);
    field.take_off(5.0);
    let wave = |stamp: Stamp| 0.3 * (std::f64::consts::TAU * (stamp.as_nanos() % 4_000_000_000) as f64 / 4e9).sin();
    field.water = Box::new(move |_, stamp| wave(stamp));
    field.target(POSITION, [20.0, 0.0, -5.0], [0.0; 3]);
    field.run(15.0);
    let (mut most_tilt, mut lowest_m, mut highest_m): (f64, f64, f64) = (0.0, f64::INFINITY, 0.0);
    for _ in 0..80 {
        field.run(0.1);
        let (told, truth) = (ask!(field, DISTANCE_SENSOR, 132), field.vehicle.truth());
        assert_eq!(told.orientation, mav::MavSensorOrientation::MAV_SENSOR_ROTATION_PITCH_270);
        let cos_tilt = (truth.ned_from_body * nalgebra::Vector3::z()).z;
        let expected_m = (-truth.position_ned_m.z - wave(truth.stamp)) / cos_tilt;
        let found_m = f64::from(told.current_distance) * 0.01;
        // Half a centimetre of rounding, and up to 50 ms since the measurement at up to 0.5 m/s of wave.
        assert!((found_m - expected_m).abs() < 0.035, "{found_m} {expected_m}");
        (most_tilt, lowest_m, highest_m) = (most_tilt.max(cos_tilt.acos()), lowest_m.min(found_m), highest_m.max(found_m));
    }
    assert!(most_tilt > 0.08 && highest_m - lowest_m > 0.5, "{most_tilt} {lowest_m} {highest_m}");
    let leader = Field::new(&real()).command(MavCmd::MAV_CMD_REQUEST_MESSAGE, [132.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(leader, MavResult::MAV_RESULT_FAILED, "a leader carries none");
}

#[test]
fn answers_and_texts_are_ardupilots() {
    let mut field = Field::new(&perfect());
    field.take_off(5.0);
    // SET_MODE is acknowledged by its own number.
    field.say(MavMessage::SET_MODE(mav::SET_MODE_DATA {
        custom_mode: Mode::Loiter.number(),
        target_system: 1,
        base_mode: mav::MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED,
    }));
    assert_eq!(field.unlisted, [(11, 0)]);
    let speed = number(MavCmd::MAV_CMD_DO_CHANGE_SPEED, 1.0, 3.0);
    assert_eq!(field.command(speed.0, speed.1), MavResult::MAV_RESULT_FAILED, "LOITER has no speed of its own");
    // A target is told as it was given, and only in GUIDED.
    let target = number(MavCmd::MAV_CMD_REQUEST_MESSAGE, 85.0, 0.0);
    assert_eq!(field.command(target.0, target.1), MavResult::MAV_RESULT_FAILED);
    field.set_mode(Mode::Guided);
    field.target(POSITION, [12.0, -3.0, -7.0], [0.0; 3]);
    let told = ask!(field, POSITION_TARGET_LOCAL_NED, 85);
    assert_eq!((told.x, told.y, told.z, told.type_mask.bits()), (12.0, -3.0, -7.0, 0o6770));
    let interval = number(MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL, 9999.0, 1e5);
    assert_eq!(field.command(interval.0, interval.1), MavResult::MAV_RESULT_DENIED);
    assert!(field.heard_text("No ap_message for mavlink id (9999)"));
    let version = ask!(field, AUTOPILOT_VERSION, 148);
    assert_eq!(version.flight_sw_version >> 16, 0x0406);
    let both = mav::MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
        | mav::MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_MISSION_RALLY;
    assert!(version.capabilities.contains(both));
}
