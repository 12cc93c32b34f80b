//! Scratch: compares sgm with OpenCV's 3WAY.
use halcyon_model::Image;
use halcyon_reconstruction::core::disparity::Disparity;
use halcyon_reconstruction::core::disparity::score::score;
use halcyon_reconstruction::core::matcher::{DisparityRange, Engine, match_images};
use halcyon_reconstruction::core::sgm::*;
use halcyon_reconstruction::files::read_picture;
use opencv::core::{Mat, Rect, Size};
use opencv::imgproc;
use opencv::prelude::*;
use std::time::Instant;

fn resized(image: &Image, width: u32, height: u32) -> Image {
    let from = Mat::from_slice(image.pixels()).unwrap();
    let from = from.reshape(1, image.height_px() as i32).unwrap();
    let mut to = Mat::default();
    imgproc::resize(&from, &mut to, Size::new(width as i32, height as i32), 0.0, 0.0, imgproc::INTER_AREA).unwrap();
    Image::new(width, height, to.data_bytes().unwrap().to_vec().into()).unwrap()
}
fn median(mut v: Vec<f64>) -> f64 {
    v.sort_by(f64::total_cmp);
    v[v.len() / 2]
}
fn view(i: &Image) -> View<'_> {
    View { pixels: i.pixels(), width: i.width_px() as usize, height: i.height_px() as usize, stride: i.width_px() as usize }
}
fn base() -> Settings {
    Settings {
        paths: Paths::Four,
        census: Census::Five,
        p1: 4,
        p2: 24,
        uniqueness_percent: 10,
        left_right_max_px: Some(1),
        speckle_area_max: 50,
        speckle_step_max_px: 2.0,
        simd: Simd::best(),
        overlap_rows: 8,
    }
}
fn speed(l: &Image, r: &Image, count: u32, threads: usize) {
    opencv::core::set_num_threads(threads as i32).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let range = DisparityRange { min_px: 0, max_px: count - 1 };
    let mut m = Engine::from_str_("sgbm-3way").matcher(5);
    let mut out = vec![0f32; l.pixels().len()];
    let mut cv = vec![];
    let mut variants: Vec<(String, SemiGlobal, Vec<f64>)> = vec![];
    for simd in Simd::ALL.into_iter().filter(|s| s.is_available()) {
        for paths in [Paths::Four, Paths::Eight] {
            for census in [Census::Five, Census::NineSymmetric] {
                variants.push((
                    format!("{simd:?} {paths:?} {census:?}"),
                    SemiGlobal::new(Settings { simd, paths, census, ..base() }),
                    vec![],
                ));
            }
        }
    }
    for round in 0..12 {
        let t = Instant::now();
        let _ = match_images(m.as_mut(), l, r, range).unwrap();
        let e = t.elapsed().as_secs_f64() * 1e3;
        if round > 1 {
            cv.push(e)
        }
        for (_, s, times) in &mut variants {
            let t = Instant::now();
            pool.install(|| s.compute(view(l), view(r), 0, count, &mut out)).unwrap();
            let e = t.elapsed().as_secs_f64() * 1e3;
            if round > 1 {
                times.push(e)
            }
        }
    }
    let cv = median(cv);
    println!("{}x{}x{count} threads {threads}: 3way {cv:.2} ms", l.width_px(), l.height_px());
    for (n, s, t) in variants {
        let t = median(t);
        println!("   {n}: {t:.2} ms ratio {:.3}, {:.1} MB", t / cv, s.memory_bytes() as f64 / 1e6);
    }
}
trait F {
    fn from_str_(s: &str) -> Engine;
}
impl F for Engine {
    fn from_str_(s: &str) -> Engine {
        s.parse().unwrap()
    }
}
fn small(left: &Image, truth: &Image, k: u32) -> (Image, Disparity) {
    let (w, h) = (left.width_px() / k, left.height_px() / k);
    let from = Mat::from_slice(left.pixels()).unwrap();
    let from = from.reshape(1, left.height_px() as i32).unwrap();
    let whole = Mat::roi(&from, Rect::new(0, 0, (k * w) as i32, (k * h) as i32)).unwrap();
    let mut to = Mat::default();
    imgproc::resize(&whole, &mut to, Size::new(w as i32, h as i32), 0.0, 0.0, imgproc::INTER_AREA).unwrap();
    let img = Image::new(w, h, to.data_bytes().unwrap().to_vec().into()).unwrap();
    let lv = |x: u32, y: u32| truth.pixels()[((k * y + k / 2) * truth.width_px() + k * x + k / 2) as usize];
    let v = (0..w * h)
        .map(|i| match lv(i % w, i / w) {
            0 => f32::NAN,
            l => f32::from(l) / k as f32,
        })
        .collect();
    (img, Disparity { width_px: w, height_px: h, values_px: v })
}
fn occlude(t: &mut Disparity) {
    let w = t.width_px as usize;
    for row in t.values_px.chunks_exact_mut(w) {
        let mut right = vec![f32::NEG_INFINITY; w];
        for (x, d) in row.iter().enumerate() {
            let at = x as f32 - d.round();
            if at >= 0.0 {
                let r = &mut right[at as usize];
                *r = r.max(*d);
            }
        }
        for x in 0..w {
            let d = row[x];
            let at = x as f32 - d.round();
            if !(at >= 0.0) || right[at as usize] - d > 1.0 {
                row[x] = f32::NAN;
            }
        }
    }
}
fn quality() {
    let read = |name: &str| read_picture(&std::path::PathBuf::from("samples").join(name)).unwrap();
    let (l, r, t) = (read("aloeL.jpg"), read("aloeR.jpg"), read("aloeGT.png"));
    for k in [1u32, 2, 3] {
        let (left, mut truth) = small(&l, &t, k);
        let (right, _) = small(&r, &t, k);
        occlude(&mut truth);
        let count = (224 / k).div_ceil(16) * 16;
        let show = |name: &str, d: &Disparity| {
            let s = score(d, &truth).unwrap();
            println!(
                "{k} {name}: density {:.2} bad1 {:.2} bad2 {:.2} mean {:.3}",
                s.density * 100.,
                s.bad1 * 100.,
                s.bad2 * 100.,
                s.mean_error_px
            );
        };
        let mut m = Engine::from_str_("sgbm-3way").matcher(5);
        show("3way", &match_images(m.as_mut(), &left, &right, DisparityRange { min_px: 0, max_px: count - 1 }).unwrap());
        for paths in [Paths::Four, Paths::Eight] {
            for (census, ps) in [
                (Census::Five, [(3, 16), (4, 24), (6, 32)]),
                (Census::NineSymmetric, [(4, 20), (5, 30), (8, 40)]),
                (Census::Seven, [(6, 32), (8, 48), (12, 64)]),
            ] {
                for (p1, p2) in ps {
                    let mut out = Disparity {
                        width_px: left.width_px(),
                        height_px: left.height_px(),
                        values_px: vec![0.0; left.pixels().len()],
                    };
                    SemiGlobal::new(Settings { paths, census, p1, p2, ..base() })
                        .compute(view(&left), view(&right), 0, count, &mut out.values_px)
                        .unwrap();
                    show(&format!("{paths:?} {census:?} {p1} {p2}"), &out);
                }
            }
        }
    }
}
fn main() {
    let read = |name: &str| read_picture(&std::path::PathBuf::from("samples").join(name)).unwrap();
    let (l, r) = (read("aloeL.jpg"), read("aloeR.jpg"));
    if std::env::args().nth(1).as_deref() == Some("q") {
        quality();
        return;
    }
    for threads in [1, 2] {
        speed(&resized(&l, 640, 480), &resized(&r, 640, 480), 64, threads);
        speed(&resized(&l, 1920, 1080), &resized(&r, 1920, 1080), 128, threads);
    }
}
