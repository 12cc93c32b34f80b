//! Stories of whole missions: change the world, step, look at the plan.

mod common;

use common::{World, id, manual, mission_id, spec};
use halcyon_mission_planner::Config;
use halcyon_model::{Activity, CalmForecast, CalmWindow, LocalPoint, MissionAction, MissionPhase, Role, Task, VerdictState};

use MissionPhase::{
    Aborted, Approved, Assessing, AwaitingApproval, Clearing, Completed, Failed, Joining, Landing, Paused, Transit, Waiting,
};

/// Every phase in which something flies or may fly.
const UNDER_WAY: [MissionPhase; 8] = [Waiting, Transit, Assessing, AwaitingApproval, Approved, Joining, Clearing, Landing];

/// A world with mission `m` in `phase`, reached as a person would reach it.
fn world_in(phase: MissionPhase) -> World {
    let mut world = World::new(2, 2);
    if phase == Waiting {
        world.vehicle("leader-1").ready = false;
        world.vehicle("leader-2").ready = false;
        world.run(0.4);
    }
    let mut mission = manual(60.0, 0.0);
    mission.dispatch_on_approval = false;
    world.create("m", mission);
    if phase == Waiting || phase == Transit {
        return world;
    }
    world.run_to("m", Assessing, 60.0);
    if phase == Assessing {
        return world;
    }
    world.run_to("m", AwaitingApproval, 60.0);
    if phase == AwaitingApproval {
        return world;
    }
    world.command(MissionAction::Approve(mission_id("m")));
    if phase != Approved {
        world.command(MissionAction::Dispatch(mission_id("m")));
        world.run_to("m", phase, 120.0);
    }
    assert_eq!(world.phase("m"), phase);
    world
}

#[test]
fn a_mission_runs_by_itself_from_creation_to_touchdown() {
    let mut world = World::new(1, 2);
    world.create("m", spec(60.0, 20.0));
    assert_eq!(world.run_to_end("m", 240.0), Completed);
    assert_eq!(world.phases("m"), [Waiting, Transit, Assessing, Approved, Joining, Clearing, Landing, Completed]);
    let mission = world.mission("m").clone();
    assert_eq!((mission.leader, mission.follower), (Some(id("leader-1")), Some(id("follower-1"))));
    assert!(mission.touchdown.unwrap().distance_m(&LocalPoint::new(60.0, 20.0)) < 1.0);
    assert_eq!(mission.h_s_m.map(|h| h.value), Some(0.05));
    assert_eq!(mission.history[0].who, "anna");
    assert!(mission.history[1..].iter().all(|step| step.who == "planner" && !step.why.is_empty()));
    assert!(world.least_separation_m >= 5.0, "{}", world.least_separation_m);
    // The leader goes home; the follower stays on the water; then both are let go of.
    assert_eq!(world.task("leader-1"), Some(&Task::Return));
    world.run(60.0);
    assert!(
        !world.vehicle("leader-1").airborne() && world.vehicle("leader-1").place().distance_m(&LocalPoint::new(0.0, 0.0)) < 1.0
    );
    assert!(world.vehicle("follower-1").place().distance_m(&LocalPoint::new(60.0, 20.0)) < 1.0);
    assert_eq!(world.plan.as_ref().unwrap().assignments, []);
}

#[test]
fn the_plan_of_each_phase() {
    let heading = 0.0;
    let survey =
        |north_m, east_m| Task::Survey { point: LocalPoint::new(north_m, east_m), height_m: 5.0, heading_rad: Some(heading) };
    for (phase, leader) in [
        (Transit, 60.0),
        (Assessing, 60.0),
        (AwaitingApproval, 60.0),
        (Approved, 60.0),
        (Joining, 60.0),
        (Clearing, 70.0),
        (Landing, 70.0),
    ] {
        let world = world_in(phase);
        assert_eq!(world.task("leader-1"), Some(&survey(leader, 0.0)), "{phase:?}");
        assert_eq!(world.plan.as_ref().unwrap().mission, Some(mission_id("m")));
        match (phase, world.task("follower-1")) {
            // It comes from the west, and so flies on the left.
            (Joining | Clearing, Some(Task::Follow { leader, slot })) => {
                assert_eq!(*leader, id("leader-1"));
                assert_eq!((slot.forward_m, slot.right_m, slot.up_m), (0.0, -7.0, 0.0));
            }
            (Landing, Some(Task::Land { point, approach_height_m, clearance })) => {
                assert_eq!((*point, *approach_height_m), (LocalPoint::new(60.0, 0.0), 5.0));
                assert!(clearance.is_some());
            }
            (_, task) => assert_eq!(task, None, "{phase:?}"),
        }
    }
}

