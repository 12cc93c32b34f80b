//! How long from a leader's state on the bus to the follower's setpoint on the wire: through the service, the in-process bus and a
//! real UDP socket. `cargo run -p halcyon-vehicle-link --example latency` prints the median and the 99th percentile.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::print_stdout, reason = "a measurement, ended by its first surprise")]

use std::net::UdpSocket;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use halcyon_chassis::{testing, topics};
use halcyon_model::{
    Activity, Assignment, DispatchPlan, Fix, FlightMode, LandedState, Role, Slot, Task, VehicleId, VehicleState,
};
use halcyon_vehicle_link::{Config, run};
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::{MavHeader, MavlinkReader};
use nalgebra::{UnitQuaternion, Vector3};

const SAMPLES: usize = 2000;

#[tokio::main]
async fn main() {
    let context = testing::context("vehicle-link.latency").await;
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let endpoint = format!("udpout:{}", socket.local_addr().unwrap());
    let (setpoints, mut arrived) = mpsc::channel();
    std::thread::spawn(move || autopilot(&socket, &setpoints));
    // A tick a second, so that nearly every setpoint is the answer to a state.
    let config = Config { vehicle: "f".into(), role: "follower".into(), endpoint, guidance_rate_hz: 1.0, ..Config::default() };
    tokio::spawn(run(context.clone(), config));
    let (leader, follower) = (VehicleId::new("l").unwrap(), VehicleId::new("f").unwrap());
    let states = context.bus.publisher(&topics::vehicle_state(&leader)).await.unwrap();
    let plans = context.bus.publisher(&topics::plan()).await.unwrap();
    let mut taken_s = Vec::new();
    for count in 0_u64.. {
        let now = context.clock.now();
        if count % 20 == 0 {
            let slot = Slot { forward_m: -7.0, right_m: 0.0, up_m: 0.0 };
            let assignments =
                vec![Assignment { vehicle: follower.clone(), task: Task::Follow { leader: leader.clone(), slot } }];
            let valid_until = now + Duration::from_secs(5);
            plans
                .put(&DispatchPlan { stamp: now, generation: count + 1, mission: None, valid_until, assignments })
                .await
                .unwrap();
        }
        while arrived.try_recv().is_ok() {}
        let put = Instant::now();
        states.put(&state(&leader, &context)).await.unwrap();
        let heard;
        (heard, arrived) =
            tokio::task::spawn_blocking(move || (arrived.recv_timeout(Duration::from_millis(60)), arrived)).await.unwrap();
        if let Ok(at) = heard {
            taken_s.push(Instant::duration_since(&at, put).as_secs_f64());
        }
        if taken_s.len() >= SAMPLES || count > 4 * SAMPLES as u64 {
            break;
        }
        context.clock.sleep(Duration::from_millis(30)).await;
    }
    context.stop.cancel();
    taken_s.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| taken_s.get((share * taken_s.len() as f64) as usize).copied().unwrap_or(f64::NAN) * 1e3;
    println!("{} samples: p50 {:.2} ms, p90 {:.2} ms, p99 {:.2} ms", taken_s.len(), at(0.5), at(0.9), at(0.99));
}

fn state(leader: &VehicleId, context: &halcyon_chassis::Context) -> VehicleState {
    let position_ned_m = Vector3::new(7.0, 0.0, -8.0);
    VehicleState {
        stamp: context.clock.now(),
        vehicle: leader.clone(),
        role: Role::Leader,
        position: context.origin.frame().geodetic_from_ned(position_ned_m),
        position_ned_m,
        velocity_ned_mps: Vector3::zeros(),
        ned_from_body: UnitQuaternion::identity(),
        heading_rad: 0.0,
        home: None,
        mode: FlightMode::Guided,
        armed: true,
        landed: LandedState::InAir,
        battery_fraction: Some(0.9),
        battery_v: None,
        fix: Some(Fix { kind: 6, satellites: 20, horizontal_sigma_m: Some(0.02) }),
        estimator_ok: true,
        ready_to_arm: true,
        boot_s: 100.0,
        activity: Activity::Holding { settled: true },
        plan_generation: 1,
        touchdown: None,
        acceleration_ned_mps2: None,
        intent: None,
        range: None,
        ages: halcyon_model::Ages::default(),
        link: None,
        firmware: None,
        has_payload: false,
    }
}

