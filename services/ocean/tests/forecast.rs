//! Forecasts of synthesised seas against the seas themselves.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests fail by panicking")]

use std::f64::consts::{PI, TAU};

use halcyon_ocean::forecast::grid::interpolated;
use halcyon_ocean::forecast::{Forecast, Grid, Level, Limits, Options, Prior, Reading, Search, Spot};
use halcyon_ocean::{CosTwoS, GRAVITY_MPS2, Jonswap, Record, SampledSpectrum, Spectrum, Welch};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// One wave of a made sea: wavenumber north and east, angular frequency, amplitude, phase.
struct Wave {
    kn: f64,
    ke: f64,
    omega: f64,
    a: f64,
    phase: f64,
}

/// A sea of `n` waves of random frequencies, directions and phases: frequencies drawn evenly within strips of equal width, directions from
/// the spreading itself by rejection.
fn sea(spectrum: &impl Spectrum, s: f64, towards: f64, n: u32, random: &mut ChaCha8Rng) -> Vec<Wave> {
    let spread = CosTwoS::new(s).unwrap();
    let (low, high) = (0.5 * spectrum.peak_hz(), 4.0 * spectrum.peak_hz());
    // Strips even in the logarithm: the energy sits low.
    let ratio = (high / low).ln() / f64::from(n);
    (0..n)
        .map(|i| {
            let (from, to) = (low * (ratio * f64::from(i)).exp(), low * (ratio * f64::from(i + 1)).exp());
            let f = from + (to - from) * random.random::<f64>();
            let offset = loop {
                let x = (random.random::<f64>() * 2.0 - 1.0) * PI;
                if random.random::<f64>() * spread.density_per_rad(0.0) < spread.density_per_rad(x) {
                    break x;
                }
            };
            let variance = spectrum.density_m2_per_hz(f) * (to - from);
            let (re, im): (f64, f64) = (random.sample(StandardNormal), random.sample(StandardNormal));
            let omega = TAU * f;
            let k = omega * omega / GRAVITY_MPS2;
            let th = towards + offset;
            Wave { kn: k * th.cos(), ke: k * th.sin(), omega, a: (variance * (re * re + im * im)).sqrt(), phase: im.atan2(re) }
        })
        .collect()
}

/// Elevation, slope north, slope east, vertical speed.
fn truth(sea: &[Wave], north: f64, east: f64, t: f64) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for w in sea {
        let (sin, cos) = (w.kn * north + w.ke * east - w.omega * t + w.phase).sin_cos();
        sum[0] += w.a * cos;
        sum[1] -= w.a * w.kn * sin;
        sum[2] -= w.a * w.ke * sin;
        sum[3] += w.a * w.omega * sin;
    }
    sum
}

/// Readings over a 4 m square, `spacing` apart and shaken, at 5 Hz for `span` up to 0.
fn readings(sea: &[Wave], spacing: f64, span: f64, sigma: f64, random: &mut ChaCha8Rng) -> Vec<Reading> {
    let side = (4.0 / spacing) as u32 + 1;
    let mut all = Vec::new();
    for frame in 0..(span * 5.0) as u32 {
        let t = -0.2 * f64::from(frame);
        for i in 0..side * side {
            let north = f64::from(i / side) * spacing - 2.0 + 0.1 * (random.random::<f64>() - 0.5);
            let east = f64::from(i % side) * spacing - 2.0 + 0.1 * (random.random::<f64>() - 0.5);
            let noise: f64 = random.sample(StandardNormal);
            let elevation_m = truth(sea, north, east, t)[0] + sigma * noise;
            all.push(Reading { north_m: north, east_m: east, t_s: t, elevation_m, sigma_m: sigma, group: frame });
        }
    }
    all
}

/// Welch's spectrum of the record of the middle gauge, `span` seconds before 0 at 5 Hz.
fn welch(sea: &[Wave], sigma: f64, span: f64, random: &mut ChaCha8Rng) -> SampledSpectrum {
    let n = (span * 5.0) as u32;
    let record: Vec<f64> = (0..n)
        .map(|i| {
            let noise: f64 = random.sample(StandardNormal);
            truth(sea, 0.0, 0.0, -0.2 * f64::from(n - i))[0] + sigma * noise
        })
        .collect();
    let record = Record::new(record, 5.0).unwrap();
    Welch::with_segments_of_s(12.0, &record).spectrum(&record).unwrap()
}

fn env(name: &str, default: f64) -> f64 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

