//! The payload: when it may go, and that it goes by itself after a touchdown.

use halcyon_model::{FlightMode, Item, ItemFrame, ItemKind, LandedState, ParameterName, VehicleAction};
use nalgebra::Vector3;

use super::world::{World, config, land};
use crate::core::commands::Command;
use crate::core::executor::{Decision, Executor};
use crate::core::payload::{Payload, PayloadKind};

fn with_payload(release_on_touchdown: bool) -> World {
    let mut world = World::new(&[(0.0, 0.0)]);
    let mut config = config("v0");
    config.payload = Payload { kind: PayloadKind::Servo, release_on_touchdown, ..Payload::default() };
    world.executors[0] = Executor::new(config);
    world
}

#[track_caller]
fn refused(decision: &Decision, expected: &str) {
    assert!(matches!(decision, Decision::Refused(why) if why.contains(expected)), "{decision:?} should say {expected:?}");
}

#[test]
fn it_is_let_go_on_the_ground_only_and_only_if_there_is_one() {
    let mut none = World::new(&[(0.0, 0.0)]);
    none.run(0.5, |_| {});
    refused(&none.command(0, VehicleAction::ReleasePayload), "no payload");
    let says_so = |world: &World| {
        let mut state = world.copters[0].state(world.now);
        world.executors[0].complete(&mut state);
        state.has_payload
    };
    assert!(!says_so(&none) && says_so(&with_payload(false)));

    let mut world = with_payload(false);
    world.run(0.5, |_| {});
    let decision = world.command(0, VehicleAction::ReleasePayload);
    assert!(matches!(decision, Decision::Ask(Command::Payload(command)) if command.releases), "{decision:?}");
    assert!(!world.copters[0].holds_payload);
    world.command(0, VehicleAction::SecurePayload);
    assert!(world.copters[0].holds_payload);

    // However low.
    world.airborne(0, Vector3::new(0.0, 0.0, -0.3));
    world.copters[0].mode = FlightMode::Loiter;
    world.step();
    refused(&world.command(0, VehicleAction::ReleasePayload), "in the air");
    assert!(world.copters[0].holds_payload);
}

#[test]
fn landed_but_not_known_to_be_needs_the_motors_off() {
    let decide = |armed: bool, landed: LandedState| {
        let mut world = with_payload(false);
        world.step();
        let mut state = world.copters[0].state(world.now);
        (state.armed, state.landed) = (armed, landed);
        let now = world.now;
        world.executors[0].observe_self(state, now, now);
        matches!(world.command(0, VehicleAction::ReleasePayload), Decision::Ask(_))
    };
    assert!(decide(false, LandedState::Unknown) && decide(true, LandedState::OnGround));
    assert!(!decide(true, LandedState::Unknown) && !decide(false, LandedState::InAir) && !decide(true, LandedState::Landing));
}

#[test]
fn it_goes_by_itself_after_a_planned_landing_if_so_configured_and_once() {
    for by_itself in [true, false] {
        let mut world = with_payload(by_itself);
        world.airborne(0, Vector3::new(10.0, 0.0, -5.0));
        let plan = |world: &mut World| {
            let until = world.now.plus_secs_f64(5.0);
            drop(world.plan(&[(0, land(10.0, 0.0, Some(until)))], 5.0));
        };
        world.until(
            90.0,
            |world| {
                assert!(world.copters[0].holds_payload, "released in the air");
                plan(world);
            },
            |world| !world.copters[0].armed,
        );
        world.run(20.0, plan);
        assert_eq!(world.copters[0].holds_payload, !by_itself);
        let told = world.notes.iter().filter(|(_, note)| note.what == "payload released").count();
        assert_eq!(told, usize::from(by_itself));
    }
}

#[test]
fn what_is_written_in_flight_is_asked_for_twice() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(0.0, 0.0, -5.0));
    // The pilot flies: that is no obstacle to reading.
    world.copters[0].mode = FlightMode::Loiter;
    world.run(0.5, |_| {});
    let name = || ParameterName::new("WPNAV_SPEED").unwrap();
    let set = |even_in_flight| VehicleAction::SetParameter { name: name(), value: 1.0, even_in_flight };
    refused(&world.command(0, set(false)), "even_in_flight");
    assert!(matches!(world.command(0, set(true)), Decision::Transfer(_)));
    assert!(matches!(world.command(0, VehicleAction::ReadParameter { name: name() }), Decision::Transfer(_)));
    refused(&world.command(0, VehicleAction::ClearItems { kind: ItemKind::Fence }), "fence");
    refused(&world.command(0, VehicleAction::UploadItems { kind: ItemKind::Fence, items: Vec::new() }), "fence");
    assert!(matches!(world.command(0, VehicleAction::DownloadItems { kind: ItemKind::Fence }), Decision::Transfer(_)));
    let nowhere = Item {
        command: 16,
        frame: ItemFrame::Home,
        parameters: [None; 4],
        latitude_deg: Some(91.0),
        longitude_deg: None,
        altitude_m: None,
        autocontinue: true,
    };
    refused(
        &world.command(0, VehicleAction::UploadItems { kind: ItemKind::Mission, items: vec![nowhere] }),
        "item 1: latitude_deg",
    );
}
