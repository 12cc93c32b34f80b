//! Nobody comes near to anybody.

use super::*;

#[test]
#[ignore]
fn probe() {
    let count: u64 = std::env::var("FLIGHTS").ok().and_then(|count| count.parse().ok()).unwrap_or(20);
    use rayon::prelude::*;
    let show = |name: String, make: &(dyn Fn(u64) -> SwarmScenario + Sync)| {
        if std::env::var("ONLY").is_ok_and(|only| !name.contains(&only)) {
            return;
        }
        let begin = std::time::Instant::now();
        let mut all: Vec<(f64, u64, SwarmReport)> = (1..=count)
            .into_par_iter()
            .map(|seed| {
                let report = fly(&make(seed)).unwrap();
                (report.least_m, seed, report)
            })
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let at = |q: f64| all[((all.len() - 1) as f64 * q) as usize].0;
        let rms = all.iter().map(|one| one.2.slot_rms_m).sum::<f64>() / all.len() as f64;
        let settled = all.iter().map(|one| one.2.settled_fraction).sum::<f64>() / all.len() as f64;
        println!(
            "{name}: least {:.2} (seed {}) 1% {:.2} 10% {:.2} median {:.2} | slot {rms:.3} settled {settled:.2} | {:.1} s",
            at(0.0),
            all[0].1,
            at(0.01),
            at(0.1),
            at(0.5),
            begin.elapsed().as_secs_f64()
        );
    };
    show("pair".into(), &SwarmScenario::pair);
    show("pair guided silently".into(), &|seed| SwarmScenario { lead: Lead::GuidedSilently, ..SwarmScenario::pair(seed) });
    show("pair guided".into(), &|seed| SwarmScenario { lead: Lead::Guided, ..SwarmScenario::pair(seed) });
    let jump = Trouble::GnssJump { jump_m: 4.0, for_s: 5.0 };
    for trouble in [Trouble::None, Trouble::SlotChanges, Trouble::Passing, jump, Trouble::Silence { for_s: 3.0 }] {
        for formation in Formation::ALL {
            show(format!("nine {formation:?} {trouble:?}"), &|seed| SwarmScenario::nine(formation, trouble, seed));
        }
    }
}
