//! Messages in, state out: units, ages, and what is unknown.

use super::*;
use mavlink::dialects::ardupilotmega::{EkfStatusFlags, GpsFixType, MavModeFlag, MavSysStatusSensor};

fn t(s: f64) -> Stamp {
    Stamp::from_secs_f64(1000.0).plus_secs_f64(s)
}

fn telemetry(home_height_m: f64) -> Telemetry {
    let origin = FleetOrigin(Geodetic::from_deg(45.0, 7.0, 220.0));
    Telemetry::new(VehicleId::new("f").unwrap(), Role::Follower, origin, home_height_m)
}

fn basics(telemetry: &mut Telemetry, now: Stamp) {
    let heartbeat =
        ardu::HEARTBEAT_DATA { custom_mode: 4, base_mode: MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED, ..Default::default() };
    telemetry.observe(&MavMessage::HEARTBEAT(heartbeat), now);
    let position = ardu::GLOBAL_POSITION_INT_DATA {
        time_boot_ms: 50_000,
        lat: 450_010_000,
        lon: 70_000_000,
        alt: 231_000,
        relative_alt: 5_000,
        vx: 150,
        vz: -20,
        ..Default::default()
    };
    telemetry.observe(&MavMessage::GLOBAL_POSITION_INT(position), now);
    let attitude = ardu::ATTITUDE_DATA { yaw: -0.5, ..Default::default() };
    telemetry.observe(&MavMessage::ATTITUDE(attitude), now);
}

#[test]
fn unknown_is_none_or_false_and_position_is_from_published_degree_lengths() {
    let mut telemetry = telemetry(1.5);
    assert!(telemetry.state(t(0.0)).is_none());
    basics(&mut telemetry, t(0.0));
    let state = telemetry.state(t(0.0)).unwrap();
    // Snyder: a thousandth of a degree at 45° north is 111.132 m.
    assert!((state.position_ned_m.x - 111.132).abs() < 5e-3, "{}", state.position_ned_m.x);
    assert_eq!(state.position_ned_m.z, -6.5, "relative altitude plus the height of home, not GNSS altitude");
    assert_eq!((state.mode, state.armed), (FlightMode::Guided, true));
    assert!((state.heading_rad - (std::f64::consts::TAU - 0.5)).abs() < 1e-6);
    assert_eq!(state.velocity_ned_mps, Vector3::new(1.5, 0.0, -0.2));
    assert!(!state.estimator_ok && !state.ready_to_arm);
    assert_eq!((state.fix, state.battery_fraction, state.home, state.landed), (None, None, None, LandedState::Unknown));
}

#[test]
fn null_island_is_no_position() {
    let mut telemetry = telemetry(0.0);
    basics(&mut telemetry, t(0.0));
    telemetry.observe(&MavMessage::GLOBAL_POSITION_INT(ardu::GLOBAL_POSITION_INT_DATA::default()), t(1.0));
    assert!(telemetry.state(t(1.0)).is_none());
    assert_eq!(telemetry.missing(), "waiting for the autopilot's position");
}

#[test]
fn health_is_believed_only_while_fresh() {
    let mut telemetry = telemetry(0.0);
    basics(&mut telemetry, t(0.0));
    let good = EkfStatusFlags::from_bits_truncate(831);
    let ekf = |flags| MavMessage::EKF_STATUS_REPORT(ardu::EKF_STATUS_REPORT_DATA { flags, ..Default::default() });
    telemetry.observe(&ekf(good), t(0.0));
    assert!(!telemetry.state(t(0.0)).unwrap().estimator_ok, "no fix yet");
    let gps = ardu::GPS_RAW_INT_DATA { fix_type: GpsFixType::GPS_FIX_TYPE_3D_FIX, satellites_visible: 9, ..Default::default() };
    telemetry.observe(&MavMessage::GPS_RAW_INT(gps), t(0.0));
    assert!(telemetry.state(t(0.0)).unwrap().estimator_ok);
    assert!(!telemetry.state(t(6.0)).unwrap().estimator_ok, "stale");
    telemetry.observe(&ekf(good | EkfStatusFlags::EKF_GPS_GLITCHING), t(0.5));
    assert!(!telemetry.state(t(0.5)).unwrap().estimator_ok);
    telemetry.observe(&ekf(good & !EkfStatusFlags::EKF_POS_HORIZ_ABS), t(0.6));
    assert!(!telemetry.state(t(0.6)).unwrap().estimator_ok);

    let prearm = MavSysStatusSensor::MAV_SYS_STATUS_PREARM_CHECK;
    let status = |health| {
        MavMessage::SYS_STATUS(ardu::SYS_STATUS_DATA {
            onboard_control_sensors_present: prearm,
            onboard_control_sensors_enabled: prearm,
            onboard_control_sensors_health: health,
            battery_remaining: 73,
            voltage_battery: 15_800,
            ..Default::default()
        })
    };
    telemetry.observe(&status(MavSysStatusSensor::empty()), t(1.0));
    assert!(!telemetry.state(t(1.0)).unwrap().ready_to_arm);
    telemetry.observe(&status(prearm), t(2.0));
    let state = telemetry.state(t(2.0)).unwrap();
    assert!(state.ready_to_arm);
    assert_eq!((state.battery_fraction, state.battery_v), (Some(0.73), Some(15.8)));
    assert_eq!(telemetry.state(t(13.0)).unwrap().battery_fraction, None);
}

