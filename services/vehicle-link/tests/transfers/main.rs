//! The transfer protocols against a scripted autopilot behind a bad link.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "a test")]
#![allow(deprecated, reason = "ArduPilot still asks by the old messages")]

mod script;
mod simulator;

use halcyon_model::{Content, Item, ItemFrame, ItemKind, Parameter, ParameterKind, ParameterName, Stamp};
use halcyon_vehicle_link::core::commands::Effect;
use halcyon_vehicle_link::core::encode::Address;
use halcyon_vehicle_link::core::transfers::{Ending, Request, TransferError, Transfers};
use halcyon_vehicle_link::core::unlisted::Unlisted;
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavAutopilot, MavCmd, MavFrame, MavMessage, MavMissionType, MavParamType};
use proptest::prelude::*;
use script::{Dice, Script, Wire};

const ARDU: MavAutopilot = MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA;
const PX4: MavAutopilot = MavAutopilot::MAV_AUTOPILOT_PX4;

struct Bench {
    transfers: Transfers,
    script: Script,
    up: Wire,
    down: Wire,
    dice: Dice,
    now_s: f64,
    endings: Vec<(u64, Ending)>,
    /// Nothing gets through any more.
    cut: bool,
}

fn t(s: f64) -> Stamp {
    Stamp::from_secs_f64(1000.0).plus_secs_f64(s)
}

fn to() -> Address {
    Address::new(7, 1).unwrap()
}

impl Bench {
    fn new(script: Script, loss: f64, seed: u64) -> Self {
        let wire = || Wire::new(loss, loss / 2.0, 0.02 + loss / 2.0);
        let mut transfers = Transfers::default();
        let heartbeat = ardu::HEARTBEAT_DATA { autopilot: script.kind, ..Default::default() };
        transfers.observe(&MavMessage::HEARTBEAT(heartbeat), (7, 191), t(0.0));
        Self { transfers, script, up: wire(), down: wire(), dice: Dice(seed), now_s: 0.0, endings: Vec::new(), cut: false }
    }

    fn begin(&mut self, ticket: u64, request: Request, within_s: f64) {
        self.transfers.submit(ticket, request, t(self.now_s + within_s)).unwrap();
    }

    fn carry_out(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            match effect {
                Effect::Send(message) if !self.cut => self.up.send(&message, self.now_s, &mut self.dice),
                Effect::Transferred(ticket, ending) => self.endings.push((ticket, ending)),
                Effect::Send(_) | Effect::Done(..) => {}
            }
        }
    }

    /// A hundredth of a second; what is due by time alone is looked at every tenth, as the actor does.
    fn step(&mut self, tick: u32) {
        self.now_s = f64::from(tick) * 0.01;
        for message in self.up.arrived(self.now_s) {
            self.script.take(&message, self.now_s);
        }
        self.script.step(self.now_s);
        for message in self.script.answers() {
            self.down.send(&message, self.now_s, &mut self.dice);
        }
        for message in self.down.arrived(self.now_s) {
            if self.transfers.observe(&message, (7, 191), t(self.now_s)) {
                let effects = self.transfers.poll(to(), t(self.now_s));
                self.carry_out(effects);
            }
        }
        if tick.is_multiple_of(10) {
            let effects = self.transfers.poll(to(), t(self.now_s));
            self.carry_out(effects);
        }
    }

    /// The first ending, and how long it took, seconds.
    fn run(&mut self, request: Request, within_s: f64) -> (Ending, f64) {
        let begun_s = self.now_s;
        self.begin(1, request, within_s);
        let tick = (self.now_s * 100.0).round() as u32;
        for tick in tick + 1..tick + 1 + ((within_s + 1.0) * 100.0) as u32 {
            self.step(tick);
            if let Some((_, ending)) = self.endings.pop() {
                return (ending, self.now_s - begun_s);
            }
        }
        panic!("it never ended");
    }
}

