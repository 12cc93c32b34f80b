//! Anything may happen in any order. The world checks at every plan that nobody is cleared to descend without a safe and fresh
//! verdict, that no two vehicles are sent to one place, that generations increase, and that nothing is announced unstored.

mod common;

use common::{World, manual, mission_id, sea, spec};
use halcyon_model::{Activity, LocalPoint, MissionAction, MissionPhase, Task, VerdictState};
use proptest::prelude::*;

#[derive(Debug, Clone)]
enum Happening {
    Run(f64),
    Verdict(Option<VerdictState>),
    Silent(usize, bool),
    Pilot(usize),
    FailSafe(usize),
    Fine(usize),
    Battery(usize, Option<f64>),
    Teleport(usize, f64, f64),
    StraySea(f64, f64, f64, VerdictState),
    Create(usize, bool, f64, f64),
    Command(usize, usize),
    /// What payloads answer from now on.
    Release(Option<bool>),
    Restart(f64),
}

fn verdict() -> impl Strategy<Value = VerdictState> {
    prop_oneof![4 => Just(VerdictState::Safe), 1 => Just(VerdictState::Unsafe), 1 => Just(VerdictState::Inconclusive)]
}

fn happening() -> impl Strategy<Value = Happening> {
    let vehicle = 0..5usize;
    prop_oneof![
        12 => (0.2..40.0f64).prop_map(Happening::Run),
        2 => prop::option::weighted(0.8, verdict()).prop_map(Happening::Verdict),
        1 => (vehicle.clone(), any::<bool>()).prop_map(|(v, silent)| Happening::Silent(v, silent)),
        1 => vehicle.clone().prop_map(Happening::Pilot),
        1 => vehicle.clone().prop_map(Happening::FailSafe),
        2 => vehicle.clone().prop_map(Happening::Fine),
        1 => (vehicle.clone(), prop::option::of(prop_oneof![Just(f64::NAN), 0.0..1.0f64])).prop_map(|(v, b)| Happening::Battery(v, b)),
        1 => (vehicle, -10.0..80.0f64, -30.0..80.0f64).prop_map(|(v, n, e)| Happening::Teleport(v, n, e)),
        2 => (-10.0..80.0f64, -30.0..80.0f64, -30.0..4.0f64, verdict()).prop_map(|(n, e, age, v)| Happening::StraySea(n, e, age, v)),
        3 => (0..3usize, any::<bool>(), 20.0..80.0f64, -30.0..80.0f64).prop_map(|(m, auto, n, e)| Happening::Create(m, auto, n, e)),
        5 => (0..3usize, 0..7usize).prop_map(|(m, action)| Happening::Command(m, action)),
        1 => any::<Option<bool>>().prop_map(Happening::Release),
        1 => (0.2..12.0f64).prop_map(Happening::Restart),
    ]
}

fn happens(world: &mut World, what: &Happening) {
    let names = ["m0", "m1", "m2"];
    let vehicle_names: Vec<String> = world.vehicles.iter().map(|vehicle| vehicle.id.to_string()).collect();
    let name = |i: &usize| vehicle_names[i % vehicle_names.len()].as_str();
    match what {
        Happening::Run(seconds) => world.run(*seconds),
        Happening::Verdict(verdict) => world.verdict = *verdict,
        Happening::Silent(i, silent) => world.vehicle(name(i)).silent = *silent,
        Happening::Pilot(i) => world.vehicle(name(i)).seized = Some(Activity::PilotControl),
        Happening::FailSafe(i) => world.vehicle(name(i)).seized = Some(Activity::FailSafe { reason: "test".into() }),
        Happening::Fine(i) => {
            world.vehicle(name(i)).seized = None;
            world.vehicle(name(i)).silent = false;
        }
        Happening::Battery(i, battery) => world.vehicle(name(i)).battery = *battery,
        Happening::Teleport(i, north_m, east_m) => {
            let vehicle = world.vehicle(name(i));
            vehicle.position_m.x = *north_m;
            vehicle.position_m.y = *east_m;
        }
        Happening::StraySea(north_m, east_m, since_s, state) => {
            let stray = sea(
                &common::id("buoy"),
                LocalPoint::new(*north_m, *east_m),
                world.now,
                world.now.plus_secs_f64(*since_s),
                *state,
            );
            if world.planner.observe_sea(stray.clone(), world.now).is_ok() {
                world.seas.push(stray);
            }
        }
        Happening::Create(m, automatic, north_m, east_m) => {
            let mission = if *automatic { spec(*north_m, *east_m) } else { manual(*north_m, *east_m) };
            world.command_as("anna", MissionAction::Create(mission_id(names[*m]), mission));
        }
        Happening::Command(m, action) => {
            let id = mission_id(names[*m]);
            let action = match action {
                0 => MissionAction::Approve(id),
                1 => MissionAction::Dispatch(id),
                2 => MissionAction::Pause(id),
                3 => MissionAction::Resume(id),
                4 => MissionAction::Release(id),
                5 => MissionAction::SkipRelease(id),
                _ => MissionAction::Abort(id),
            };
            world.command_as("bert", action);
        }
        Happening::Release(answer) => world.release = answer.map(|yes| if yes { Ok(()) } else { Err("stuck".into()) }),
        Happening::Restart(away_s) => world.restart(*away_s),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn whatever_happens_the_rules_hold_and_abort_ends_everything(happenings in prop::collection::vec(happening(), 1..40)) {
        let mut world = World::new(2, 3);
        world.vehicle("follower-1").has_payload = true;
        world.vehicle("follower-2").has_payload = true;
        for what in &happenings {
            happens(&mut world, what);
            // Busy in one mission is busy for all.
            let crews: Vec<_> = world.planner.missions().flat_map(|m| m.leader.iter().chain(&m.follower).cloned().collect::<Vec<_>>()).collect();
            let distinct: std::collections::BTreeSet<_> = crews.iter().collect();
            prop_assert_eq!(distinct.len(), crews.len());
        }
        let under_way: Vec<_> = world.planner.missions().map(|mission| mission.id.clone()).collect();
        for id in under_way {
            let reply = world.command_as("anna", MissionAction::Abort(id.clone()));
            prop_assert!(reply.accepted, "{}", reply.reason);
            prop_assert_eq!(world.phase(id.as_str()), MissionPhase::Aborted);
        }
        prop_assert_eq!(world.planner.missions().count(), 0);
        for assignment in &world.plan.as_ref().unwrap().assignments {
            prop_assert!(matches!(assignment.task, Task::Return | Task::Hold), "{:?}", assignment);
        }
        for vehicle in &mut world.vehicles {
            vehicle.silent = false;
            vehicle.seized = None;
        }
        world.run(120.0);
        prop_assert!(world.plan.as_ref().unwrap().assignments.is_empty(), "{:#?}", world.plan);
    }

    /// The same happenings give the same plans, missions and events.
    #[test]
    fn the_planner_is_deterministic(happenings in prop::collection::vec(happening(), 1..15)) {
        let run = || {
            let mut world = World::new(2, 2);
            for what in &happenings {
                happens(&mut world, what);
            }
            format!("{:?} {:?} {:?}", world.plan, world.missions, world.notices)
        };
        prop_assert_eq!(run(), run());
    }
}