#[test]
fn each_part_has_its_own_age_and_what_is_dated_ahead_is_unknown() {
    let mut telemetry = telemetry(0.0);
    basics(&mut telemetry, t(0.0));
    let flags = EkfStatusFlags::from_bits_truncate(831);
    let ekf = MavMessage::EKF_STATUS_REPORT(ardu::EKF_STATUS_REPORT_DATA { flags, ..Default::default() });
    let gps = ardu::GPS_RAW_INT_DATA { fix_type: GpsFixType::GPS_FIX_TYPE_3D_FIX, ..Default::default() };
    telemetry.observe(&ekf, t(2.0));
    telemetry.observe(&MavMessage::GPS_RAW_INT(gps), t(2.5));
    telemetry.observe(&MavMessage::ATTITUDE(ardu::ATTITUDE_DATA::default()), t(3.0));
    let ages = telemetry.state(t(4.0)).unwrap().ages;
    assert_eq!((ages.mode_s, ages.attitude_s), (Some(4.0), Some(1.0)));
    assert_eq!((ages.estimator_s, ages.fix_s), (Some(2.0), Some(1.5)));
    assert_eq!((ages.landed_s, ages.battery_s, ages.home_s), (None, None, None));
    assert!(telemetry.state(t(4.0)).unwrap().estimator_ok);
    assert!(!telemetry.state(t(-20.0)).unwrap().estimator_ok, "our clock was set back");
}

/// common.xml: orientation 25 is down, centimetres, quality 1 is an invalid signal and 0 none stated.
#[test]
fn a_range_is_downward_valid_and_of_just_now() {
    let reading = |current_distance, orientation, signal_quality| {
        MavMessage::DISTANCE_SENSOR(ardu::DISTANCE_SENSOR_DATA {
            min_distance: 20,
            max_distance: 700,
            current_distance,
            orientation,
            signal_quality,
            ..Default::default()
        })
    };
    let down = ardu::MavSensorOrientation::MAV_SENSOR_ROTATION_PITCH_270;
    assert_eq!(down as u32, 25);
    let range_of = |message: &MavMessage| {
        let mut telemetry = telemetry(0.0);
        basics(&mut telemetry, t(0.0));
        telemetry.observe(message, t(1.0));
        let range = |s: f64| telemetry.state(t(s)).unwrap().range.map(|range| range.distance_m);
        assert_eq!(range(2.0), None, "old");
        range(1.2)
    };
    assert_eq!(range_of(&reading(150, down, 0)), Some(1.5));
    assert_eq!(range_of(&reading(150, down, 80)), Some(1.5));
    assert_eq!(range_of(&reading(150, down, 1)), None);
    assert_eq!(range_of(&reading(10, down, 0)), None);
    assert_eq!(range_of(&reading(700, down, 0)), None);
    assert_eq!(range_of(&reading(150, ardu::MavSensorOrientation::MAV_SENSOR_ROTATION_NONE, 0)), None);
    let finder = |distance| MavMessage::RANGEFINDER(ardu::RANGEFINDER_DATA { distance, voltage: 0.0 });
    assert_eq!(range_of(&finder(2.5)), Some(2.5));
    assert_eq!((range_of(&finder(0.0)), range_of(&finder(f32::NAN))), (None, None));
    // The one that knows its limits has the word.
    let mut telemetry = telemetry(0.0);
    basics(&mut telemetry, t(0.0));
    telemetry.observe(&reading(700, down, 0), t(1.0));
    telemetry.observe(&finder(7.0), t(1.1));
    assert_eq!(telemetry.state(t(1.2)).unwrap().range, None);
}