/// Places of which 10⁻⁷ degrees are whole numbers, so that they come back exactly.
fn items(kind: ItemKind, count: usize) -> Vec<Item> {
    let item = |at: usize| Item {
        command: match kind {
            ItemKind::Mission => [16, 22, 21, 20][at % 4],
            ItemKind::Fence => 5001,
            ItemKind::Rally => 5100,
        },
        frame: [ItemFrame::Home, ItemFrame::SeaLevel, ItemFrame::Terrain][at % 3],
        parameters: [Some(at as f64), None, Some(-0.5), Some(3.0)],
        latitude_deg: Some(53.0 + at as f64 / 1024.0),
        longitude_deg: if at % 7 == 6 { None } else { Some(-2.5 - at as f64 / 512.0) },
        altitude_m: Some(5.25 + at as f64),
        autocontinue: at.is_multiple_of(2),
    };
    (0..count).map(item).collect()
}

/// What the list must look like on the wire, by MAVLink's definitions; `home`: with ArduPilot's item 0 in front.
fn check_stored(stored: &[ardu::MISSION_ITEM_INT_DATA], items: &[Item], home: bool) {
    let stored = &stored[usize::from(home)..];
    assert_eq!(stored.len(), items.len());
    for (at, (wire, item)) in stored.iter().zip(items).enumerate() {
        assert_eq!(usize::from(wire.seq), at + usize::from(home));
        assert_eq!(wire.command as u32, u32::from(item.command));
        let frame = match item.frame {
            ItemFrame::Home => MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT,
            ItemFrame::SeaLevel => MavFrame::MAV_FRAME_GLOBAL,
            ItemFrame::Terrain => MavFrame::MAV_FRAME_GLOBAL_TERRAIN_ALT,
            ItemFrame::None => MavFrame::MAV_FRAME_MISSION,
        };
        assert_eq!(wire.frame, frame);
        assert_eq!(f64::from(wire.x), (item.latitude_deg.unwrap() * 1e7).round());
        match item.longitude_deg {
            Some(longitude_deg) => assert_eq!(f64::from(wire.y), (longitude_deg * 1e7).round()),
            None => assert_eq!(wire.y, i32::MAX),
        }
        assert!(wire.param2.is_nan() && wire.param3 == -0.5 && f64::from(wire.z) == item.altitude_m.unwrap());
        assert_eq!(wire.autocontinue, u8::from(item.autocontinue));
    }
}

fn near(a: &[Item], b: &[Item]) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        let (place_a, place_b) = ((a.latitude_deg, a.longitude_deg), (b.latitude_deg, b.longitude_deg));
        for (a, b) in [(place_a.0, place_b.0), (place_a.1, place_b.1)] {
            assert!(a.is_some() == b.is_some() && (a.unwrap_or(0.0) - b.unwrap_or(0.0)).abs() < 0.6e-7, "{a:?} {b:?}");
        }
        let rest = |item: &Item| Item { latitude_deg: None, longitude_deg: None, ..*item };
        assert_eq!(rest(a), rest(b));
    }
}

#[test]
fn every_list_goes_there_and_comes_back_on_both_autopilots() {
    for autopilot in [ARDU, PX4] {
        for kind in ItemKind::ALL {
            let mut bench = Bench::new(Script::new(autopilot), 0.0, 1);
            let (ending, _) = bench.run(Request::Upload(kind, items(kind, 20)), 60.0);
            assert_eq!(ending.unwrap().what, "20 items uploaded");
            let home = autopilot == ARDU && kind == ItemKind::Mission;
            check_stored(&bench.script.lists[kind as usize], &items(kind, 20), home);
            let (ending, _) = bench.run(Request::Download(kind), 60.0);
            let Some(Content::Items(read)) = ending.unwrap().content else { panic!("no items") };
            near(&read, &items(kind, 20));
            let (ending, _) = bench.run(Request::Clear(kind), 60.0);
            assert!(ending.is_ok() && bench.script.lists[kind as usize].is_empty());
            let (ending, _) = bench.run(Request::Download(kind), 60.0);
            assert_eq!(ending.unwrap().content, Some(Content::Items(Vec::new())));
        }
    }
}

