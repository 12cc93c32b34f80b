//! The reported intervals hold the truth as often as they say, over many random seas.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may fail, and shows its figures")]

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

/// What became of one number's intervals over many seas.
#[derive(Debug, Default)]
struct Tally {
    seas: u32,
    too_high: u32,
    too_low: u32,
    /// Sums of value, of its square, and of the interval's width, all over the truth.
    sums: [f64; 3],
}

impl Tally {
    fn add(&mut self, estimate: Option<Estimate>, truth: f64) {
        let e = estimate.unwrap();
        self.seas += 1;
        self.too_high += u32::from(e.low > truth);
        self.too_low += u32::from(e.high < truth);
        let value = e.value / truth;
        for (sum, x) in self.sums.iter_mut().zip([value, value * value, (e.high - e.low) / truth]) {
            *sum += x;
        }
    }

    #[track_caller]
    fn check(&self, what: &str) {
        let n = f64::from(self.seas);
        let [mean, square, width] = self.sums.map(|sum| sum / n);
        let held = 1.0 - f64::from(self.too_high + self.too_low) / n;
        let scatter = (square - mean * mean).sqrt();
        println!(
            "{what}: held {held:.2} (too high {}, too low {}); mean {mean:.3}, scatter {scatter:.3}, width {width:.2}",
            self.too_high, self.too_low
        );
        assert!(held >= 0.88, "{what} holds the truth in {held:.2} of the seas");
        // Always holding the truth by being endless is no measurement.
        assert!(width < 0.9, "{what} is {width:.2} wide");
        assert!((mean - 1.0).abs() < 0.08, "{what} is {mean:.3} of the truth on average");
    }
}

/// Films `seeds` seas and checks the intervals after each of `seconds`.
fn check(h_m0_m: f64, t_p_s: f64, camera: &Camera, seconds: &[usize], seeds: u64) {
    let truth = truth(h_m0_m, t_p_s);
    let mut tallies: Vec<[Tally; 4]> = seconds.iter().map(|_| Default::default()).collect();
    let count = seconds.iter().max().unwrap() * camera.rate_hz as usize + 1;
    for seed in 0..seeds {
        let film = Camera { seed, ..camera.clone() }.film(&Sea::jonswap(h_m0_m, t_p_s, seed), count);
        let mut assessor = Assessor::new(Config::default()).unwrap();
        let states: Vec<_> = film.iter().filter_map(|p| assessor.observe(p, p.stamp).unwrap()).collect();
        for (second, tally) in seconds.iter().zip(&mut tallies) {
            let found = &states[*second];
            tally[0].add(found.h_mean_m, truth.h_mean_m);
            tally[1].add(found.h_s_m, truth.h_s_m);
            tally[2].add(found.h_m0_m, truth.h_m0_m);
            tally[3].add(found.t_z_s, truth.t_z_s);
        }
    }
    for (second, tally) in seconds.iter().zip(&tallies) {
        for (what, tally) in ["H_m", "H_s", "H_m0", "T_z"].iter().zip(tally) {
            tally.check(&format!("{what} after {second} s"));
        }
    }
}

#[test]
fn a_small_lake() {
    check(0.05, 1.3, &Camera::default(), &[30, 60], 100);
}

#[test]
fn longer_waves_and_more_noise() {
    check(0.10, 2.2, &Camera { sigma_m: 0.006, level_sigma_m: Some(0.006), ..Camera::default() }, &[60], 60);
}