/// A vehicle that stands in the air, and tells when a setpoint comes.
fn autopilot(socket: &UdpSocket, setpoints: &mpsc::Sender<Instant>) {
    let started = Instant::now();
    let mut told = started;
    let mut sequence = 0;
    let mut buffer = [0; 2048];
    socket.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
    let mut peer = None;
    loop {
        if let Ok((length, from)) = socket.recv_from(&mut buffer) {
            let at = Instant::now();
            peer = Some(from);
            let mut reader = MavlinkReader::new(&buffer[..length]);
            while let Ok((_, message)) = reader.read_any_message::<MavMessage>() {
                let is_setpoint = matches!(
                    message,
                    MavMessage::SET_POSITION_TARGET_GLOBAL_INT(_) | MavMessage::SET_POSITION_TARGET_LOCAL_NED(_)
                );
                if is_setpoint && setpoints.send(at).is_err() {
                    return;
                }
            }
        }
        let Some(peer) = peer.filter(|_| told.elapsed() >= Duration::from_millis(100)) else { continue };
        told = Instant::now();
        for message in telemetry(started.elapsed().as_millis() as u32) {
            let mut frame = Vec::new();
            let header = MavHeader { system_id: 7, component_id: 1, sequence };
            sequence = sequence.wrapping_add(1);
            mavlink::write_v2_msg(&mut frame, header, &message).unwrap();
            socket.send_to(&frame, peer).unwrap();
        }
    }
}

fn telemetry(time_boot_ms: u32) -> Vec<MavMessage> {
    use ardu::{EkfStatusFlags as Ekf, GpsFixType, MavLandedState, MavModeFlag};
    vec![
        MavMessage::HEARTBEAT(ardu::HEARTBEAT_DATA {
            custom_mode: 4,
            mavtype: ardu::MavType::MAV_TYPE_QUADROTOR,
            autopilot: ardu::MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
            base_mode: MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED | MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED,
            ..Default::default()
        }),
        MavMessage::GLOBAL_POSITION_INT(ardu::GLOBAL_POSITION_INT_DATA {
            time_boot_ms,
            lat: 531_172_740,
            lon: -29_053_470,
            alt: 8_000,
            relative_alt: 8_000,
            ..Default::default()
        }),
        MavMessage::ATTITUDE(ardu::ATTITUDE_DATA { time_boot_ms, ..Default::default() }),
        MavMessage::EXTENDED_SYS_STATE(ardu::EXTENDED_SYS_STATE_DATA {
            landed_state: MavLandedState::MAV_LANDED_STATE_IN_AIR,
            ..Default::default()
        }),
        MavMessage::SYS_STATUS(ardu::SYS_STATUS_DATA { battery_remaining: 90, voltage_battery: 16_000, ..Default::default() }),
        MavMessage::EKF_STATUS_REPORT(ardu::EKF_STATUS_REPORT_DATA {
            flags: Ekf::from_bits_truncate(831),
            ..Default::default()
        }),
        MavMessage::GPS_RAW_INT(ardu::GPS_RAW_INT_DATA {
            fix_type: GpsFixType::GPS_FIX_TYPE_3D_FIX,
            satellites_visible: 12,
            ..Default::default()
        }),
        MavMessage::HOME_POSITION(ardu::HOME_POSITION_DATA {
            latitude: 531_172_740,
            longitude: -29_053_470,
            ..Default::default()
        }),
    ]
}
