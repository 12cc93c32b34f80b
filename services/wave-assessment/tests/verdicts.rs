//! Verdicts on many random seas around the limits, with noise and drop-outs: how often "safe" is wrong, and how often it is withheld.
//!
//! `HALCYON_SEAS=10000 cargo test --workspace --test verdicts -- --nocapture` draws as many as the design asks for; `halcyon lab verdicts` draws
//! other waters too.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may fail, and shows its figures")]

use halcyon_wave_assessment::experiment::{CONDITIONS, Drawn, Tally, draw, severity_of};

fn seas(of_ten_thousand: usize) -> usize {
    std::env::var("HALCYON_SEAS").ok().and_then(|n| n.parse::<usize>().ok()).map_or(of_ten_thousand, |n| n.max(10))
}

/// All draws, on all cores.
fn draws(count: usize, severity: impl Fn(u64) -> f64 + Sync) -> Vec<Drawn> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        let severity = &severity;
        let one = move |seed: usize| draw(&CONDITIONS[0], seed as u64, severity(seed as u64)).unwrap();
        let workers: Vec<_> =
            (0..threads).map(|t| scope.spawn(move || (t..count).step_by(threads).map(one).collect::<Vec<_>>())).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    })
}

fn tally<'a>(drawn: impl Iterator<Item = &'a Drawn>) -> Tally {
    let mut tally = Tally::default();
    drawn.for_each(|drawn| tally.add(drawn));
    tally
}

#[test]
fn safe_is_seldom_wrong() {
    let count = seas(300);
    let drawn = draws(count, severity_of);
    let all = tally(drawn.iter());
    let brier = all.brier();
    println!(
        "{count} seas: {} wrongly safe at the end, {} at any time, {} wrongly unsafe; Brier score {brier:.4}",
        all.wrong, all.wrong_ever, all.unfounded
    );
    for bin in 0..8 {
        let low = 0.6 + 0.1 * f64::from(bin);
        let of = tally(drawn.iter().filter(|d| (low..low + 0.1).contains(&d.severity)));
        let share = |count: usize| count as f64 / of.seas.max(1) as f64;
        println!("severity {low:.1} to {:.1}: safe {:.3}, at any time {:.3}", low + 0.1, share(of.safe), share(of.safe_ever));
    }
    for [seas, stated, fit] in all.reliability() {
        println!("{seas:.0} seas stated to be fit with {stated:.2} are so in {fit:.2}");
    }
    // One in a thousand is what is wanted: of few seas one more may be.
    assert!(all.wrong_ever <= 1 + count / 1000, "{} of {count} seas were called safe and are not", all.wrong_ever);
    assert!(brier <= 0.05, "Brier score {brier}");
}

#[test]
fn water_a_fifth_below_the_limits_is_called_safe_within_a_minute() {
    let count = seas(600) / 2;
    let drawn = draws(count, |_| 0.8);
    let all = tally(drawn.iter());
    for (i, what) in ["H_m0", "H_1/10", "slope"].iter().enumerate() {
        let mean = |pick: &dyn Fn(&[f64; 3]) -> f64| drawn.iter().map(|d| pick(&d.measured[i])).sum::<f64>() / count as f64;
        let value = mean(&|m| m[0]);
        let scatter = (mean(&|m| m[0].powi(2)) - value * value).sqrt();
        let [above, under] = [mean(&|m| f64::from(u8::from(m[1] > 1.0))), mean(&|m| f64::from(u8::from(m[2] < 1.0)))];
        let [low, high] = [1, 2].map(|bound| mean(&|m| m[bound]));
        println!(
            "{what} over the truth: {value:.3} ± {scatter:.3}; bounds {low:.3} and {high:.3}, beyond the truth in {above:.3} and {under:.3}"
        );
    }
    let (safe, why) = (all.safe, &all.failed);
    println!(
        "{safe} of {count} seas a fifth below the limits are safe, {} were at some time; withheld for {why:?}",
        all.safe_ever
    );
    // 95 % are wanted, and reached over many: of 300, two deviations fewer may be. A minute of waves of 1 to 1.5 s leaves H_m0 open by 5.6 % whatever
    // is done (4 % at 1 s, 7 % at 1.5 s: the square of the spectrum and the gauges' coherence over the square of its integral).
    assert!(safe * 100 >= 92 * count, "{safe} of {count}: {why:?}");
}