#[test]
fn an_empty_upload_clears_and_one_item_is_a_list() {
    let mut bench = Bench::new(Script::new(ARDU), 0.0, 1);
    assert!(bench.run(Request::Upload(ItemKind::Mission, items(ItemKind::Mission, 1)), 60.0).0.is_ok());
    assert_eq!(bench.script.lists[0].len(), 2);
    assert!(bench.run(Request::Upload(ItemKind::Mission, Vec::new()), 60.0).0.is_ok());
    assert!(bench.script.lists[0].is_empty());
}

#[test]
fn a_refused_item_is_named() {
    for (autopilot, at) in [(ARDU, 2), (PX4, 2)] {
        let mut script = Script::new(autopilot);
        script.refuses = Some(22);
        let (ending, _) = Bench::new(script, 0.0, 1).run(Request::Upload(ItemKind::Mission, items(ItemKind::Mission, 4)), 60.0);
        let error = ending.unwrap_err();
        assert_eq!(error.to_string(), format!("the autopilot refused the mission: command not supported (item {at})"));
    }
}

#[test]
fn silence_ends_everything_and_says_how_far_it_went() {
    let all = [
        Request::Read(ParameterName::new("X").unwrap()),
        Request::ReadAll,
        Request::Set(ParameterName::new("X").unwrap(), 1.0),
        Request::Download(ItemKind::Rally),
        Request::Upload(ItemKind::Fence, items(ItemKind::Fence, 3)),
        Request::Clear(ItemKind::Mission),
    ];
    for request in all {
        let mut bench = Bench::new(Script::new(ARDU), 0.0, 1);
        bench.cut = true;
        let (ending, took_s) = bench.run(request.clone(), 300.0);
        assert!(matches!(ending, Err(TransferError::TimedOut { .. })) && took_s < 15.0, "{request:?}: {ending:?}, {took_s} s");
        let mut bench = Bench::new(Script::new(ARDU), 0.0, 1);
        bench.cut = true;
        let (ending, took_s) = bench.run(request, 1.5);
        assert!(matches!(ending, Err(TransferError::Late { .. })) && took_s < 1.7);
    }
    // In the middle of it.
    let mut bench = Bench::new(Script::new(PX4), 0.0, 1);
    bench.begin(1, Request::Upload(ItemKind::Mission, items(ItemKind::Mission, 100)), 300.0);
    for tick in 1..60 {
        bench.step(tick);
    }
    let (_, _, done, total) = bench.transfers.progress().unwrap();
    assert!(done > 5 && done < 100 && total == 100, "{done}");
    bench.cut = true;
    for tick in 60..4000 {
        bench.step(tick);
    }
    assert!(matches!(bench.endings[..], [(1, Err(TransferError::TimedOut { .. }))]), "{:?}", bench.endings);
}

#[test]
fn a_cancellation_ends_those_under_way_and_those_that_wait_and_tells_the_autopilot() {
    let mut bench = Bench::new(Script::new(ARDU), 0.0, 1);
    bench.begin(1, Request::Upload(ItemKind::Mission, items(ItemKind::Mission, 100)), 300.0);
    bench.begin(2, Request::ReadAll, 300.0);
    for tick in 1..40 {
        bench.step(tick);
    }
    let (count, effects) = bench.transfers.cancel(Some(to()));
    bench.carry_out(effects);
    assert_eq!(count, 2);
    assert_eq!(bench.endings, [(1, Err(TransferError::Cancelled)), (2, Err(TransferError::Cancelled))]);
    for tick in 40..100 {
        bench.step(tick);
    }
    assert_eq!((bench.script.cancelled, bench.script.lists[0].len()), (1, 0));
    bench.endings.clear();
    // And it's free for the next.
    assert!(bench.run(Request::Upload(ItemKind::Mission, items(ItemKind::Mission, 3)), 60.0).0.is_ok());
}

