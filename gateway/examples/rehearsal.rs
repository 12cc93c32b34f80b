//! A gateway over a fleet that stands still and a planner that accepts everything, for tools that judge the API from outside.
//! Prints its address and runs until it is interrupted: `cargo run -p halcyon-gateway --example rehearsal`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, reason = "a test program")]

#[path = "../tests/support/mod.rs"]
mod support;

use halcyon_model::{
    Assignment, Bytes, Clearance, DispatchPlan, ElevationGrid, Health, HealthState, InstanceId, LocalPoint, MissionId,
    MissionPhase, Plane, Preview, RigId, Severity, Slot, SurfacePatch, Task, VehicleId, VerdictState,
};
use support::{at, event, gateway, mission, sea_state, vehicle};

#[tokio::main]
async fn main() {
    let gateway = gateway().await;
    {
        let mut fleet = gateway.app.store.write();
        let now = at(0.0);
        for id in ["leader-1", "0", "00"] {
            fleet.vehicle(vehicle(id, 0.1), now);
            fleet.sea_state(sea_state(id, 0.1, 5.0), now);
            fleet.surface(patch(id), now);
            fleet.preview(pictures(id), now);
            fleet.mission(mission(id, MissionPhase::AwaitingApproval, 0.0), now);
            fleet.event(event("something", Severity::Warning, Some(id)));
            fleet.health(health(id), now);
        }
        fleet.dispatch_plan(plan(), now);
    }
    println!("http://{}", gateway.address);
    tokio::signal::ctrl_c().await.unwrap();
}

fn patch(rig: &str) -> SurfacePatch {
    SurfacePatch {
        stamp: at(-0.1),
        rig: RigId::new(rig).unwrap(),
        sequence: 1,
        grid: ElevationGrid {
            south_west_north_m: 0.0,
            south_west_east_m: 0.0,
            cell_m: 0.1,
            rows: 2,
            cols: 2,
            elevation_m: vec![0.0, f32::NAN, 0.01, -0.01],
            sigma_m: vec![0.001, f32::NAN, 0.001, 0.001],
        },
        coverage: 0.75,
        plane: Plane { normal: LocalPoint::new(0.0, 0.0).vector().push(1.0), distance_m: 5.0, rms_m: 0.01 },
        points: 3,
        level_m: None,
        level_sigma_m: None,
        level_thesis_m: None,
        error_length_m: 0.1,
        slope_removed: [0.0; 2],
        slope_sigma: 0.0,
        attitude_sigma_rad: 0.0,
        processing_s: 0.01,
    }
}

fn pictures(rig: &str) -> Preview {
    let picture = Bytes::from_static(b"picture");
    Preview { stamp: at(-0.1), rig: RigId::new(rig).unwrap(), left_jpeg: picture.clone(), disparity_png: picture }
}

fn health(host: &str) -> Health {
    Health {
        stamp: at(-0.1),
        instance: InstanceId::new(format!("mission-planner.{host}")).unwrap(),
        service: "mission_planner".into(),
        state: HealthState::Ready,
        detail: "standing still".into(),
        restarts: 0,
        uptime_s: 1.0,
        version: "0".into(),
    }
}

fn plan() -> DispatchPlan {
    let (point, leader) = (LocalPoint::new(30.0, 40.0), VehicleId::new("leader-1").unwrap());
    let clearance =
        Clearance { verdict: VerdictState::Safe, sea_state_stamp: at(-0.1), valid_until: at(3.0), windows: Vec::new() };
    let assign = |id: &str, task| Assignment { vehicle: VehicleId::new(id).unwrap(), task };
    DispatchPlan {
        stamp: at(-0.1),
        generation: 1,
        mission: MissionId::new("0").ok(),
        valid_until: at(5.0),
        assignments: vec![
            assign("leader-1", Task::Survey { point, height_m: 5.0, heading_rad: Some(1.0) }),
            assign("0", Task::Follow { leader, slot: Slot { forward_m: 0.0, right_m: 7.0, up_m: 0.0 } }),
            assign("00", Task::Land { point, approach_height_m: 5.0, clearance: Some(clearance) }),
        ],
    }
}
