//! The measurement chain, step by step: `make bench`, or `cargo bench --profile dev --workspace --bench chain`.
//!
//! Engines beside OpenCV's, in turns and with ratios, is what `halcyon bench` prints; this one watches a single step from change to
//! change.

#![allow(missing_docs, reason = "criterion's macros make functions without any")]
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a bench that cannot run says why and ends")]

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use halcyon::accuracy::{Scene, thesis_rig};
use halcyon::speed::shifted_pair;
use halcyon_reconstruction::core::matcher::{DisparityRange, Engine, match_images};
use halcyon_reconstruction::core::reconstruct::{Reconstructor, Settings};
use halcyon_reconstruction::core::rectify::Rectifier;
use halcyon_sim::sea::SeaConfig;
use nalgebra::{UnitQuaternion, Vector3};

fn scene(scale: f64) -> Scene {
    let sea = SeaConfig::regular(0.04, 0.8, 270.0);
    Scene::new(&thesis_rig(0.092, scale), &sea, 0.0035 / scale, 5).expect("the scene can be rendered")
}

fn chain(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("pair to patch");
    for scale in [0.5, 1.0, 2.0] {
        let mut scene = scene(scale);
        let at_m = Vector3::new(0.0, 0.0, -0.99);
        let pairs: Vec<_> =
            (0..6).map(|i| scene.pair(0.3 * f64::from(i), at_m, &UnitQuaternion::identity(), None).unwrap()).collect();
        let size = format!("{}x{}", pairs[0].left.width_px(), pairs[0].left.height_px());
        let range = DisparityRange { min_px: 0, max_px: (96.0 * scale) as u32 - 1 };
        let mut chain = Reconstructor::new(Settings { cell_m: 0.04, fixed_rig: true, range, ..Settings::default() });
        let mut next = pairs.iter().cycle();
        group.throughput(Throughput::Elements(u64::from(pairs[0].left.width_px() * pairs[0].left.height_px())));
        group.bench_function(BenchmarkId::from_parameter(&size), |bencher| {
            bencher.iter(|| chain.reconstruct(next.next().unwrap()).unwrap());
        });
        let mut rectifier = Rectifier::new(&pairs[0].calibration).unwrap();
        group.bench_function(BenchmarkId::new("rectify", &size), |bencher| {
            bencher.iter(|| rectifier.rectify(&pairs[0].left, &pairs[0].right).unwrap());
        });
    }
    group.finish();
}

fn engines(criterion: &mut Criterion) {
    let (left, right) = shifted_pair(20.3, 3).unwrap();
    let mut group = criterion.benchmark_group("match 320x240, 48 disparities");
    for engine in Engine::ALL {
        let mut matcher = engine.matcher(engine.block_px_default());
        let range = DisparityRange { min_px: 0, max_px: 47 };
        group.bench_function(engine.name(), |bencher| {
            bencher.iter(|| match_images(matcher.as_mut(), &left, &right, range).unwrap());
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(3));
    targets = chain, engines
}
criterion_main!(benches);