#[test]
fn a_lost_link_ends_all_and_the_line_is_bounded() {
    let mut transfers = Transfers::default();
    let mut accepted = 0;
    while transfers.submit(accepted, Request::ReadAll, t(100.0)).is_ok() {
        accepted += 1;
    }
    assert_eq!(transfers.submit(99, Request::ReadAll, t(100.0)), Err(TransferError::Busy));
    assert_eq!(transfers.abandon().len() as u64, accepted);
    assert!(transfers.poll(to(), t(1.0)).is_empty());
}

#[test]
fn another_clients_messages_do_not_count() {
    let mut bench = Bench::new(Script::new(PX4), 0.0, 1);
    bench.begin(1, Request::Clear(ItemKind::Mission), 300.0);
    bench.transfers.poll(to(), t(0.0));
    for (system, component) in [(255, 190), (7, 1), (9, 191)] {
        let ack = ardu::MISSION_ACK_DATA { target_system: system, target_component: component, ..Default::default() };
        assert!(!bench.transfers.observe(&MavMessage::MISSION_ACK(ack), (7, 191), t(0.1)));
    }
    let fence = ardu::MISSION_ACK_DATA {
        target_system: 7,
        target_component: 191,
        mission_type: MavMissionType::MAV_MISSION_TYPE_FENCE,
        ..Default::default()
    };
    bench.transfers.observe(&MavMessage::MISSION_ACK(fence), (7, 191), t(0.1));
    assert!(bench.transfers.poll(to(), t(0.2)).is_empty());
}

#[test]
fn a_local_frame_is_not_mistaken_for_degrees() {
    let mut script = Script::new(PX4);
    script.lists[0] = vec![ardu::MISSION_ITEM_INT_DATA {
        command: MavCmd::MAV_CMD_NAV_WAYPOINT,
        frame: MavFrame::MAV_FRAME_LOCAL_NED,
        ..Default::default()
    }];
    let (ending, _) = Bench::new(script, 0.0, 1).run(Request::Download(ItemKind::Mission), 60.0);
    assert!(ending.unwrap_err().to_string().contains("frame"));
}

fn name(text: &str) -> ParameterName {
    ParameterName::new(text).unwrap()
}

fn with_parameters(autopilot: MavAutopilot, count: usize) -> Script {
    let mut script = Script::new(autopilot);
    script.parameters =
        (0..count).map(|at| (format!("P_{at}"), at as f32 * 0.5, MavParamType::MAV_PARAM_TYPE_REAL32)).collect();
    script
}

#[test]
fn a_parameter_is_read_written_and_confirmed() {
    let mut script = with_parameters(ARDU, 3);
    script.parameters.push(("RTL_ALT".into(), 1500.0, MavParamType::MAV_PARAM_TYPE_INT32));
    let mut bench = Bench::new(script, 0.0, 1);
    let (ending, _) = bench.run(Request::Read(name("RTL_ALT")), 60.0);
    let expected = |value| vec![Parameter { name: name("RTL_ALT"), value, kind: ParameterKind::Int32 }];
    assert_eq!(ending.unwrap().content, Some(Content::Parameters(expected(1500.0))));
    let (ending, took_s) = bench.run(Request::Set(name("RTL_ALT"), 2000.0), 60.0);
    assert_eq!(ending.unwrap().content, Some(Content::Parameters(expected(2000.0))));
    assert!(took_s < 0.5 && bench.script.parameters[3].1 == 2000.0);
    for wrong in [1500.5, f64::NAN, 3e9] {
        let sets = |bench: &Bench| bench.script.heard.iter().filter(|m| matches!(m, MavMessage::PARAM_SET(_))).count();
        let before = sets(&bench);
        let (ending, _) = bench.run(Request::Set(name("RTL_ALT"), wrong), 60.0);
        assert!(matches!(ending, Err(TransferError::WrongValue(_))), "{ending:?}");
        assert_eq!(sets(&bench), before);
    }
    bench.script.stuck = Some(3);
    let (ending, _) = bench.run(Request::Set(name("RTL_ALT"), 2500.0), 60.0);
    assert_eq!(ending.unwrap_err().to_string(), "RTL_ALT stays at 2000");
}

