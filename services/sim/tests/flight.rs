//! Whole flights of a simulated vehicle, by MAVLink messages only, judged by the truth.
#![allow(deprecated, reason = "ArduPilot still speaks much that MAVLink has deprecated")]
#![allow(clippy::expect_used, reason = "a test without its vehicle cannot go on")]

mod field;

use field::{Field, LINK, POSITION, VELOCITY, perfect, real};
use halcyon_model::Stamp;
use halcyon_sim::SimConfig;
use halcyon_sim::autopilot::{Inbound, Mode};
use halcyon_sim::copter::AirframeConfig;
use halcyon_sim::fault::Fault;
use halcyon_sim::wind::WindConfig;
use mavlink::MavHeader;
use mavlink::dialects::ardupilotmega as mav;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage, MavResult};

#[test]
fn nothing_but_heartbeats_and_texts_comes_unasked() {
    let mut field = Field::new(&real());
    field.run(10.0);
    let unasked = field.heard.iter().filter(|message| {
        !matches!(
            message,
            MavMessage::HEARTBEAT(_)
                | MavMessage::STATUSTEXT(_)
                | MavMessage::HOME_POSITION(_)
                | MavMessage::GPS_GLOBAL_ORIGIN(_)
                | MavMessage::TIMESYNC(_)
        )
    });
    assert_eq!(unasked.count(), 0);
    let heartbeats = field.heard.iter().filter(|message| matches!(message, MavMessage::HEARTBEAT(_))).count();
    assert!((10..=11).contains(&heartbeats), "{heartbeats}");
    let asked = field.command(MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL, [33.0, 100_000.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(asked, MavResult::MAV_RESULT_ACCEPTED);
    field.heard.clear();
    field.run(5.0);
    let positions = field.heard.iter().filter(|message| matches!(message, MavMessage::GLOBAL_POSITION_INT(_))).count();
    assert!((49..=51).contains(&positions), "{positions}");
}

#[test]
fn arming_is_refused_with_a_reason_until_the_position_is_good() {
    let mut field = Field::new(&real());
    field.run(2.0);
    assert_eq!(field.set_mode(Mode::Guided), MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(field.arm(), MavResult::MAV_RESULT_FAILED);
    assert!(field.heard_text("PreArm: ") && field.heard_text("Arm: Need Position Estimate"), "{:?}", field.texts());
    field.run(8.0);
    assert_eq!(field.set_mode(Mode::Land), MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(field.arm(), MavResult::MAV_RESULT_FAILED);
    assert!(field.heard_text("Arm: LAND mode not armable"));
    assert_eq!(field.set_mode(Mode::Guided), MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(field.arm(), MavResult::MAV_RESULT_ACCEPTED);
    // Armed on the ground it disarms itself.
    let after_s = field.until(12.0, "disarm", |vehicle| !vehicle.autopilot().is_armed());
    assert!((9.5..10.6).contains(&after_s), "{after_s}");
}

#[test]
fn commands_are_answered_as_ardupilot_does() {
    use MavResult as Answer;
    let mut field = Field::new(&perfect());
    field.run(3.0);
    let none = [0.0; 7];
    assert_eq!(field.command(MavCmd::MAV_CMD_NAV_TAKEOFF, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0]), Answer::MAV_RESULT_FAILED);
    assert_eq!(field.command(MavCmd::MAV_CMD_DO_SET_MODE, none), Answer::MAV_RESULT_DENIED);
    assert_eq!(field.command(MavCmd::MAV_CMD_DO_SET_MODE, [1.0, 99.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Answer::MAV_RESULT_FAILED);
    assert_eq!(field.command(MavCmd::MAV_CMD_DO_PARACHUTE, none), Answer::MAV_RESULT_UNSUPPORTED);
    let servo = [9.0, 1900.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(field.command(MavCmd::MAV_CMD_DO_SET_SERVO, servo), Answer::MAV_RESULT_ACCEPTED);
    assert_eq!(field.vehicle.autopilot().servo_us(9), 1900);
    let far = [30_000.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(field.command(MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL, far), Answer::MAV_RESULT_DENIED);
    // For another system: not a word.
    field.heard.clear();
    field.say(MavMessage::COMMAND_LONG(mav::COMMAND_LONG_DATA {
        command: MavCmd::MAV_CMD_DO_SET_MODE,
        target_system: 77,
        ..Default::default()
    }));
    assert!(field.heard.is_empty());
    let header = MavHeader { system_id: 255, component_id: 190, sequence: 0 };
    field.vehicle.handle(LINK, &Inbound::UnknownCommand { header, command: 64_000, target_system: 1 });
    field.vehicle.handle(LINK, &Inbound::UnknownCommand { header, command: 64_000, target_system: 2 });
    field.listen();
    assert_eq!(field.unlisted, [(64_000, MavResult::MAV_RESULT_UNSUPPORTED as u8)]);
}

#[test]
fn it_flies_to_a_point_and_holds_it() {
    let mut field = Field::new(&perfect());
    field.take_off(5.0);
    field.target(POSITION, [30.0, -10.0, -6.0], [0.0; 3]);
    let place = nalgebra::Vector3::new(30.0, -10.0, -6.0);
    let seconds = field.until(30.0, "the point", |vehicle| (vehicle.truth().position_ned_m - place).norm() < 0.2);
    // 31.6 m with at most 2.5 m/s² cannot be done in less than 2 √(d / a) = 7.1 s.
    assert!((7.1..15.0).contains(&seconds), "{seconds}");
    // What was learnt about drag on the way must be unlearnt.
    field.run(8.0);
    for _ in 0..100 {
        field.run(0.1);
        let error_m = (field.vehicle.truth().position_ned_m - place).norm();
        assert!(error_m < 0.03, "{error_m}");
    }
}

#[test]
fn it_holds_in_wind_as_well_as_its_sensors_allow() {
    let wind = WindConfig { speed_mps: 6.0, direction_from_deg: 200.0, gust_scale: 1.0 };
    let mut field = Field::new(&SimConfig { wind, ..perfect() });
    field.take_off(5.0);
    field.target(POSITION, [0.0, 0.0, -5.0], [0.0; 3]);
    field.run(10.0);
    let (mut sum, count) = (0.0, 300);
    for _ in 0..count {
        field.run(0.1);
        sum += (field.vehicle.truth().position_ned_m - nalgebra::Vector3::new(0.0, 0.0, -5.0)).xy().norm();
    }
    // ArduCopter's own simulation: 0.16 m mean in a 6 m/s wind.
    let mean_m = sum / f64::from(count);
    assert!(mean_m < 0.25, "{mean_m}");
}

#[test]
fn a_velocity_target_is_flown_and_dropped_after_three_seconds() {
    let mut field = Field::new(&perfect());
    field.take_off(5.0);
    for _ in 0..50 {
        field.target(VELOCITY, [0.0; 3], [2.0, 1.0, 0.0]);
        field.run(0.1);
    }
    let velocity = field.vehicle.truth().velocity_ned_mps;
    assert!((velocity - nalgebra::Vector3::new(2.0, 1.0, 0.0)).norm() < 0.1, "{velocity}");
    field.run(2.8);
    assert!(field.vehicle.truth().velocity_ned_mps.norm() > 2.0);
    field.run(4.0);
    assert!(field.vehicle.truth().velocity_ned_mps.norm() < 0.1, "{}", field.vehicle.truth().velocity_ned_mps);
}

#[test]
fn on_the_ground_a_target_lifts_nothing_and_nonsense_is_ignored() {
    let mut field = Field::new(&perfect());
    field.run(3.0);
    field.set_mode(Mode::Guided);
    assert_eq!(field.arm(), MavResult::MAV_RESULT_ACCEPTED);
    field.target(POSITION, [0.0, 0.0, -20.0], [0.0; 3]);
    field.run(3.0);
    assert!(field.vehicle.truth().position_ned_m.z > -0.05);
    field.take_off(3.0);
    let before = field.vehicle.truth().position_ned_m;
    field.target(POSITION, [f32::NAN, 0.0, -20.0], [0.0; 3]);
    field.target(POSITION, [f32::INFINITY, 0.0, -20.0], [0.0; 3]);
    field.run(5.0);
    assert!((field.vehicle.truth().position_ned_m - before).norm() < 0.3);
}

#[test]
fn a_target_ends_a_take_off() {
    let mut field = Field::new(&perfect());
    field.run(3.0);
    field.set_mode(Mode::Guided);
    assert_eq!(field.arm(), MavResult::MAV_RESULT_ACCEPTED);
    let up = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 8.0];
    assert_eq!(field.command(MavCmd::MAV_CMD_NAV_TAKEOFF, up), MavResult::MAV_RESULT_ACCEPTED);
    // Before it has lifted off: it stays on the ground.
    field.target(POSITION, [0.0, 0.0, -8.0], [0.0; 3]);
    field.run(3.0);
    assert!(field.vehicle.truth().position_ned_m.z > -0.05);
    // On the way up: it goes there instead.
    assert_eq!(field.command(MavCmd::MAV_CMD_NAV_TAKEOFF, up), MavResult::MAV_RESULT_ACCEPTED);
    field.until(10.0, "lift-off", |vehicle| vehicle.truth().position_ned_m.z < -2.0);
    field.target(POSITION, [6.0, 0.0, -4.0], [0.0; 3]);
    field.run(10.0);
    let off_m = field.vehicle.truth().position_ned_m - nalgebra::Vector3::new(6.0, 0.0, -4.0);
    assert!(off_m.norm() < 0.2, "{off_m}");
}

#[test]
fn land_touches_down_gently_and_disarms() {
    let mut field = Field::new(&real());
    field.take_off(5.0);
    assert_eq!(field.set_mode(Mode::Land), MavResult::MAV_RESULT_ACCEPTED);
    let mut fastest_mps: f64 = 0.0;
    let mut seconds = 0.0;
    while field.vehicle.autopilot().is_armed() {
        field.run(0.05);
        seconds += 0.05;
        fastest_mps = fastest_mps.max(field.vehicle.truth().velocity_ned_mps.z);
        assert!(seconds < 40.0, "{:?}", field.vehicle.truth());
    }
    // 5 m at LAND_SPEED is 10 s.
    assert!((9.0..20.0).contains(&seconds), "{seconds}");
    assert!(fastest_mps < 0.9, "{fastest_mps}");
    assert!(field.vehicle.truth().landed && field.heard_text("Disarming motors"));
}

#[test]
fn it_lands_on_waves_and_floats_with_them() {
    let mut field = Field::new(&real());
    field.take_off(5.0);
    let wave = |stamp: Stamp| 0.1 * (std::f64::consts::TAU * (stamp.as_nanos() % 3_000_000_000) as f64 / 3e9).sin();
    field.water = Box::new(move |_, stamp| wave(stamp));
    field.target(POSITION, [20.0, 0.0, -5.0], [0.0; 3]);
    field.run(15.0);
    field.set_mode(Mode::Land);
    field.until(40.0, "landing", |vehicle| !vehicle.autopilot().is_armed());
    for _ in 0..100 {
        field.run(0.05);
        let truth = field.vehicle.truth();
        let draft_m = truth.position_ned_m.z + wave(truth.stamp);
        assert!((0.0..0.15).contains(&draft_m), "{draft_m}");
    }
}

/// As ArduCopter's: it wants less than 1 m/s² below 1 Hz for a second, and short steep waves throw it about by more than that.
#[test]
fn steep_waves_keep_the_land_detector_waiting() {
    let mut field = Field::new(&real());
    field.take_off(5.0);
    let wave = |stamp: Stamp| 0.25 * (std::f64::consts::TAU * (stamp.as_nanos() % 2_000_000_000) as f64 / 2e9).sin();
    field.water = Box::new(move |_, stamp| wave(stamp));
    field.target(POSITION, [20.0, 0.0, -5.0], [0.0; 3]);
    field.run(15.0);
    field.set_mode(Mode::Land);
    field.until(40.0, "touchdown", |vehicle| vehicle.truth().landed);
    field.run(30.0);
    assert!(field.vehicle.autopilot().is_armed() && !field.vehicle.autopilot().is_landed());
    // Only by force, as for any vehicle in the air.
    let [disarm, force] = [0.0, 21_196.0].map(|magic| [0.0, magic, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(field.command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, disarm), MavResult::MAV_RESULT_FAILED);
    assert_eq!(field.command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, force), MavResult::MAV_RESULT_ACCEPTED);
}

#[test]
fn rtl_climbs_returns_and_lands_at_home() {
    let mut field = Field::new(&perfect());
    field.take_off(5.0);
    field.target(POSITION, [25.0, 0.0, -5.0], [0.0; 3]);
    field.run(15.0);
    field.set_mode(Mode::Rtl);
    field.until(30.0, "the climb", |vehicle| vehicle.truth().position_ned_m.z < -14.5);
    field.until(120.0, "the landing", |vehicle| !vehicle.autopilot().is_armed());
    assert!(field.vehicle.truth().position_ned_m.xy().norm() < 0.2, "{}", field.vehicle.truth().position_ned_m);
}

/// Home is where it armed last, unless somebody has set it.
#[test]
fn arming_moves_home_until_it_is_set() {
    let mut field = Field::new(&perfect());
    let fly_and_land = |field: &mut Field, north_m: f32| {
        field.take_off(4.0);
        field.target(POSITION, [north_m, 0.0, -4.0], [0.0; 3]);
        field.run(12.0);
        field.set_mode(Mode::Land);
        field.until(40.0, "landing", |vehicle| !vehicle.autopilot().is_armed());
    };
    let home_north_m = |field: &Field| {
        field.heard.iter().rev().find_map(|message| match message {
            MavMessage::HOME_POSITION(data) => Some(f64::from(data.latitude - 531_000_000) / 89.84),
            _ => None,
        })
    };
    fly_and_land(&mut field, 10.0);
    assert!(home_north_m(&field).is_some_and(|north_m| north_m.abs() < 0.1));
    fly_and_land(&mut field, 20.0);
    assert!(home_north_m(&field).is_some_and(|north_m| (north_m - 10.0).abs() < 0.3), "where it armed the second time");
    assert_eq!(field.command(MavCmd::MAV_CMD_DO_SET_HOME, [0.0; 7]), MavResult::MAV_RESULT_ACCEPTED);
    fly_and_land(&mut field, 30.0);
    fly_and_land(&mut field, 30.0);
    assert!(home_north_m(&field).is_some_and(|north_m| (north_m - 20.0).abs() < 0.3), "where it was set");
}

#[test]
fn loss_of_gnss_lands_it() {
    let mut field = Field::new(&real());
    field.take_off(5.0);
    field.vehicle.strike(Fault::GnssLoss);
    let after_s = field.until(10.0, "the fail-safe", |vehicle| vehicle.autopilot().mode() == Mode::Land);
    assert!(after_s > 1.0 && field.heard_text("EKF Failsafe: changed to LAND Mode"), "{after_s} {:?}", field.texts());
    field.until(40.0, "the landing", |vehicle| !vehicle.autopilot().is_armed());
}

#[test]
fn termination_lets_it_fall() {
    let mut field = Field::new(&perfect());
    field.take_off(30.0);
    assert_eq!(
        field.command(MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        MavResult::MAV_RESULT_ACCEPTED
    );
    let before = field.vehicle.truth();
    field.run(1.5);
    let fallen_m = field.vehicle.truth().position_ned_m.z - before.position_ned_m.z;
    // Free fall with quadratic drag: d = v_t²/g ln cosh(g t / v_t), less what thrust is left in the motors' lag (g τ (t − τ)).
    let config = AirframeConfig::default();
    let terminal_mps = (2.0 * config.weight_n() / (1.225 * config.drag_area_m2)).sqrt();
    let seconds = field.vehicle.truth().stamp.seconds_since(before.stamp);
    let free_m = terminal_mps.powi(2) / 9.806_65 * (9.806_65 * seconds / terminal_mps).cosh().ln();
    let lag_m = 9.806_65 * config.motor_lag_s * (seconds - config.motor_lag_s);
    assert!((fallen_m - (free_m - lag_m)).abs() < 0.15, "{fallen_m} against {}", free_m - lag_m);
}

#[test]
fn fail_safes_act_only_when_their_parameters_say_so() {
    let mut field = Field::new(&perfect());
    field.say(MavMessage::HEARTBEAT(mav::HEARTBEAT_DATA::default()));
    field.take_off(5.0);
    field.run(20.0);
    assert_eq!(field.vehicle.autopilot().mode(), Mode::Guided, "FS_GCS_ENABLE is off by default");
    field.set_param("FS_GCS_ENABLE", 1.0);
    field.say(MavMessage::HEARTBEAT(mav::HEARTBEAT_DATA::default()));
    let after_s = field.until(7.0, "the fail-safe", |vehicle| vehicle.autopilot().mode() == Mode::Rtl);
    assert!((4.8..5.5).contains(&after_s), "{after_s}");
    field.set_mode(Mode::Guided);
    field.set_param("FS_GCS_ENABLE", 0.0);
    field.set_param("BATT_LOW_MAH", 3000.0);
    field.set_param("BATT_FS_LOW_ACT", 1.0);
    field.vehicle.strike(Fault::Battery { fraction: 0.25 });
    field.until(1.0, "the battery", |vehicle| vehicle.autopilot().mode() == Mode::Land);
}

#[test]
fn parameters_are_listed_once_each_and_take_effect() {
    let mut field = Field::new(&perfect());
    field.say(MavMessage::PARAM_REQUEST_LIST(mav::PARAM_REQUEST_LIST_DATA { target_system: 1, target_component: 1 }));
    field.run(1.0);
    let values: Vec<_> = field
        .heard
        .iter()
        .filter_map(|message| match message {
            MavMessage::PARAM_VALUE(data) => Some((data.param_index, data.param_count)),
            _ => None,
        })
        .collect();
    assert!(values.len() >= 40 && values.iter().enumerate().all(|(index, value)| usize::from(value.0) == index));
    assert!(values.iter().all(|value| usize::from(value.1) == values.len()));
    field.take_off(5.0);
    field.set_param("WPNAV_SPEED", 150.0);
    field.target(POSITION, [40.0, 0.0, -5.0], [0.0; 3]);
    field.run(6.0);
    let speed_mps = field.vehicle.truth().velocity_ned_mps.norm();
    assert!((speed_mps - 1.5).abs() < 0.1, "{speed_mps}");
}

#[test]
fn a_mission_is_uploaded_flown_and_read_back() {
    let mut field = Field::new(&perfect());
    field.take_off(2.0);
    field.set_mode(Mode::Land);
    field.until(30.0, "landing", |vehicle| !vehicle.autopilot().is_armed());
    let item = |seq: u16, command: MavCmd, place: (i32, i32), z: f32| mav::MISSION_ITEM_INT_DATA {
        seq,
        command,
        frame: mav::MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT,
        x: place.0,
        y: place.1,
        z,
        target_system: 1,
        target_component: 1,
        ..Default::default()
    };
    // 2700e-7 degrees of latitude are 30.05 m here.
    let there = (531_002_700, -29_000_000);
    let items = [
        item(0, MavCmd::MAV_CMD_NAV_WAYPOINT, (0, 0), 0.0),
        item(1, MavCmd::MAV_CMD_NAV_TAKEOFF, (0, 0), 8.0),
        item(2, MavCmd::MAV_CMD_NAV_WAYPOINT, there, 8.0),
        item(3, MavCmd::MAV_CMD_NAV_LAND, there, 0.0),
    ];
    field.say(MavMessage::MISSION_COUNT(mav::MISSION_COUNT_DATA {
        count: 4,
        target_system: 1,
        target_component: 1,
        ..Default::default()
    }));
    for data in &items {
        assert!(matches!(field.heard.last(), Some(MavMessage::MISSION_REQUEST(ask)) if ask.seq == data.seq));
        field.say(MavMessage::MISSION_ITEM_INT(data.clone()));
    }
    assert!(matches!(
        field.heard.last(),
        Some(MavMessage::MISSION_ACK(ack)) if ack.mavtype == mav::MavMissionResult::MAV_MISSION_ACCEPTED
    ));
    field.say(MavMessage::MISSION_REQUEST_INT(mav::MISSION_REQUEST_INT_DATA {
        seq: 2,
        target_system: 1,
        target_component: 1,
        ..Default::default()
    }));
    assert!(matches!(field.heard.last(), Some(MavMessage::MISSION_ITEM_INT(back)) if back.x == there.0 && back.z == 8.0));
    field.set_mode(Mode::Guided);
    assert_eq!(field.arm(), MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(field.command(MavCmd::MAV_CMD_MISSION_START, [0.0; 7]), MavResult::MAV_RESULT_ACCEPTED);
    field.until(90.0, "the mission", |vehicle| !vehicle.autopilot().is_armed());
    let position = field.vehicle.truth().position_ned_m;
    assert!((position.xy() - nalgebra::Vector2::new(30.05, 0.0)).norm() < 0.4, "{position}");
    let reached: Vec<u16> = field
        .heard
        .iter()
        .filter_map(|message| match message {
            MavMessage::MISSION_ITEM_REACHED(data) => Some(data.seq),
            _ => None,
        })
        .collect();
    assert_eq!(reached, [1, 2, 3]);
}

#[test]
fn the_pilots_switch_and_sticks_work_over_rc_override() {
    let mut field = Field::new(&perfect());
    field.take_off(5.0);
    let sticks = |roll: u16, switch: u16| {
        MavMessage::RC_CHANNELS_OVERRIDE(mav::RC_CHANNELS_OVERRIDE_DATA {
            chan1_raw: roll,
            chan2_raw: 1500,
            chan3_raw: 1500,
            chan4_raw: 1500,
            chan5_raw: switch,
            target_system: 1,
            target_component: 1,
            ..Default::default()
        })
    };
    // Third position: FLTMODE3, LOITER. Then half a stick to the right, which with heading north is east.
    for _ in 0..40 {
        field.say(sticks(1700, 1450));
        field.run(0.1);
    }
    assert_eq!(field.vehicle.autopilot().mode(), Mode::Loiter);
    assert!(field.vehicle.truth().velocity_ned_mps.y > 2.0, "{}", field.vehicle.truth().velocity_ned_mps);
    field.run(10.0);
    assert!(field.vehicle.truth().velocity_ned_mps.norm() < 0.2, "without an override the sticks are centred");
}

#[test]
fn the_same_seed_gives_the_same_flight_and_another_another() {
    let fly = |seed: u64| {
        let mut field = Field::new(&SimConfig { seed, ..real() });
        field.take_off(5.0);
        field.target(POSITION, [20.0, 5.0, -5.0], [0.0; 3]);
        field.run(20.0);
        field.vehicle.truth()
    };
    let (one, again, other) = (fly(7), fly(7), fly(8));
    assert_eq!(one, again);
    assert_ne!(one.position_ned_m, other.position_ned_m);
}
