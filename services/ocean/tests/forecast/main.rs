//! Forecasts of made seas against the seas themselves: errors, what is stated of them, and windows offered.
//!
//! The figures of the report: `cargo test --release -p halcyon-ocean --test forecast -- --ignored --nocapture figures`.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests fail by panicking")]

mod score;
mod seas;

use std::hint::black_box;
use std::time::Instant;

use halcyon_ocean::forecast::{Forecast, Level, Limits, Options};
use score::{Belief, Calm, LEADS_S, Score};
use seas::Case;

const SHORT: Case = Case { h_s_m: 0.2, t_p_s: 1.5, gamma: 3.3, s: 10.0, sigma_m: 0.003, spacing_m: 1.0 };
const LONG: Case = Case { h_s_m: 0.5, t_p_s: 4.0, gamma: 3.3, s: 10.0, sigma_m: 0.005, spacing_m: 1.0 };
const CASES: [Case; 8] = [
    Case { h_s_m: 0.05, t_p_s: 1.5, gamma: 3.3, s: 10.0, sigma_m: 0.002, spacing_m: 0.5 },
    Case { sigma_m: 0.005, ..SHORT },
    Case { gamma: 1.0, s: 5.0, ..SHORT },
    Case { h_s_m: 0.3, t_p_s: 2.0, gamma: 3.3, ..SHORT },
    Case { h_s_m: 0.3, t_p_s: 2.0, gamma: 1.0, s: 5.0, sigma_m: 0.005, spacing_m: 0.5 },
    Case { h_s_m: 0.4, t_p_s: 3.0, gamma: 3.3, s: 5.0, ..SHORT },
    LONG,
    Case { gamma: 1.0, s: 5.0, ..LONG },
];

/// All leads but 0 and 8 s: those of a landing.
const NEAR: [usize; 4] = [1, 2, 3, 4];

/// 30 seas are few: coverage over four quantities and leads, which go together, has a standard error of some 1.5 %.
#[test]
fn forecasts_beat_the_sea_and_state_their_errors() {
    for case in [SHORT, LONG] {
        let score = Score::of(case, Belief::Right, &Options::default(), 0..30);
        println!("{case:?}: 3 s {:.3} m, skill {:?}, coverage {:.3}", score.rmse_m(3), score.skills(3), score.coverage(&NEAR));
        assert!(score.rmse_m(3) < 0.25 * case.h_s_m * 0.85);
        assert!(score.skills(1)[0] > 0.8 && score.skills(2)[0] > 0.7);
        assert!((0.92..=0.98).contains(&score.coverage(&NEAR)));
    }
}

/// A level that is not known costs little, as the sea's slopes are still seen.
#[test]
fn free_levels_still_foretell() {
    let options = Options { level: Level::Free, ..Options::default() };
    let score = Score::of(SHORT, Belief::Right, &options, 0..20);
    assert!(score.skills(2)[0] > 0.65 && (0.92..=0.99).contains(&score.coverage(&NEAR)));
}

#[test]
fn a_wrong_prior_is_set_right() {
    for belief in [Belief::Tuned(1.2, 30.0), Belief::Welch] {
        let score = Score::of(LONG, belief, &Options::default(), 0..20);
        println!("{belief:?}: skill {:?}, coverage {:.3}", score.skills(2), score.coverage(&NEAR));
        assert!(score.skills(2)[0] > 0.8 && (0.91..=0.995).contains(&score.coverage(&NEAR)));
    }
}

/// Of 30 or so windows one or two may break; moments at random break a third.
#[test]
fn offered_windows_are_calm() {
    let calm = Calm::of(LONG, Belief::Right, &Options::default(), 2.0, 0..30);
    println!("{calm:?}");
    assert!(calm.offered >= 20.0 && calm.broken <= 0.1 * calm.offered);
    assert!(calm.random_broken > 2.0 * calm.broken);
}

