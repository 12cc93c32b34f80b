//! What a patch costs once the window is full: `cargo bench --profile dev --workspace --bench patch`.
//!
//! The profile is the one that `make run` uses, and time is the thread's own, so that whatever else runs on the machine counts little. The sea is a
//! wind sea under the default rig at 10 Hz, with noise, and with frames and cells missing. A patch that brings a sea state, as one in ten does, is to
//! take 1 ms at most. "One pass over the window" is what no way to assess a whole window can be below: its gauges' readings, added up once.

#![allow(missing_docs, reason = "criterion's macros make functions without any")]
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a bench that cannot run says why and ends, and shows its figures"
)]

use std::hint::black_box;
use std::time::Duration;

use cpu_time::ThreadTime;
use criterion::{Criterion, criterion_group, criterion_main};
use halcyon_model::{RigId, SurfacePatch};
use halcyon_wave_assessment::Config;
use halcyon_wave_assessment::core::Assessor;
use halcyon_wave_assessment::experiment::{Camera, Sea, System};

const RATE_HZ: f64 = 10.0;
/// Frames of the film; those of the first window are taken in before anything is measured.
const FRAMES: usize = 2400;
/// Readings of a patch: nine gauges, each the cell and two discs.
const READINGS: usize = 27;

/// As the default rig five metres over the water, with the cells that reconstruction makes by default.
fn film() -> Vec<SurfacePatch> {
    let camera = Camera {
        rows: 23,
        cols: 30,
        cell_m: 0.15,
        rate_hz: RATE_HZ,
        sigma_m: 0.003,
        level_sigma_m: 0.003,
        frames_lost: 0.05,
        cells_lost: 0.1,
    };
    camera.film(&Sea(vec![System::wind_sea(0.1, 1.3)]), FRAMES, &RigId::new(&Config::default().rig).unwrap(), 7)
}

/// Plays a film over and over to assessors whose window is full.
struct Player {
    film: Vec<SurfacePatch>,
    assessor: Assessor,
    next: usize,
}

impl Player {
    fn new() -> Self {
        let mut player = Self { film: film(), assessor: Assessor::new(Config::default()).unwrap(), next: 0 };
        player.begin();
        player
    }

    /// A new assessor with a full window.
    fn begin(&mut self) {
        self.assessor = Assessor::new(Config::default()).unwrap();
        let start = self.film[0].stamp;
        self.next = self.film.partition_point(|patch| patch.stamp.seconds_since(start) <= Config::default().window_s);
        for patch in &self.film[..self.next] {
            self.assessor.observe(patch, patch.stamp).unwrap();
        }
    }

    /// Takes in the next patch; how long that took, and whether a sea state came of it.
    fn step(&mut self) -> (Duration, bool) {
        if self.next == self.film.len() {
            self.begin();
        }
        let patch = &self.film[self.next];
        self.next += 1;
        let begun = ThreadTime::now();
        let state = self.assessor.observe(black_box(patch), patch.stamp).unwrap();
        (begun.elapsed(), black_box(state).is_some())
    }

    /// Time of so many patches that bring a sea state, or of those that do not.
    fn time(&mut self, count: u64, with_state: bool) -> Duration {
        let (mut spent, mut seen) = (Duration::ZERO, 0);
        while seen < count {
            let (took, is_state) = self.step();
            if is_state == with_state {
                (spent, seen) = (spent + took, seen + 1);
            }
        }
        spent
    }
}

fn patches(criterion: &mut Criterion) {
    let mut player = Player::new();
    let mut group = criterion.benchmark_group("a full minute at 10 Hz");
    group.bench_function("patch without a sea state", |bencher| bencher.iter_custom(|count| player.time(count, false)));
    group.bench_function("patch with a sea state", |bencher| bencher.iter_custom(|count| player.time(count, true)));
    let readings_m: Vec<f64> =
        (0..(Config::default().window_s * RATE_HZ) as usize * READINGS).map(|i| (i as f64).sin()).collect();
    group.bench_function("one pass over the window", |bencher| {
        bencher.iter_custom(|count| {
            let begun = ThreadTime::now();
            for _ in 0..count {
                black_box(black_box(&readings_m).iter().map(|z| z * z).sum::<f64>());
            }
            begun.elapsed()
        });
    });
    group.finish();
    let mut slowest = Duration::ZERO;
    for _ in 0..FRAMES {
        slowest = slowest.max(player.step().0);
    }
    println!("the slowest of {FRAMES} patches: {:.3} ms", 1e3 * slowest.as_secs_f64());
}

criterion_group!(benches, patches);
criterion_main!(benches);
