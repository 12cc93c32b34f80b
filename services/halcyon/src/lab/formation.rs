//! Tables 6-6 to 6-9: a follower that keeps its distance, beside the thesis's and other laws.

use halcyon_vehicle_link::core::law::Law;
use halcyon_vehicle_link::experiment::swarm::{self, Formation, Lead, SwarmReport, SwarmScenario, Trouble};
use halcyon_vehicle_link::experiment::{Flight, FlightError, Gnss, Report, Scenario, fly};

use super::context::{Lab, LabError};
use super::exhibit::{Exhibit, number};

/// The thesis's flights: table, what was flown, distance, and its mean errors of distance and altitude, metres.
const THESIS: [(&str, Flight, f64, f64, f64); 4] = [
    ("6-6", Flight::SQUARE, 5.0, 0.68, 1.15),
    ("6-7", Flight::SQUARE, 7.0, 0.76, 0.49),
    ("6-8", Flight::SWEEP, 5.0, 0.54, 0.75),
    ("6-9", Flight::SWEEP, 7.0, 0.52, 0.61),
];

/// Laws that are flown side by side.
const LAWS: [(&str, Law); 5] = [
    ("the thesis's quadratic", Law::ThesisQuadratic),
    ("position only", Law::PositionOnly),
    ("position and velocity", Law::PositionVelocity),
    ("and acceleration", Law::PositionVelocityAcceleration),
    ("Halcyon", Law::Halcyon),
];

/// Receivers that are flown.
const RECEIVERS: [(&str, Gnss); 3] =
    [("without error", Gnss::Perfect), ("RTK", Gnss::Rtk), ("the thesis's 2.5 m", Gnss::Thesis)];

pub(super) fn run(lab: &Lab) -> Result<Exhibit, LabError> {
    let mut exhibit = Exhibit::default();
    exhibit.text(
        "Simulated flights in 8 mph of wind with gusts; states cross a radio of 100 ms delay and 5 % loss. The square is flown at 3 m/s with a fixed \
         heading, the sweep turns a standing leader once round. Distance and altitude errors are by what the vehicles report of themselves, as the \
         thesis measured (6-9); the slot's error and the least separation are the truth. GNSS errors of the two are independent, the worst case: \
         range alone hides them. The thesis flew real vehicles, these are simulated.",
    );
    let seeds = lab.choose(4, 1);
    for (table, flight, slot_m, thesis_range_m, thesis_altitude_m) in THESIS {
        let mut rows = Vec::new();
        for (name, law) in LAWS {
            // Without the separation filter: it would hide how near a law comes.
            let flown =
                mean(seeds, |seed| Scenario { slot_m, seed, separation: law == Law::Halcyon, ..Scenario::new(law, flight) })?;
            rows.push(row(&format!("{name}, no GNSS error"), &flown));
        }
        let shared = mean(seeds, |seed| Scenario { slot_m, seed, shares_intent: true, ..Scenario::new(Law::Halcyon, flight) })?;
        rows.push(row("Halcyon, the leader says what it asks for, no GNSS error", &shared));
        for (name, gnss) in RECEIVERS {
            let flown = mean(seeds, |seed| Scenario { slot_m, seed, gnss, ..Scenario::new(Law::Halcyon, flight) })?;
            if gnss == Gnss::Thesis {
                let what = |error: &str| format!("table {table}, {slot_m:.0} m, receivers of 2.5 m: {error}");
                exhibit.find(what("RMS of the distance"), "m", flown.range_m, Some(thesis_range_m));
                exhibit.find(what("RMS of the altitude"), "m", flown.altitude_m, Some(thesis_altitude_m));
            }
            if gnss != Gnss::Perfect {
                rows.push(row(&format!("Halcyon, receivers: {name}"), &flown));
                let shares = |seed| Scenario { slot_m, seed, gnss, shares_intent: true, ..Scenario::new(Law::Halcyon, flight) };
                rows.push(row(&format!("Halcyon, the leader says what it asks for, receivers: {name}"), &mean(seeds, shares)?));
            }
        }
        rows.push(vec!["the thesis".into(), number(thesis_range_m), number(thesis_altitude_m), "-".into(), "-".into()]);
        exhibit.text(format!(
            "Table {table}: {slot_m:.0} m, {}.",
            if flight == Flight::SQUARE { "square" } else { "sweep of the heading" }
        ));
        exhibit.table(
            vec!["law", "RMS of the distance, m", "RMS of the altitude, m", "RMS from the slot, m", "least separation, m"],
            rows,
        );
    }
    many(lab, &mut exhibit)?;
    Ok(exhibit)
}