#[test]
fn px4s_integers_go_by_their_bytes() {
    let mut script = with_parameters(PX4, 1);
    script.parameters.push(("SYS_ID".into(), f32::from_bits(0xFFFF_FFFE), MavParamType::MAV_PARAM_TYPE_INT32));
    let mut bench = Bench::new(script, 0.0, 1);
    let Some(Content::Parameters(read)) = bench.run(Request::Read(name("SYS_ID")), 60.0).0.unwrap().content else {
        panic!("nothing read")
    };
    assert_eq!(read[0].value, -2.0);
    assert!(bench.run(Request::Set(name("SYS_ID"), 77.0), 60.0).0.is_ok());
    assert_eq!(bench.script.parameters[1].1.to_bits(), 77);
}

/// MAVLink may get errors that the dialect has not; one for another client is not ours.
#[test]
fn an_error_that_is_not_known_ends_it_with_its_number() {
    for request in [Request::Read(name("P_1")), Request::Set(name("P_1"), 1.0)] {
        let mut transfers = Transfers::default();
        transfers.submit(1, request, t(60.0)).unwrap();
        transfers.poll(to(), t(0.0));
        let error = |param: &str, target_component| {
            let data = ardu::PARAM_ERROR_DATA {
                param_index: -1,
                target_system: 7,
                target_component,
                param_id: param.into(),
                ..Default::default()
            };
            Unlisted::ParamError(data, 42)
        };
        assert!(!transfers.observe_unlisted(&error("P_1", 190), (7, 191)));
        transfers.observe_unlisted(&error("P_2", 191), (7, 191));
        assert!(transfers.poll(to(), t(0.1)).is_empty());
        assert!(transfers.observe_unlisted(&error("P_1", 191), (7, 191)));
        let effects = transfers.poll(to(), t(0.2));
        let [Effect::Transferred(1, Err(error))] = &effects[..] else { panic!("{effects:?}") };
        assert_eq!(error.to_string(), "the autopilot refused P_1: error 42, which is not known here");
    }
}

#[test]
fn an_unknown_name_is_told_from_silence() {
    for says_errors in [true, false] {
        let mut script = with_parameters(ARDU, 5);
        script.says_errors = says_errors;
        let mut bench = Bench::new(script, 0.0, 1);
        let (ending, took_s) = bench.run(Request::Read(name("NONE")), 60.0);
        assert_eq!(ending.unwrap_err().to_string(), "the autopilot knows no parameter NONE");
        // ArduPilot 4.7 says so; before that it says nothing, and another one's answer must tell.
        assert_eq!(took_s < 0.5, says_errors, "{took_s}");
        let (ending, took_s) = bench.run(Request::Set(name("RTL_ALT"), 1500.0), 60.0);
        let said = ending.unwrap_err().to_string();
        assert_eq!(said, "the autopilot knows no parameter RTL_ALT; since ArduPilot 4.7 it is RTL_ALT_M = RTL_ALT / 100");
        assert_eq!(took_s < 0.5, says_errors, "{took_s}");
    }
}