#[test]
fn planning_again_changes_nothing_and_validity_is_extended_every_half_second() {
    for phase in UNDER_WAY {
        let mut world = world_in(phase);
        let before = (world.plan.clone(), world.missions.clone(), world.plans);
        for _ in 0..5 {
            world.step_planner();
        }
        assert_eq!((world.plan.clone(), world.missions.clone(), world.plans), before, "{phase:?}");
        let mut last = world.plan.clone().unwrap();
        for _ in 0..25 {
            world.run(0.2);
            let plan = world.plan.clone().unwrap();
            assert!(world.now.seconds_since(plan.stamp) < 1.0, "{phase:?}: not extended");
            assert!((plan.valid_until.seconds_since(plan.stamp) - 5.0).abs() < 1e-6);
            assert!(plan.generation >= last.generation);
            last = plan;
        }
    }
}

#[test]
fn a_person_approves_and_dispatches() {
    let mut world = world_in(AwaitingApproval);
    world.run(30.0);
    assert_eq!(world.phase("m"), AwaitingApproval, "nobody goes without approval");
    world.command_as("bert", MissionAction::Approve(mission_id("m")));
    world.run(30.0);
    assert_eq!(world.phase("m"), Approved, "nobody goes without the dispatch");
    world.command_as("carla", MissionAction::Dispatch(mission_id("m")));
    assert_eq!(world.phase("m"), Joining, "a command is carried out at once");
    assert_eq!(world.run_to_end("m", 120.0), Completed);
    let who: Vec<&str> = world.mission("m").history.iter().map(|step| step.who.as_str()).collect();
    assert_eq!(who, ["anna", "planner", "planner", "planner", "bert", "carla", "planner", "planner", "planner", "planner"]);
}

#[test]
fn dispatch_while_awaiting_approval_means_both() {
    let mut world = world_in(AwaitingApproval);
    world.command(MissionAction::Dispatch(mission_id("m")));
    assert_eq!(world.phase("m"), Joining);
    assert_eq!(world.run_to_end("m", 120.0), Completed);
}

#[test]
fn an_unsafe_verdict_must_persist_to_fail_the_mission() {
    let mut world = World::new(1, 1);
    world.verdict = Some(VerdictState::Unsafe);
    world.create("m", spec(60.0, 0.0));
    world.run_to("m", Assessing, 60.0);
    world.run(15.0);
    world.verdict = Some(VerdictState::Inconclusive);
    world.run(15.0);
    assert_eq!(world.phase("m"), Assessing, "15 s of unsafe are not enough");
    world.verdict = Some(VerdictState::Unsafe);
    assert_eq!(world.run_to_end("m", 30.0), Failed);
    assert!(world.last_why("m").contains("unsafe: H_s against 0.1 m"), "{}", world.last_why("m"));
    assert_eq!(world.mission("m").verdict, Some(VerdictState::Unsafe));
    world.run(60.0);
    assert!(!world.vehicle("leader-1").airborne());
    assert_eq!(world.mission("m").follower, None, "nobody was sent");
}

#[test]
fn without_a_conclusion_the_mission_fails_after_three_minutes() {
    for verdict in [None, Some(VerdictState::Inconclusive)] {
        let mut world = World::new(1, 1);
        world.verdict = verdict;
        world.create("m", spec(60.0, 0.0));
        world.run_to("m", Assessing, 60.0);
        world.run(179.0);
        assert_eq!(world.phase("m"), Assessing);
        assert_eq!(world.run_to_end("m", 2.0), Failed);
    }
}

#[test]
fn a_verdict_that_turns_or_expires_takes_the_approval_back() {
    for (phase, verdict) in [
        (AwaitingApproval, Some(VerdictState::Unsafe)),
        (AwaitingApproval, Some(VerdictState::Inconclusive)),
        (AwaitingApproval, None),
        (Approved, Some(VerdictState::Unsafe)),
        (Approved, None),
    ] {
        let mut world = world_in(phase);
        world.verdict = verdict;
        world.run_to("m", Assessing, 12.0);
        for action in [MissionAction::Approve(mission_id("m")), MissionAction::Dispatch(mission_id("m"))] {
            let reply = world.command_as("anna", action);
            assert!(!reply.accepted && reply.reason.contains("once its verdict is safe"), "{}", reply.reason);
        }
        world.verdict = Some(VerdictState::Safe);
        world.run_to("m", AwaitingApproval, 12.0);
    }
}