/// The first receiver loses its fix, or falls silent: the second has one, and the estimator is content.
#[test]
fn the_better_of_two_receivers_counts() {
    use ardu::GpsFixType as Kind;
    let first = |fix_type, h_acc| MavMessage::GPS_RAW_INT(ardu::GPS_RAW_INT_DATA { fix_type, h_acc, ..Default::default() });
    let second = |fix_type, h_acc| MavMessage::GPS2_RAW(ardu::GPS2_RAW_DATA { fix_type, h_acc, ..Default::default() });
    let kind_and_sigma = |telemetry: &Telemetry, s: f64| {
        let state = telemetry.state(t(s)).unwrap();
        state.fix.map(|fix| (fix.kind, fix.horizontal_sigma_m, state.ages.fix_s.unwrap()))
    };
    let mut telemetry = telemetry(0.0);
    basics(&mut telemetry, t(0.0));
    telemetry.observe(&first(Kind::GPS_FIX_TYPE_3D_FIX, 900), t(1.0));
    telemetry.observe(&second(Kind::GPS_FIX_TYPE_3D_FIX, 400), t(1.5));
    assert_eq!(kind_and_sigma(&telemetry, 2.0), Some((3, Some(0.4), 0.5)));
    telemetry.observe(&first(Kind::GPS_FIX_TYPE_RTK_FIXED, 20), t(2.0));
    assert_eq!(kind_and_sigma(&telemetry, 2.0), Some((6, Some(0.02), 0.0)));
    telemetry.observe(&first(Kind::GPS_FIX_TYPE_NO_FIX, 0), t(3.0));
    assert_eq!(kind_and_sigma(&telemetry, 3.0), Some((3, Some(0.4), 1.5)));
    telemetry.observe(&second(Kind::GPS_FIX_TYPE_NO_GPS, 0), t(4.0));
    assert_eq!(kind_and_sigma(&telemetry, 4.0).unwrap().0, 1);
    telemetry.observe(&second(Kind::GPS_FIX_TYPE_3D_FIX, 400), t(5.0));
    assert_eq!(kind_and_sigma(&telemetry, 9.0).unwrap().0, 3);
    assert_eq!(kind_and_sigma(&telemetry, 11.0), None, "both are old");
}

