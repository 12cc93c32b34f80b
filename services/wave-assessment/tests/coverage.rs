//! The reported intervals hold the truth as often as they say, over many random seas.

mod support;

use halcyon_model::Estimate;
use halcyon_wave_assessment::Config;
use halcyon_wave_assessment::core::Assessor;
use support::{Camera, Sea};

/// True H_m, H_s and T_z of the point elevation, from an hour and a half of it: counted here, without the estimator's code.
struct Truth {
    h_mean_m: f64,
    h_s_m: f64,
    h_m0_m: f64,
    t_z_s: f64,
}

fn truth(h_m0_m: f64, t_p_s: f64) -> Truth {
    let (mut heights, mut periods) = (Vec::new(), Vec::new());
    for seed in 0..20 {
        let sea = Sea::jonswap(h_m0_m, t_p_s, 1_000_000 + seed);
        let dt_s = t_p_s / 30.0;
        let mut turning: Vec<(f64, f64, f64, f64)> = sea
            .0
            .iter()
            .map(|c| {
                let (sin, cos) = (c.radps * dt_s).sin_cos();
                (c.re_m, c.im_m, cos, sin)
            })
            .collect();
        let (mut before, mut crest, mut trough, mut began) = (0.0, 0.0_f64, 0.0_f64, None);
        for i in 0..6000 {
            let z: f64 = turning
                .iter_mut()
                .map(|(re, im, cos, sin)| {
                    (*re, *im) = (*re * *cos - *im * *sin, *re * *sin + *im * *cos);
                    *re
                })
                .sum();
            if before < 0.0 && z >= 0.0 {
                let at_s = (f64::from(i) - z / (z - before)) * dt_s;
                if let Some(began_s) = began {
                    heights.push(crest - trough);
                    periods.push(at_s - began_s);
                }
                (began, crest, trough) = (Some(at_s), 0.0, 0.0);
            }
            (crest, trough, before) = (crest.max(z), trough.min(z), z);
        }
    }
    heights.sort_by(|a, b| b.total_cmp(a));
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    Truth {
        h_mean_m: mean(&heights),
        h_s_m: mean(&heights[..heights.len() / 3]),
        h_m0_m: Sea::h_m0_m(h_m0_m, t_p_s),
        t_z_s: mean(&periods),
    }
}

/// Share of `seeds` seas whose interval, after `patches` patches, holds the truth: (H_m, H_s, H_m0, T_z).
fn check(h_m0_m: f64, t_p_s: f64, camera: &Camera, patches: usize, seeds: u64) {
    let truth = truth(h_m0_m, t_p_s);
    let mut held = [0_u32; 4];
    let mut sides = [[0_u32; 2]; 4];
    let mut width = 0.0;
    for seed in 0..seeds {
        let film = Camera { seed, ..camera.clone() }.film(&Sea::jonswap(h_m0_m, t_p_s, seed), patches);
        let mut assessor = Assessor::new(Config::default()).unwrap();
        let found = film.iter().filter_map(|p| assessor.observe(p, p.stamp).unwrap()).last().unwrap();
        let pairs: [(Option<Estimate>, f64); 4] = [
            (found.h_mean_m, truth.h_mean_m),
            (found.h_s_m, truth.h_s_m),
            (found.h_m0_m, truth.h_m0_m),
            (found.t_z_s, truth.t_z_s),
        ];
        for (i, (estimate, truth)) in pairs.into_iter().enumerate() {
            let e = estimate.unwrap();
            held[i] += u32::from(e.low <= truth && truth <= e.high);
            sides[i][0] += u32::from(truth < e.low);
            sides[i][1] += u32::from(truth > e.high);
        }
        let h_s = found.h_s_m.unwrap();
        width += (h_s.high - h_s.low) / h_s.value / seeds as f64;
    }
    let shares = held.map(|n| f64::from(n) / seeds as f64);
    println!("H_m, H_s, H_m0, T_z held {shares:.2?}, missed (above, below) {sides:?}; H_s interval {:.0} % wide", width * 100.0);
    assert!(shares.iter().all(|share| *share >= 0.88), "{shares:?}");
    // An interval that always holds the truth because it is endless is no measurement.
    assert!(width < 0.9, "{width}");
}

#[test]
fn a_minute_of_a_small_lake() {
    check(0.05, 1.3, &Camera::default(), 301, 120);
}

#[test]
fn half_a_minute_of_it() {
    check(0.05, 1.3, &Camera::default(), 151, 120);
}

#[test]
fn a_noisy_minute_of_longer_waves() {
    check(0.10, 2.2, &Camera { sigma_m: 0.006, level_sigma_m: Some(0.006), ..Camera::default() }, 301, 100);
}