#[test]
fn water_measured_before_the_leader_settled_or_elsewhere_says_nothing() {
    let mut world = World::new(1, 1);
    world.verdict = None;
    world.create("m", spec(60.0, 0.0));
    world.run_to("m", Assessing, 60.0);
    let (now, rig) = (world.now, id("leader-1"));
    let spot = LocalPoint::new(60.0, 0.0);
    let long_before = now.plus_secs_f64(-10.0);
    let check = |world: &mut World, name: &str, sea: halcyon_model::SeaState, expected| {
        let _ = world.planner.observe_sea(sea.clone(), world.now);
        world.seas.push(sea);
        world.step_planner();
        assert_eq!(world.phase("m"), expected, "{name}");
        world.run(0.2);
    };
    let sea = |at: LocalPoint, world: &World, since| common::sea(&rig, at, world.now, since, VerdictState::Safe);
    let early = sea(spot, &world, long_before);
    check(&mut world, "window began before", early, Assessing);
    let far = sea(LocalPoint::new(60.0, 20.1), &world, now);
    check(&mut world, "20.1 m away", far, Assessing);
    let nan = sea(LocalPoint::new(f64::NAN, 0.0), &world, now);
    check(&mut world, "nowhere", nan, Assessing);
    let mut old = sea(spot, &world, now);
    old.verdict.valid_until = world.now.plus_secs_f64(-0.1);
    check(&mut world, "expired", old, Assessing);
    let good = sea(LocalPoint::new(60.0, 19.9), &world, now);
    check(&mut world, "19.9 m away, since settled", good, Joining);
}

#[test]
fn a_follower_that_may_float_somewhere_is_not_sent() {
    let mut world = World::new(1, 1);
    let follower = world.vehicle("follower-1");
    follower.position_m = nalgebra::Vector3::new(70.0, 0.0, 0.0);
    follower.home_known = false;
    world.create("m", spec(60.0, 0.0));
    world.run_to("m", Approved, 120.0);
    world.run(20.0);
    assert_eq!(world.phase("m"), Approved);
    assert!(world.notices.iter().any(|notice| notice.why.contains("home is not known")), "{:?}", world.notices);
}

/// The wire refuses texts over 4096 bytes: the mission's end would never be seen.
#[test]
fn what_a_large_fleet_waits_for_still_fits_a_message() {
    let mut world = World::new(1, 100);
    for vehicle in world.vehicles.iter_mut().filter(|vehicle| vehicle.id.as_str() != "leader-1") {
        vehicle.ready = false;
        vehicle.activity = halcyon_model::Activity::FailSafe { reason: "position not good enough to fly by".into() };
        vehicle.stuck = true;
    }
    world.create("m", spec(60.0, 0.0));
    assert_eq!(world.run_to_end("m", 600.0), Failed);
    let texts = world.mission("m").history.iter().map(|step| &step.why).chain(world.notices.iter().map(|notice| &notice.why));
    let longest = texts.max_by_key(|text| text.len()).unwrap();
    assert!(longest.len() < 2000 && longest.contains("92 more"), "{} bytes: {longest}", longest.len());
}

#[test]
fn abort_from_every_phase_brings_everyone_home_and_frees_them() {
    for phase in UNDER_WAY.into_iter().chain([Paused]) {
        let mut world = world_in(if phase == Paused { Landing } else { phase });
        if phase == Paused {
            world.command(MissionAction::Pause(mission_id("m")));
        }
        world.command_as("bert", MissionAction::Abort(mission_id("m")));
        assert_eq!(world.phase("m"), Aborted, "{phase:?}");
        assert_eq!(world.mission("m").history.last().unwrap().who, "bert");
        let airborne: Vec<String> = world.vehicles.iter().filter(|v| v.airborne()).map(|v| v.id.to_string()).collect();
        for vehicle in &airborne {
            assert_eq!(world.task(vehicle), Some(&Task::Return), "{phase:?} {vehicle}");
        }
        world.command(MissionAction::Abort(mission_id("m")));
        world.run(60.0);
        for vehicle in &world.vehicles {
            assert!(!vehicle.airborne() && !vehicle.armed, "{phase:?} {}", vehicle.id);
            assert!(vehicle.place().distance_m(&vehicle.home) < 1.0, "{phase:?} {}", vehicle.id);
        }
        assert_eq!(world.plan.as_ref().unwrap().assignments, [], "{phase:?}");
        world.vehicle("leader-1").ready = true;
        world.create("again", spec(60.0, 0.0));
        assert_eq!(world.run_to_end("again", 240.0), Completed, "{phase:?}");
    }
}