#[test]
fn a_home_set_anew_in_flight_does_not_move_the_height() {
    let mut telemetry = telemetry(1.5);
    basics(&mut telemetry, t(0.0));
    let home = |altitude_m: f64| {
        let altitude = (altitude_m * 1e3) as i32;
        let (latitude, longitude) = (450_010_000, 70_000_000);
        MavMessage::HOME_POSITION(ardu::HOME_POSITION_DATA { latitude, longitude, altitude, ..Default::default() })
    };
    let landed =
        |landed_state| MavMessage::EXTENDED_SYS_STATE(ardu::EXTENDED_SYS_STATE_DATA { landed_state, ..Default::default() });
    // Where it stands, above sea level and above home.
    let at = |telemetry: &mut Telemetry, lat: i32, amsl_m: f64, relative_m: f64, at_s: f64| {
        let [alt, relative_alt] = [amsl_m, relative_m].map(|height_m| (height_m * 1e3).round() as i32);
        let time_boot_ms = 50_000 + (at_s * 1e3) as u32;
        let data =
            ardu::GLOBAL_POSITION_INT_DATA { time_boot_ms, lat, lon: 70_000_000, alt, relative_alt, ..Default::default() };
        telemetry.observe(&MavMessage::GLOBAL_POSITION_INT(data), t(at_s));
        -telemetry.state(t(at_s)).unwrap().position_ned_m.z
    };
    telemetry.observe(&landed(ardu::MavLandedState::MAV_LANDED_STATE_ON_GROUND), t(0.0));
    telemetry.observe(&home(226.0), t(0.0));
    // On the ground at home it counts anew each time.
    let here = 450_010_000;
    assert_eq!(at(&mut telemetry, here, 226.7, 0.7, 0.1), 2.2);
    assert_eq!(at(&mut telemetry, here, 226.7, 0.0, 0.2), 1.5);
    telemetry.observe(&landed(ardu::MavLandedState::MAV_LANDED_STATE_TAKEOFF), t(0.4));
    assert_eq!(at(&mut telemetry, here, 228.7, 2.0, 1.0), 3.5);
    // Set where it climbs, 3 m up, before HOME_POSITION says so; and again at 5 m; and what is a thousand kilometres is none.
    assert_eq!(at(&mut telemetry, here, 229.7, 0.0, 1.1), 4.5);
    telemetry.observe(&home(229.7), t(1.2));
    telemetry.observe(&landed(ardu::MavLandedState::MAV_LANDED_STATE_IN_AIR), t(1.4));
    assert_eq!(at(&mut telemetry, here, 231.7, 2.0, 2.0), 6.5);
    assert_eq!(at(&mut telemetry, here, 231.7, 0.0, 9.0), 6.5);
    assert_eq!(at(&mut telemetry, here, 231.7, -1e6, 9.1), 6.5);
    // On the water 111 m from there, 1.5 m below home, it is armed again, and takes home there.
    let water = 450_000_000;
    assert_eq!(at(&mut telemetry, water, 225.2, -6.5, 20.0), 0.0);
    telemetry.observe(&landed(ardu::MavLandedState::MAV_LANDED_STATE_ON_GROUND), t(20.0));
    assert_eq!(at(&mut telemetry, water, 225.2, 0.0, 25.0), 0.0);
    // Its receiver's altitude instead of the estimator's, and back after wandering: no new home.
    for amsl_m in [229.2, 231.0, 227.2, 225.2] {
        assert_eq!(at(&mut telemetry, water, amsl_m, 0.0, 30.0), 0.0);
    }
    // A frozen one while it climbs; and back.
    for step in 0..=60 {
        let relative_m = 0.15 * f64::from(step);
        let height_m = at(&mut telemetry, water, 225.2, relative_m, 30.0 + 0.1 * f64::from(step));
        assert!((height_m - relative_m).abs() < 1e-9);
    }
    for (amsl_m, relative_m) in [(234.2, 9.0), (225.2, 9.0), (225.2, 9.0 - 0.15)] {
        assert!((at(&mut telemetry, water, amsl_m, relative_m, 40.0) - relative_m).abs() < 1e-9);
    }
    let mut relative_m = 9.0 - 0.15;
    while relative_m > 0.0 {
        relative_m = f64::max(relative_m - 0.15, 0.0);
        at(&mut telemetry, water, 225.2, relative_m, 45.0);
    }
    // Carried home and armed, it is at home.
    assert!((at(&mut telemetry, here, 226.9, 1.7, 90.0) - 1.7).abs() < 1e-9);
    assert_eq!(at(&mut telemetry, here, 226.9, 0.0, 90.1), 1.5);
    // Taken off from there, afloat beside the jetty, and armed: that is not home.
    telemetry.observe(&landed(ardu::MavLandedState::MAV_LANDED_STATE_IN_AIR), t(91.0));
    telemetry.observe(&landed(ardu::MavLandedState::MAV_LANDED_STATE_ON_GROUND), t(120.0));
    assert!(at(&mut telemetry, here + 1000, 225.4, -1.5, 120.0).abs() < 1e-9);
    assert!(at(&mut telemetry, here + 1000, 225.4, 0.0, 121.0).abs() < 1e-9);
    // A lake at 1500 m, and home set with an altitude of 0.
    assert!((at(&mut telemetry, here + 1000, 225.4, 225.4, 122.0)).abs() < 1e-9);
    // Started again, it counts as at first.
    assert_eq!(at(&mut telemetry, here, 226.9, 0.25, -49.0), 1.75);
}

/// Messages delayed by a queue are still dated when they were measured; a restarted autopilot starts the offset afresh.
#[test]
fn delay_does_not_move_the_stamp() {
    let mut clock = BootClock::default();
    for step in 0..600u32 {
        let measured = t(f64::from(step) * 0.1);
        let delay_s = if step % 7 == 0 { 0.01 } else { 0.01 + 0.3 * f64::from(step % 5) / 5.0 };
        let stamp = clock.stamp(step * 100, measured.plus_secs_f64(delay_s));
        assert!((stamp.seconds_since(measured) - 0.01).abs() < 1e-6 || step < 7, "{step}");
    }
    let stamp = clock.stamp(0, t(100.0));
    assert_eq!(stamp, t(100.0));
}

#[test]
fn a_synced_clock_dates_exactly_and_one_of_another_boot_does_not() {
    let mut clock = BootClock { synced_ns: Some(t(0.0).as_nanos()), ..BootClock::default() };
    // Every message 80 ms late: least delay can't know that.
    assert_eq!(clock.stamp(10_000, t(10.08)), t(10.0));
    assert_eq!(clock.stamp(500, t(20.08)), t(20.08), "restarted");
    clock.synced_ns = Some(t(19.58).as_nanos());
    assert_eq!(clock.stamp(600, t(20.2)), t(20.18));
    assert_eq!(clock.stamp(900, t(20.3)), t(20.3), "never ahead of now");
}