#[test]
#[ignore = "figures"]
fn explore() {
    let seas = env("SEAS", 60.0) as u64;
    for (h_s, t_p, gamma, s, sigma) in [
        (0.05, 1.5, 3.3, 10.0, 0.002),
        (0.2, 1.5, 3.3, 10.0, 0.003),
        (0.3, 2.0, 1.0, 5.0, 0.005),
        (0.3, 2.5, 3.3, 10.0, 0.003),
        (0.5, 4.0, 3.3, 10.0, 0.005),
        (0.5, 4.0, 1.0, 5.0, 0.005),
    ] {
        let spectrum = Jonswap::new(h_s, t_p, gamma).unwrap();
        let span = env("SPAN", 25.0);
        let spacing = env("SPACING", 1.0);
        let leads = [0.0, 1.0, 2.0, 3.0, 5.0, 8.0];
        let mut square = [[0.0; 6]; 4];
        let mut sum = [[0.0; 6]; 4];
        let mut ign = [0.0; 6];
        let mut inside = [[0.0; 6]; 4];
        let mut inflation = 0.0;
        let mut fit_s = 0.0;
        let mut prior_s = 0.0;
        let mut out_s = 0.0;
        let mut lines = 0;
        let mut rest = 0.0;
        for seed in 0..seas {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let towards = random.random::<f64>() * TAU;
            let sea = sea(&spectrum, s, towards, 300, &mut random);
            let readings = readings(&sea, spacing, span, sigma, &mut random);
            let options = Options {
                level: if env("FREE", 0.0) > 0.0 { Level::Free } else { Level::Known },
                readings_max: env("N", 320.0) as usize,
                per_frame_max: env("P", 16.0) as usize,
                dense_s: env("DENSE", 1.0),
                ..Options::default()
            };
            let start = std::time::Instant::now();
            let turn = towards + env("TURN", 0.0).to_radians();
            let believed = Jonswap::new(h_s, t_p * env("TP", 1.0), gamma).unwrap();
            let grid = Grid {
                lines_max: env("M", 500.0) as usize,
                ..Grid::about_peak(believed.peak_hz(), (16.0 + 10.0) * env("FAC", 1.0), env("EXT", 5.6))
            };
            let density = |f: f64, th: f64| believed.density_m2_per_hz(f) * CosTwoS::new(s).unwrap().density_per_rad(th - turn);
            let welch = welch(&sea, sigma, span, &mut random);
            let table = interpolated(&welch);
            let grid = if env("MODE", 0.0) < 1.5 {
                grid
            } else {
                let f_p = welch.statistics(0.1, 1.5).unwrap().f_p_hz;
                Grid { lines_max: grid.lines_max, ..Grid::about_peak(f_p, grid.span_s, grid.extent_m) }
            };
            let prior: Prior = match env("MODE", 0.0) as u32 {
                0 => grid.directional(density).unwrap(),
                1 => grid.tuned(density, &readings, 0.0, &options, &Search::near()).unwrap().prior,
                2 => {
                    let spread = CosTwoS::new(env("S", 8.0)).unwrap();
                    let density = |f: f64, th: f64| table(f) * spread.density_per_rad(th);
                    grid.tuned(density, &readings, 0.0, &options, &Search::all_round()).unwrap().prior
                }
                _ => grid.spread(|f| table(f), 0.0, CosTwoS::new(0.0).unwrap()).unwrap(),
            };
            prior_s += start.elapsed().as_secs_f64();
            let start = std::time::Instant::now();
            lines = prior.lines().len();
            rest = prior.rest().elevation_m2 / prior.sea().elevation_m2;
            let forecast = Forecast::fit(&readings, &prior, 0.0, &options).unwrap();
            fit_s += start.elapsed().as_secs_f64();
            inflation += forecast.inflation() / seas as f64;
            let start = std::time::Instant::now();
            let times: Vec<f64> = (0..50).map(|i| f64::from(i) * 0.2).collect();
            let spot = Spot { north_m: 0.2, east_m: -0.3 };
            std::hint::black_box(forecast.at_times(spot, &times));
            out_s += start.elapsed().as_secs_f64();
            for (i, (lead, o)) in leads.iter().zip(forecast.at_times(spot, &leads)).enumerate() {
                let t = truth(&sea, spot.north_m, spot.east_m, *lead);
                let m = [o.elevation_m, o.slope_north, o.slope_east, o.vertical_speed_mps];
                let e = [o.elevation_sigma_m, o.slope_north_sigma, o.slope_east_sigma, o.vertical_speed_sigma_mps];
                ign[i] += o.ignorance.elevation / seas as f64;
                for q in 0..4 {
                    square[q][i] += (m[q] - t[q]).powi(2);
                    sum[q][i] += t[q].powi(2);
                    if (m[q] - t[q]).abs() <= 1.96 * e[q] {
                        inside[q][i] += 1.0 / seas as f64;
                    }
                }
            }
        }
        let (mut all, mut near) = (0.0, 0.0);
        for i in 0..6 {
            for q in 0..4 {
                all += inside[q][i] / 24.0;
                if i < 5 && i > 0 {
                    near += inside[q][i] / 16.0;
                }
            }
        }
        println!(
            "COV {all:.3} near {near:.3} H {h_s} T {t_p} g {gamma} s {s} noise {sigma}: lines {lines} rest {rest:.3} inflation {inflation:.2} prior {:.1} ms fit {:.1} ms out {:.1} ms",
            prior_s / seas as f64 * 1e3,
            fit_s / seas as f64 * 1e3,
            out_s / seas as f64 * 1e3
        );
        for (i, lead) in leads.iter().enumerate() {
            let skill = [0, 1, 2, 3].map(|q| format!("{:6.3}", 1.0 - square[q][i] / sum[q][i]));
            let hit = [0, 1, 2, 3].map(|q| format!("{:.2}", inside[q][i]));
            println!("  {lead} s: stated {:.3} skill {} inside {}", 1.0 - ign[i], skill.join(" "), hit.join(" "));
        }
    }
}