#[test]
fn a_follower_already_on_the_water_stays_when_the_mission_is_aborted() {
    let mut world = world_in(Landing);
    while world.vehicle("follower-1").airborne() {
        // The world moves, but the planner hears nothing of the touchdown.
        world.vehicle("follower-1").silent = world.vehicle("follower-1").position_m.z < 0.3;
        world.run(0.2);
    }
    world.vehicle("follower-1").silent = false;
    let spot = world.vehicle("follower-1").place();
    let state = {
        let now = world.now.plus_secs_f64(0.01);
        world.vehicle("follower-1").state(now)
    };
    world.planner.observe_vehicle(state, world.now).unwrap();
    world.command(MissionAction::Abort(mission_id("m")));
    assert_eq!(world.phase("m"), Aborted);
    assert_eq!(world.task("follower-1"), Some(&Task::Hold));
    world.run(30.0);
    assert_eq!(world.vehicle("follower-1").place(), spot);
}

#[test]
fn pause_holds_everyone_and_resume_goes_on_from_every_phase() {
    for phase in UNDER_WAY {
        let mut world = world_in(phase);
        world.command(MissionAction::Pause(mission_id("m")));
        assert_eq!(world.phase("m"), Paused);
        for vehicle in ["leader-1", "follower-1"] {
            match world.task(vehicle) {
                None | Some(Task::Hold) => {}
                // Over the spot it climbs to the approach height, and waits there.
                Some(Task::Land { clearance: None, .. }) if phase == Landing => {}
                other => panic!("{phase:?} {vehicle}: {other:?}"),
            }
        }
        world.command(MissionAction::Pause(mission_id("m")));
        world.run(20.0);
        assert_eq!(world.phase("m"), Paused);
        world.command(MissionAction::Resume(mission_id("m")));
        world.vehicle("leader-1").ready = true;
        let end = world.now.plus_secs_f64(240.0);
        while !world.phase("m").is_final() && world.now < end {
            if world.phase("m") == AwaitingApproval || world.phase("m") == Approved {
                world.command(MissionAction::Dispatch(mission_id("m")));
            }
            world.run(0.2);
        }
        assert_eq!(world.phase("m"), Completed, "{phase:?}: {:#?}", world.mission("m").history);
        assert!(world.least_separation_m >= 5.0);
    }
}

#[test]
fn when_sea_states_stop_the_clearance_lapses_and_the_follower_climbs() {
    let mut world = world_in(Landing);
    while world.vehicle("follower-1").position_m.z > 4.5 {
        world.run(0.2);
    }
    world.verdict = None;
    world.run(8.0);
    assert!(matches!(world.task("follower-1"), Some(Task::Land { clearance: None, .. })), "{:?}", world.task("follower-1"));
    let withdrawn = world.notices.iter().filter(|notice| notice.what == "clearance withdrawn").count();
    assert_eq!((world.phase("m"), withdrawn), (Landing, 1));
    world.run(5.0);
    assert!(world.vehicle("follower-1").airborne());
    world.verdict = Some(VerdictState::Safe);
    assert_eq!(world.run_to_end("m", 30.0), Completed);
}

#[test]
fn when_the_verdict_turns_the_clearance_goes_with_the_next_plan() {
    for verdict in [VerdictState::Unsafe, VerdictState::Inconclusive] {
        let mut world = world_in(Landing);
        while world.vehicle("follower-1").activity != Activity::Descending {
            world.run(0.2);
        }
        world.verdict = Some(verdict);
        world.run(1.2);
        assert!(matches!(world.task("follower-1"), Some(Task::Land { clearance: None, .. })));
        world.run(10.0);
        assert!(world.vehicle("follower-1").position_m.z > 4.5, "it climbed to the approach height");
        assert_eq!(world.run_to_end("m", 200.0), Failed);
        world.run(60.0);
        assert!(world.vehicles.iter().all(|vehicle| vehicle.place().distance_m(&vehicle.home) < 1.0));
    }
}