/// The time of a fit with ten seconds of forecasts, and of a search for calm windows, with default bounds.
#[test]
#[ignore = "times hang on the machine"]
fn times() {
    let options = Options::default();
    for case in [SHORT, LONG] {
        let mut sea = seas::Sea::new(case, 1);
        let readings = sea.readings(score::SPAN_S);
        let prior = score::prior(&case, Belief::Right, &mut sea, &readings, &options);
        let ten_seconds: Vec<f64> = (0..=50).map(|i| 0.2 * f64::from(i)).collect();
        let limits = Limits { crest_m: 0.1, slope: 0.2, vertical_speed_mps: 0.3 };
        let mut took: Vec<[f64; 4]> = Vec::new();
        for _ in 0..30 {
            let begin = Instant::now();
            let forecast = Forecast::fit(&readings, &prior, 0.0, &options).unwrap();
            let fit = begin.elapsed();
            black_box(forecast.at_times(score::SPOT, &ten_seconds));
            let both = begin.elapsed();
            black_box(forecast.calm_windows(score::SPOT, &limits, 0.0, 10.0, 1.0));
            let windows = begin.elapsed() - both;
            let begin = Instant::now();
            black_box(score::prior(&case, Belief::Tuned(1.0, 0.0), &mut sea, &readings, &options));
            took.push([fit, both, windows, begin.elapsed()].map(|t| t.as_secs_f64() * 1e3));
        }
        for (i, what) in ["fit", "fit and 10 s of forecast", "calm windows of 10 s", "prior tuned"].iter().enumerate() {
            let mut ms: Vec<f64> = took.iter().map(|t| t[i]).collect();
            ms.sort_by(f64::total_cmp);
            println!(
                "T_p {} s, {} readings, {what}: least {:.1} ms, median {:.1} ms",
                case.t_p_s,
                readings.len(),
                ms[0],
                ms[15]
            );
        }
    }
}

fn environment(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

/// `SEAS` seas of each case, fits of `READINGS`; of the beliefs `BELIEFS` from number `FIRST`.
#[test]
#[ignore = "figures of the report: minutes"]
fn figures() {
    let seas = environment("SEAS", 150);
    let beliefs = [
        Belief::Right,
        Belief::Tuned(1.2, 30.0),
        Belief::Tuned(0.8, -30.0),
        Belief::Welch,
        Belief::Wrong(1.2, 30.0),
        Belief::WelchAllRound,
    ];
    for belief in beliefs.into_iter().skip(environment("FIRST", 0) as usize).take(environment("BELIEFS", 6) as usize) {
        println!("\n{belief:?}");
        for case in CASES {
            let options = Options { readings_max: environment("READINGS", 320) as usize, ..Options::default() };
            let score = Score::of(case, belief, &options, 0..seas);
            let ms = |took: std::time::Duration| took.as_secs_f64() * 1e3 / score.seas;
            let (prior, fit, out) = (ms(score.prior_took), ms(score.fit_took), ms(score.outlooks_took));
            println!("{case:?}: {prior:.0} + {fit:.0} + {out:.0} ms, rmse 3 s {:.3} H_s", score.rmse_m(3) / case.h_s_m);
            println!("  coverage 0-8 s {:.3}, 1-5 s {:.3}", score.coverage(&[0, 1, 2, 3, 4, 5]), score.coverage(&NEAR));
            for lead in NEAR {
                let [elevation, slope, speed] = score.skills(lead);
                let (stated, inside) = (score.stated(lead), score.coverage(&[lead]));
                println!(
                    "  {} s: skill {elevation:.2} (stated {stated:.2}) slope {slope:.2} speed {speed:.2} inside {inside:.3}",
                    LEADS_S[lead]
                );
            }
        }
    }
}

#[test]
#[ignore = "figures of the report: minutes"]
fn calm_figures() {
    let seas = environment("SEAS", 150);
    let beliefs = [Belief::Right, Belief::Tuned(1.2, 30.0), Belief::Welch];
    for belief in beliefs.into_iter().skip(environment("FIRST", 0) as usize).take(environment("BELIEFS", 3) as usize) {
        let mut all = Calm::default();
        for case in CASES {
            for tightness in [1.5, 2.0] {
                let calm = Calm::of(case, belief, &Options::default(), tightness, 1000..1000 + seas);
                let n = calm.offered;
                println!(
                    "{belief:?} {case:?} limits {tightness} sd: offered {n} in {} of {} seas",
                    calm.seas_with_one, calm.seas
                );
                println!(
                    "  broken {:.3}, at random {:.3}; begin {:.2} s ahead, last {:.2} s",
                    calm.broken / n,
                    calm.random_broken / n,
                    calm.lead_s / n,
                    calm.length_s / n
                );
                all.offered += n;
                all.broken += calm.broken;
                all.random_broken += calm.random_broken;
            }
        }
        let n = all.offered;
        println!("{belief:?}, all: {n} offered, broken {:.3}, at random {:.3}\n", all.broken / n, all.random_broken / n);
    }
}