/// ArduPilot 4.7 tells an error of a value by PARAM_ERROR, with the value that stays after it or without; one that another client
/// got for the same parameter is not ours.
#[test]
fn a_value_that_is_refused_ends_the_writing_at_once_and_only_ours_does() {
    let mut bench = Bench::new(with_parameters(ARDU, 3), 0.0, 1);
    bench.script.denies = Some(1);
    let (ending, took_s) = bench.run(Request::Set(name("P_1"), 7.0), 60.0);
    assert_eq!(ending.unwrap_err().to_string(), "the autopilot refused P_1: permission denied");
    assert!(took_s < 0.5, "{took_s}");
    bench.script.denies = None;
    bench.script.denies_another = true;
    assert_eq!(bench.run(Request::Set(name("P_1"), 7.0), 60.0).0.unwrap().what, "P_1 is 7");
}

fn read_all(ending: Ending) -> Vec<(String, f64)> {
    let Some(Content::Parameters(read)) = ending.unwrap().content else { panic!("no parameters") };
    read.into_iter().map(|parameter| (parameter.name.to_string(), parameter.value)).collect()
}

#[test]
fn a_thousand_parameters_over_a_link_that_loses_a_fifth() {
    let mut bench = Bench::new(with_parameters(ARDU, 1000), 0.2, 7);
    let (ending, took_s) = bench.run(Request::ReadAll, 120.0);
    let expected: Vec<_> = (0..1000).map(|at| (format!("P_{at}"), f64::from(at) * 0.5)).collect();
    assert_eq!(read_all(ending), expected);
    assert!(took_s < 60.0, "{took_s}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// It ends; whatever it says was done was done, and a link that loses no more than a tenth is good enough.
    #[test]
    fn an_upload_over_a_bad_link(seed: u64, loss in 0.0..0.4f64, count in 1usize..40, ardupilot: bool) {
        let autopilot = if ardupilot { ARDU } else { PX4 };
        let mut bench = Bench::new(Script::new(autopilot), loss, seed);
        let (ending, _) = bench.run(Request::Upload(ItemKind::Mission, items(ItemKind::Mission, count)), 300.0);
        prop_assert!(ending.is_ok() || loss > 0.1, "{ending:?}");
        if ending.is_ok() {
            check_stored(&bench.script.lists[0], &items(ItemKind::Mission, count), ardupilot);
        }
    }

    #[test]
    fn a_download_over_a_bad_link(seed: u64, loss in 0.0..0.4f64, count in 0usize..40) {
        let mut bench = Bench::new(Script::new(PX4), 0.0, seed);
        bench.run(Request::Upload(ItemKind::Rally, items(ItemKind::Rally, count)), 300.0).0.unwrap();
        (bench.up, bench.down) = (Wire::new(loss, loss / 2.0, 0.3), Wire::new(loss, loss / 2.0, 0.3));
        let (ending, _) = bench.run(Request::Download(ItemKind::Rally), 300.0);
        prop_assert!(ending.is_ok() || loss > 0.1, "{ending:?}");
        if let Ok(done) = ending {
            let Some(Content::Items(read)) = done.content else { panic!("no items") };
            near(&read, &items(ItemKind::Rally, count));
        }
    }

    #[test]
    fn all_parameters_over_a_bad_link(seed: u64, loss in 0.0..0.4f64, count in 1usize..80) {
        let mut bench = Bench::new(with_parameters(ARDU, count), loss, seed);
        let (ending, _) = bench.run(Request::ReadAll, 300.0);
        prop_assert!(ending.is_ok() || loss > 0.1, "{ending:?}");
        if ending.is_ok() {
            prop_assert_eq!(read_all(ending).len(), count);
        }
    }

    #[test]
    fn a_parameter_set_over_a_bad_link(seed: u64, loss in 0.0..0.4f64, value in -100.0..100.0f32) {
        let mut bench = Bench::new(with_parameters(ARDU, 5), loss, seed);
        let (ending, _) = bench.run(Request::Set(name("P_2"), value.into()), 300.0);
        if ending.is_ok() {
            prop_assert_eq!(bench.script.parameters[2].1, value);
        }
    }
}