/// A forecast of calm goes with the clearance if it is of the spot, knows something, and isn't over.
#[test]
fn a_clearance_carries_the_calm_windows_of_its_own_spot() {
    let mut world = world_in(Landing);
    let Some(Task::Land { point: spot, .. }) = world.task("follower-1").cloned() else { panic!("not landing") };
    let window = |world: &World, from_s: f64, to_s: f64| CalmWindow {
        from: world.now.plus_secs_f64(from_s),
        to: world.now.plus_secs_f64(to_s),
    };
    let mut offered = |aside_m: f64, error_share: f64| {
        let windows = vec![window(&world, -5.0, -3.0), window(&world, 2.0, 4.5), window(&world, 6.0, 9.0)];
        let place = LocalPoint::new(spot.north_m + aside_m, spot.east_m);
        world.calm = Some(CalmForecast { place, from: world.now, error_share, windows: windows.clone() });
        world.run(1.4);
        let Some(Task::Land { clearance: Some(clearance), .. }) = world.task("follower-1").cloned() else {
            panic!("not cleared")
        };
        (clearance.windows, windows[1..].to_vec())
    };
    let (given, expected) = offered(1.0, 0.3);
    assert_eq!(given, expected);
    assert_eq!(offered(12.0, 0.3).0, []);
    assert_eq!(offered(1.0, 0.9).0, []);
}

#[test]
fn nobody_descends_onto_another_vehicle() {
    let mut world = world_in(Landing);
    world.vehicle("follower-2").position_m = nalgebra::Vector3::new(62.0, 0.0, 0.0);
    world.run(0.4);
    assert!(matches!(world.task("follower-1"), Some(Task::Land { clearance: None, .. })));
    // Even one that has since fallen silent.
    world.vehicle("follower-2").silent = true;
    world.run(20.0);
    assert!(matches!(world.task("follower-1"), Some(Task::Land { clearance: None, .. })));
}

#[test]
fn a_follower_lost_while_joining_is_replaced() {
    type Trouble = fn(&mut World);
    let troubles: [(&str, Trouble); 3] = [
        ("silent", |world| world.vehicle("follower-1").silent = true),
        ("pilot", |world| world.vehicle("follower-1").seized = Some(Activity::PilotControl)),
        ("fail-safe", |world| world.vehicle("follower-1").seized = Some(Activity::FailSafe { reason: "battery".into() })),
    ];
    for (name, trouble) in troubles {
        let mut world = world_in(Joining);
        world.run(2.0);
        trouble(&mut world);
        while world.mission("m").follower == Some(id("follower-1")) {
            world.run(0.2);
        }
        assert_eq!(world.mission("m").follower, Some(id("follower-2")), "{name}");
        assert!(matches!(world.task("follower-2"), Some(Task::Follow { .. })));
        assert_eq!(world.task("follower-1"), Some(&Task::Return), "{name}");
        assert_eq!(world.run_to_end("m", 120.0), Completed, "{name}");
    }
}

#[test]
fn without_another_follower_the_mission_fails_and_both_return() {
    let mut world = world_in(Joining);
    world.vehicle("follower-2").battery = Some(0.1);
    world.run(2.0);
    world.vehicle("follower-1").seized = Some(Activity::FailSafe { reason: "GNSS lost".into() });
    assert_eq!(world.run_to_end("m", 30.0), Failed);
    let why = world.last_why("m");
    assert!(why.contains("GNSS lost") && why.contains("follower-2: its battery is below 40 %"), "{why}");
    assert_eq!((world.task("leader-1"), world.task("follower-1")), (Some(&Task::Return), Some(&Task::Return)));
}