#[test]
#[ignore = "figures"]
fn explore_calm() {
    let seas = env("SEAS", 60.0) as u64;
    for (h_s, t_p, gamma, s, sigma) in [(0.2, 1.5, 3.3, 10.0, 0.003), (0.3, 2.0, 1.0, 5.0, 0.005), (0.5, 4.0, 3.3, 10.0, 0.005)]
    {
        let spectrum = Jonswap::new(h_s, t_p, gamma).unwrap();
        let (mut offered, mut broken, mut with, mut random_broken, mut start, mut length, mut cut) = (0, 0, 0, 0, 0.0, 0.0, 0);
        let mut lead = [0; 6];
        for seed in 0..seas {
            let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
            let towards = random.random::<f64>() * TAU;
            let sea = sea(&spectrum, s, towards, 300, &mut random);
            let readings = readings(&sea, 1.0, 20.0, sigma, &mut random);
            let options = Options { readings_max: env("N", 320.0) as usize, ..Options::default() };
            let grid = Grid::about_peak(1.0 / t_p, 26.0, 5.6);
            let believed = Jonswap::new(h_s, t_p * env("TP", 1.0), gamma).unwrap();
            let turn = towards + env("TURN", 0.0).to_radians();
            let density = |f: f64, th: f64| believed.density_m2_per_hz(f) * CosTwoS::new(s).unwrap().density_per_rad(th - turn);
            let prior = if env("MODE", 0.0) > 0.0 {
                grid.tuned(density, &readings, 0.0, &options, &Search::near()).unwrap().prior
            } else {
                grid.directional(density).unwrap()
            };
            let forecast = Forecast::fit(&readings, &prior, 0.0, &options).unwrap();
            let own = prior.sea();
            let k = env("LIMIT", 1.3);
            let limits = Limits {
                crest_m: k * own.elevation_m2.sqrt(),
                slope: if env("SLOPE", 1.0) > 0.0 {
                    k * 1.4 * (own.slope_north + own.slope_east).sqrt()
                } else {
                    f64::INFINITY
                },
                vertical_speed_mps: k * own.vertical_speed_m2ps2.sqrt(),
            };
            let breaks = |from: f64, to: f64| {
                (0..=((to - from) / 0.02) as u32).any(|i| {
                    let [z, a, b, w] = truth(&sea, 0.2, -0.3, from + 0.02 * f64::from(i));
                    z > limits.crest_m || a.hypot(b) > limits.slope || w.abs() > limits.vertical_speed_mps
                })
            };
            let least = env("LEAST", 0.8);
            let windows = forecast.calm_windows(Spot { north_m: 0.2, east_m: -0.3 }, &limits, 0.0, 10.0, least);
            with += u32::from(!windows.is_empty());
            for w in windows {
                offered += 1;
                start += w.from_s;
                length += w.to_s - w.from_s;
                lead[(w.from_s as usize).min(5)] += 1;
                broken += u32::from(breaks(w.from_s, w.to_s));
                cut += u32::from(breaks(w.to_s - least, w.to_s));
                let from = 10.0 * random.random::<f64>();
                random_broken += u32::from(breaks(from, from + w.to_s - w.from_s));
            }
        }
        let n = f64::from(offered);
        println!(
            "T {t_p}: seas with {with}/{seas} offered {offered} broken {:.3} last part {:.3} random {:.3} mean start {:.2} length {:.2} by second {lead:?}",
            f64::from(broken) / n,
            f64::from(cut) / n,
            f64::from(random_broken) / n,
            start / n,
            length / n
        );
    }
}