/// What befalls nine followers.
const TROUBLES: [(&str, Trouble); 5] = [
    ("turns and wind only", Trouble::None),
    ("two change places, again and again", Trouble::SlotChanges),
    ("another vehicle flies through", Trouble::Passing),
    ("a receiver jumps by 4 m for 5 s", Trouble::GnssJump { jump_m: 4.0, for_s: 5.0 }),
    ("a radio is dead for 3 s", Trouble::Silence { for_s: 3.0 }),
];

/// Many followers, and bad radio.
fn many(lab: &Lab, exhibit: &mut Exhibit) -> Result<(), LabError> {
    exhibit.text(
        "Bad radio, and many. 30 % of all states are lost, each for each receiver by itself, and the rest is up to 300 ms late and out of order; \
         airframes' gains differ by up to 30 % from what guidance believes, lags by up to a half; gusts push. A pilot's leader wheels about as it \
         likes. One follower stands at 5 m; nine stand 7 m from their neighbours. The least true distance between any two of them, over all seeds.",
    );
    let mut rows = Vec::new();
    let seeds = lab.choose(100, 4);
    for (name, lead) in [
        ("one follower, a pilot's leader", Lead::Pilot),
        ("one follower, a leader by plan", Lead::GuidedSilently),
        ("one follower, a leader by plan that says where it means to be", Lead::Guided),
    ] {
        let flights = flown(seeds, |seed| SwarmScenario { lead, ..SwarmScenario::pair(seed) })?;
        rows.push(distances(name, &flights));
    }
    let seeds = lab.choose(20, 1);
    for (trouble_name, trouble) in TROUBLES {
        for (name, formation) in [("line", Formation::Line), ("vee", Formation::Vee), ("column", Formation::Column)] {
            let flights = flown(seeds, |seed| SwarmScenario::nine(formation, trouble, seed))?;
            rows.push(distances(&format!("nine in {name}: {trouble_name}"), &flights));
        }
    }
    exhibit
        .table(vec!["flight", "seeds", "least separation, m", "median of the flights' least, m", "RMS from the slot, m"], rows);
    Ok(())
}

fn flown(seeds: u64, scenario: impl Fn(u64) -> SwarmScenario) -> Result<Vec<SwarmReport>, LabError> {
    let flights: Option<Vec<_>> = (1..=seeds).map(|seed| swarm::fly(&scenario(seed))).collect();
    flights.ok_or(FlightError::Scenario("no such vehicles".into()).into())
}

fn distances(name: &str, flights: &[SwarmReport]) -> Vec<String> {
    let mut least_m: Vec<f64> = flights.iter().map(|flight| flight.least_m).collect();
    least_m.sort_by(f64::total_cmp);
    let at = |index: usize| least_m.get(index).copied().map_or_else(|| "-".into(), number);
    let settled: Vec<f64> = flights.iter().map(|flight| flight.slot_rms_m).filter(|rms_m| rms_m.is_finite()).collect();
    let slot_m = settled.iter().sum::<f64>() / settled.len() as f64;
    vec![name.to_owned(), flights.len().to_string(), at(0), at(flights.len() / 2), number(slot_m)]
}

/// Means over some flights, and the least separation of all.
struct Flown {
    range_m: f64,
    altitude_m: f64,
    slot_m: f64,
    least_m: f64,
}

fn mean(seeds: u64, scenario: impl Fn(u64) -> Scenario) -> Result<Flown, LabError> {
    let flights: Vec<Report> = (1..=seeds).map(|seed| fly(&scenario(seed))).collect::<Result<_, _>>()?;
    let mean = |of: fn(&Report) -> f64| flights.iter().map(of).sum::<f64>() / flights.len() as f64;
    Ok(Flown {
        range_m: mean(|flight| flight.reported.range_rms_m),
        altitude_m: mean(|flight| flight.reported.altitude_rms_m),
        slot_m: mean(|flight| flight.true_errors.slot_rms_m),
        least_m: flights.iter().map(|flight| flight.least_separation_m).fold(f64::INFINITY, f64::min),
    })
}

fn row(name: &str, flown: &Flown) -> Vec<String> {
    let Flown { range_m, altitude_m, slot_m, least_m } = flown;
    std::iter::once(name.to_owned()).chain([range_m, altitude_m, slot_m, least_m].map(|value| number(*value))).collect()
}
