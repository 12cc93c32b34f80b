//! What each step of the chain takes: `cargo run -p halcyon --example stages -- 640 480`.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example for developers")]
use halcyon::accuracy::{Scene, thesis_rig};
use halcyon_reconstruction::cli::{Threads, spent};
use halcyon_reconstruction::core::disparity::Disparity;
use halcyon_reconstruction::core::matcher::{DisparityRange, Engine};
use halcyon_reconstruction::core::peer::OpenCvChain;
use halcyon_reconstruction::core::plane::DisparityPlane;
use halcyon_reconstruction::core::reconstruct::{Reconstructor, Settings};
use halcyon_reconstruction::core::rectify::Rectifier;
use halcyon_reconstruction::core::refine::{Every, Refined, Refiner};
use halcyon_sim::rig::RigConfig;
use halcyon_sim::sea::SeaConfig;
use nalgebra::{UnitQuaternion, Vector3};

fn main() {
    let numbers: Vec<u32> = std::env::args().skip(1).map(|n| n.parse().unwrap()).collect();
    let (width_px, height_px) = (numbers[0], numbers[1]);
    let scale = f64::from(width_px) / 640.0;
    let rig = RigConfig { width_px, height_px, ..thesis_rig(0.092, scale) };
    let mut scene = Scene::new(&rig, &SeaConfig::regular(0.04, 0.8, 270.0), 0.0035 / scale, 5).unwrap();
    let at_m = Vector3::new(0.0, 0.0, -0.99);
    let pair = scene.pair(0.3, at_m, &UnitQuaternion::identity(), None).unwrap();
    let range = DisparityRange { min_px: 0, max_px: (96.0 * scale) as u32 - 1 };
    for threads in [1, 2] {
        let pool = Threads::new(threads).unwrap();
        pool.run(|| {
            let mut rectifier = Rectifier::new(&pair.calibration).unwrap();
            let mut matcher = Engine::Guided.matcher(9);
            let mut refiner = Refiner::new(11, 2, Every::SecondPixel);
            let mut chain = Reconstructor::new(Settings { cell_m: 0.04, fixed_rig: true, range, ..Settings::default() });
            let mut disparity = Disparity::default();
            let mut refined = Refined::default();
            let mut times = vec![Vec::new(); 5];
            let mut peer = OpenCvChain::new(&pair.calibration, range, 5).unwrap();
            for _ in 0..40 {
                times[0].push(spent(|| rectifier.rectify(&pair.left, &pair.right).unwrap()).1.wall_ms);
                let (l, r) = rectifier.grey();
                matcher.guide(Some(DisparityPlane::level((47.4 * scale) as f32)));
                times[1].push(spent(|| matcher.compute(l, r, range, &mut disparity).unwrap()).1.wall_ms);
                let (l, r) = rectifier.exact();
                times[2].push(spent(|| refiner.refine(l, r, &disparity, &mut refined).unwrap()).1.wall_ms);
                times[3].push(spent(|| chain.reconstruct(&pair).unwrap()).1.wall_ms);
                if times[4].len() < 10 {
                    times[4].push(spent(|| peer.points(&pair.left, &pair.right).unwrap()).1.wall_ms);
                }
            }
            println!(
                "{threads} threads, guided {}: rectify {:.2}, match {:.2}, refine {:.2}, all {:.2} ms, of OpenCV's {:.2} ({:.1} x); {} MiB",
                matcher.was_guided(),
                least(&times[0]),
                least(&times[1]),
                least(&times[2]),
                least(&times[3]),
                least(&times[4]),
                least(&times[4]) / least(&times[3]),
                chain.memory_bytes() >> 20
            );
        })
        .unwrap();
    }
}

fn least(times_ms: &[f64]) -> f64 {
    times_ms.iter().copied().fold(f64::INFINITY, f64::min)
}
