//! Transfers with the simulated autopilot, which was written without knowing them.

use halcyon_model::{Content, FleetOrigin, Geodetic, Item, ItemFrame, ItemKind, ParameterName, Stamp};
use halcyon_sim::autopilot::{Inbound, LinkId, Outbound, Params};
use halcyon_sim::config::SimConfig;
use halcyon_sim::vehicle::Vehicle;
use halcyon_vehicle_link::Config;
use halcyon_vehicle_link::autopilot::Autopilot;
use halcyon_vehicle_link::core::commands::Effect;
use halcyon_vehicle_link::core::transfers::{Request, TransferError, Transferred};
use mavlink::MavHeader;

const LINK: LinkId = LinkId(1);
const STEP_S: f64 = 0.02;

struct Craft {
    vehicle: Vehicle,
    link: Autopilot,
    now: Stamp,
    ended: Option<Result<Transferred, TransferError>>,
}

impl Craft {
    fn new() -> Self {
        let now = Stamp::from_secs_f64(1_700_000_000.0);
        let origin = FleetOrigin(Geodetic::from_deg(53.1, -2.9, 40.0));
        let mut vehicle = Vehicle::new(&SimConfig::default(), 0, origin, now).unwrap();
        vehicle.attach(LINK);
        let config = Config { vehicle: vehicle.id().to_string(), ..Config::default() };
        let mut craft = Self { vehicle, link: Autopilot::new(&config, origin, now).unwrap(), now, ended: None };
        while !craft.link.found() {
            craft.step();
        }
        craft
    }

    fn carry_out(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            match effect {
                Effect::Send(message) => self.vehicle.handle(LINK, &Inbound::Message(self.link.header(), message)),
                Effect::Transferred(_, ending) => self.ended = Some(ending),
                Effect::Done(..) => {}
            }
        }
    }

    fn step(&mut self) {
        self.now = self.now.plus_secs_f64(STEP_S);
        self.vehicle.advance(self.now, &|_, _| 0.0);
        let header = MavHeader { system_id: self.vehicle.autopilot().system_id().into(), component_id: 1, sequence: 0 };
        let said: Vec<_> = self.vehicle.take_outbox().map(|(_, outbound)| outbound).collect();
        for outbound in said {
            if let Outbound::Message(message) = outbound
                && self.link.observe(header, &message, self.now).transfer
            {
                let effects = self.link.poll_transfers(self.now);
                self.carry_out(effects);
            }
        }
        let effects = self.link.poll(self.now);
        self.carry_out(effects);
    }

    fn run(&mut self, request: Request) -> Result<Transferred, TransferError> {
        self.link.transfer(1, request, self.now.plus_secs_f64(60.0)).unwrap();
        loop {
            self.step();
            if let Some(ended) = self.ended.take() {
                return ended;
            }
        }
    }

    fn read(&mut self, name: &str) -> f64 {
        let ended = self.run(Request::Read(ParameterName::new(name).unwrap()));
        let Some(Content::Parameters(read)) = ended.unwrap().content else { panic!("nothing read") };
        read[0].value
    }
}

#[test]
fn its_parameters_are_read_set_and_kept_in_range() {
    let mut craft = Craft::new();
    let Some(Content::Parameters(all)) = craft.run(Request::ReadAll).unwrap().content else { panic!("nothing read") };
    assert_eq!(all.len(), usize::from(Params::count()));
    assert!(all.iter().any(|one| one.name.as_str() == "RTL_ALT" && one.value == 1500.0));
    let speed = || ParameterName::new("WPNAV_SPEED").unwrap();
    assert_eq!(craft.run(Request::Set(speed(), 450.0)).unwrap().what, "WPNAV_SPEED is 450");
    assert_eq!(craft.read("WPNAV_SPEED"), 450.0);
    // Its range ends at 2000.
    assert_eq!(craft.run(Request::Set(speed(), 9000.0)).unwrap_err().to_string(), "WPNAV_SPEED stays at 450");
    let none = ParameterName::new("NO_SUCH_ONE").unwrap();
    assert_eq!(craft.run(Request::Read(none.clone())), Err(TransferError::NoSuchParameter(none)));
    // It is of before 4.7.
    let newer = craft.run(Request::Read(ParameterName::new("MAV_SYSID").unwrap())).unwrap_err().to_string();
    assert_eq!(newer, "the autopilot knows no parameter MAV_SYSID; before ArduPilot 4.7 it is SYSID_THISMAV");
}

#[test]
fn a_mission_is_stored_without_home_and_comes_back_as_it_went() {
    let mut craft = Craft::new();
    let item = |command, latitude_deg| Item {
        command,
        frame: ItemFrame::Home,
        parameters: [Some(0.0); 4],
        latitude_deg: Some(latitude_deg),
        longitude_deg: Some(-2.9),
        altitude_m: Some(10.0),
        autocontinue: true,
    };
    let items = vec![item(22, 53.1), item(16, 53.101), item(21, 53.1)];
    assert_eq!(craft.run(Request::Upload(ItemKind::Mission, items.clone())).unwrap().what, "3 items uploaded");
    let Some(Content::Items(read)) = craft.run(Request::Download(ItemKind::Mission)).unwrap().content else {
        panic!("nothing read")
    };
    assert_eq!(read, items);
    let dance = craft.run(Request::Upload(ItemKind::Mission, vec![item(16, 53.1), item(208, 53.1)])).unwrap_err();
    assert_eq!(dance.to_string(), "the autopilot refused the mission: command not supported (item 2)");
    craft.run(Request::Clear(ItemKind::Mission)).unwrap();
    let empty = craft.run(Request::Download(ItemKind::Mission)).unwrap().content;
    assert_eq!(empty, Some(Content::Items(Vec::new())));
}