#[test]
fn a_lost_leader_fails_the_mission_in_every_phase() {
    for phase in [Transit, Assessing, AwaitingApproval, Approved, Joining, Clearing, Landing] {
        let mut world = world_in(phase);
        world.run(1.0);
        world.vehicle("leader-1").silent = true;
        let lost = world.now;
        // A landing that is nearly over may still end by itself.
        let end = world.run_to_end("m", 30.0);
        if end == Failed {
            assert!(world.last_why("m").contains("leader-1 is lost"), "{phase:?}: {}", world.last_why("m"));
            assert!(world.now.seconds_since(lost) >= 8.0);
        } else {
            assert_eq!((phase, end), (Landing, Completed));
        }
        world.run(60.0);
        assert!(!world.vehicle("follower-1").airborne());
    }
}

#[test]
fn every_phase_ends_even_if_nothing_ever_happens() {
    for phase in UNDER_WAY.into_iter().chain([Paused]) {
        let mut world = world_in(if phase == Paused { Assessing } else { phase });
        if phase == Paused {
            world.command(MissionAction::Pause(mission_id("m")));
        }
        for vehicle in &mut world.vehicles {
            vehicle.stuck = true;
        }
        let config = Config::default();
        let longest_s = [config.waiting_max_s, config.transit_max_s, config.station_max_s, 2.0 * config.joining_max_s];
        let end = world.run_to_end("m", longest_s.into_iter().fold(0.0, f64::max) + 30.0);
        assert_eq!(end, Failed, "{phase:?}");
        assert!(!world.last_why("m").is_empty());
    }
}

#[test]
fn a_landing_somewhere_else_is_not_the_missions() {
    let mut world = world_in(Landing);
    let follower = world.vehicle("follower-1");
    follower.position_m = nalgebra::Vector3::new(0.0, -8.0, 0.0);
    follower.touchdown = Some(LocalPoint::new(0.0, -8.0));
    follower.activity = Activity::Landed;
    assert_eq!(world.run_to_end("m", 5.0), Failed);
    assert!(world.last_why("m").contains("from the spot"), "{}", world.last_why("m"));
}

#[test]
fn two_missions_at_once_share_nobody() {
    let mut world = World::new(2, 2);
    world.create("a", spec(60.0, 0.0));
    world.create("b", spec(60.0, 60.0));
    assert_eq!(world.run_to_end("a", 240.0), Completed);
    assert_eq!(world.run_to_end("b", 240.0), Completed);
    let (a, b) = (world.mission("a").clone(), world.mission("b").clone());
    assert_ne!(a.leader, b.leader);
    assert_ne!(a.follower, b.follower);
    // A third waits for a leader to come home; the followers on the water are not sent again by themselves.
    world.create("c", spec(150.0, 0.0));
    assert_eq!(world.phase("c"), Waiting);
    world.run_to("c", Approved, 240.0);
    world.run(20.0);
    assert_eq!(world.phase("c"), Approved);
    assert!(world.notices.iter().any(|notice| notice.what == "mission waits" && notice.why.contains("from its home")));
}

#[test]
fn who_is_sent() {
    let config = Config::default();
    type Change = fn(&mut World);
    let cases: [(&str, Change, &str); 9] = [
        ("the nearest", |_| {}, "leader-1"),
        ("battery", |w| w.vehicle("leader-1").battery = Some(0.39), "leader-2"),
        ("battery unknown", |w| w.vehicle("leader-1").battery = None, "leader-2"),
        ("battery NaN", |w| w.vehicle("leader-1").battery = Some(f64::NAN), "leader-2"),
        ("not ready", |w| w.vehicle("leader-1").ready = false, "leader-2"),
        (
            "silent",
            |w| {
                w.vehicle("leader-1").silent = true;
                w.run(3.0);
            },
            "leader-2",
        ),
        ("pilot", |w| w.vehicle("leader-1").seized = Some(Activity::PilotControl), "leader-2"),
        ("fail-safe", |w| w.vehicle("leader-1").seized = Some(Activity::FailSafe { reason: "x".into() }), "leader-2"),
        ("a follower is no leader", |w| w.vehicle("leader-1").role = Role::Follower, "leader-2"),
    ];
    for (name, change, expected) in cases {
        let mut world = World::with(config.clone(), 2, 1);
        change(&mut world);
        world.run(0.4);
        world.create("m", spec(60.0, 0.0));
        assert_eq!(world.mission("m").leader, Some(id(expected)), "{name}");
    }
    let mut world = World::new(2, 1);
    world.create("m", halcyon_model::MissionSpec { leader: Some(id("leader-2")), ..spec(60.0, 0.0) });
    assert_eq!(world.mission("m").leader, Some(id("leader-2")), "named");
}
