//! How far a verdict can be trusted: many random seas about the limits, each filmed for a minute with noise and drop-outs, and judged as in flight.
//! The thesis has no verdict; this stands beside its chapter 7.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use halcyon_model::IdError;
use halcyon_wave_assessment::experiment::{CONDITIONS, Conditions, Tally, draw, severity_of};

use super::context::{Lab, LabError};
use super::exhibit::{Exhibit, number};
use crate::report::{Chart, Series};

/// Seas that are called safe where they ought to be.
const FIT: f64 = 0.8;
/// A bin of a reliability diagram with fewer seas shows their luck.
const BIN_SEAS_MIN: f64 = 20.0;

pub(super) fn run(lab: &Lab) -> Result<Exhibit, LabError> {
    let (usual, others) = (lab.choose(10_000, 300), lab.choose(1000, 100));
    let sizes = |i: usize| if i == 0 { (usual, usual / 10) } else { (others, others / 2) };
    let total: usize = (0..CONDITIONS.len()).map(|i| sizes(i).0 + sizes(i).1).sum();
    let mut done = 0;
    let progress = lab.progress();
    let mut exhibit = Exhibit::default();
    exhibit.text(
        "Random seas whose truth is known by integrals over their density. Severity is the largest of all limited quantities over its limit: half of \
         the seas lie over 1, evenly from 0.6 to 1.4. Wrongly safe: called so though over a limit, at the end of the minute or at any of the 60 \
         verdicts on the way. Safe at 0.8: called so after a minute where every quantity is at most 0.8 of its limit. The Brier score is the mean \
         square error of the stated probability that the sea is fit; always saying a half scores 0.25. Seas of few waves a minute stay \
         inconclusive, as they should.",
    );
    let mut rows = Vec::new();
    for (i, conditions) in CONDITIONS.iter().enumerate() {
        let (about, fit) = sizes(i);
        let mut counted = |seas: usize, severity: &(dyn Fn(u64) -> f64 + Sync)| {
            let tally = tally(conditions, seas, severity, &|within| progress(done + within, total))?;
            done += seas;
            Ok::<_, IdError>(tally)
        };
        let (all, fit) = (counted(about, &severity_of)?, counted(fit, &|_| FIT)?);
        if i == 0 {
            let share = |count: usize, of: usize| count as f64 / of as f64;
            exhibit.find("seas about the limits", "1", all.seas as f64, None);
            exhibit.find("wrongly safe after a minute, of a thousand", "1", 1e3 * share(all.wrong, all.seas), None);
            exhibit.find("wrongly safe at any time, of a thousand", "1", 1e3 * share(all.wrong_ever, all.seas), None);
            exhibit.find("safe after a minute at 0.8 of the limit", "%", 100.0 * share(fit.safe, fit.seas), None);
            exhibit.find("Brier score", "1", all.brier(), None);
            let stated = all.reliability().into_iter().filter(|[seas, ..]| *seas >= BIN_SEAS_MIN);
            let points: Vec<(f64, f64)> = stated.map(|[_, stated, fit]| (stated, fit)).collect();
            let chart = Chart::new("stated probability to be fit", "share that is fit")
                .with(Series::line("seas, by tenths", points.clone()))
                .with(Series::points("", points))
                .with(Series::dashed("perfect", vec![(0.0, 0.0), (1.0, 1.0)]))
                .from_zero();
            exhibit
                .chart(chart.svg(), format!("Reliability of the stated probability: {} seas, {}", all.seas, conditions.name))?;
        }
        rows.push(row(conditions, &all, &fit));
    }
    exhibit.table(
        vec![
            "seas",
            "number",
            "wrongly safe at the end",
            "at any time",
            "Brier score",
            "safe at 0.8, %",
            "at any time, %",
            "withheld most by",
        ],
        rows,
    );
    Ok(exhibit)
}

fn row(conditions: &Conditions, all: &Tally, fit: &Tally) -> Vec<String> {
    let percent = |count: usize| format!("{:.1}", 100.0 * count as f64 / fit.seas as f64);
    let mut why: Vec<(&String, &usize)> = fit.failed.iter().collect();
    why.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
    let why: Vec<String> = why.iter().take(2).map(|(check, count)| format!("{check} {}", percent(**count))).collect();
    vec![
        conditions.name.to_owned(),
        all.seas.to_string(),
        all.wrong.to_string(),
        all.wrong_ever.to_string(),
        number(all.brier()),
        percent(fit.safe),
        percent(fit.safe_ever),
        why.join(", "),
    ]
}

/// Draws `seas` of them on all cores; `progress` hears how many are done.
fn tally(
    conditions: &Conditions,
    seas: usize,
    severity: &(dyn Fn(u64) -> f64 + Sync),
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Tally, IdError> {
    let next = AtomicUsize::new(0);
    let drawn = Mutex::new((Tally::default(), None));
    let work = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= seas {
                return;
            }
            let one = draw(conditions, number as u64, severity(number as u64));
            let mut drawn = drawn.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            match one {
                Ok(one) => drawn.0.add(&one),
                Err(error) => drawn.1 = Some(error),
            }
            progress(drawn.0.seas);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    let (tally, error) = drawn.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    error.map_or(Ok(tally), Err)
}
