//! Features on real pictures: the aloe pair, and the aloe turned by known homographies.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "tests fail by panicking and print what they measured"
)]

mod support;

use std::time::Instant;

use halcyon_model::Image;
use halcyon_reconstruction::core::epipolar::{PointPair, RansacSettings, find_fundamental, rectify_from_matches};
use halcyon_reconstruction::core::features::{
    MatchRule, Method, StudySettings, detect, encode_png, match_features, match_pictures, study,
};
use halcyon_reconstruction::files::read_picture;
use nalgebra::{Matrix3, Rotation3, Vector2, Vector3};
use support::samples;

const WIDTH: u32 = 641;
const HEIGHT: u32 = 555;

/// The aloe at half its size: means of 2 × 2 pixels.
fn aloe(name: &str) -> Image {
    let full = read_picture(&samples().join(name)).unwrap();
    let stride = full.width_px() as usize;
    let pixels: Vec<u8> = (0..HEIGHT as usize)
        .flat_map(|y| (0..WIDTH as usize).map(move |x| (x, y)))
        .map(|(x, y)| {
            let at = |dx: usize, dy: usize| u32::from(full.pixels()[(2 * y + dy) * stride + 2 * x + dx]);
            ((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) / 4) as u8
        })
        .collect();
    Image::new(WIDTH, HEIGHT, pixels.into()).unwrap()
}

/// The picture as another camera sees it: pixel p of it is at `homography` p of the new one. Bilinear; black where there is nothing.
fn warp(image: &Image, homography: &Matrix3<f64>, gain: f64, lift: f64) -> Image {
    let back = homography.try_inverse().unwrap();
    let (width, height) = (image.width_px() as usize, image.height_px() as usize);
    let pixels: Vec<u8> = (0..width * height)
        .map(|at| {
            let from = moved(&back, &Vector2::new((at % width) as f64, (at / width) as f64));
            let (x, y) = (from.x.floor(), from.y.floor());
            if x < 0.0 || y < 0.0 || x >= width as f64 - 1.0 || y >= height as f64 - 1.0 {
                return 0;
            }
            let value = |dx: usize, dy: usize| f64::from(image.pixels()[(y as usize + dy) * width + x as usize + dx]);
            let (u, v) = (from.x - x, from.y - y);
            let mean =
                (value(0, 0) * (1.0 - u) + value(1, 0) * u) * (1.0 - v) + (value(0, 1) * (1.0 - u) + value(1, 1) * u) * v;
            (gain * mean + lift).round().clamp(0.0, 255.0) as u8
        })
        .collect();
    Image::new(image.width_px(), image.height_px(), pixels.into()).unwrap()
}

fn moved(homography: &Matrix3<f64>, point: &Vector2<f64>) -> Vector2<f64> {
    let there = homography * point.push(1.0);
    there.xy() / there.z
}

/// Turned about the middle, and enlarged.
fn turned(angle_deg: f64, scale: f64) -> Matrix3<f64> {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    let to = Matrix3::new(1.0, 0.0, 320.0, 0.0, 1.0, 277.0, 0.0, 0.0, 1.0);
    let turn = Matrix3::new(scale * cos, -scale * sin, 0.0, scale * sin, scale * cos, 0.0, 0.0, 0.0, 1.0);
    to * turn * to.try_inverse().unwrap()
}

/// What a camera of 700 px focal length sees after turning on the spot.
fn camera_turn(x_deg: f64, y_deg: f64, z_deg: f64) -> Matrix3<f64> {
    let k = Matrix3::new(700.0, 0.0, 320.0, 0.0, 700.0, 277.0, 0.0, 0.0, 1.0);
    let turn = Rotation3::new(Vector3::new(x_deg, y_deg, z_deg).map(f64::to_radians)).into_inner();
    k * turn * k.try_inverse().unwrap()
}

/// Share of the first picture's keypoints, of those that stay in view, that are found again within 2 px and a third of their size
/// (repeatability, Mikolajczyk et al. 2005), and share of the matches within 3 px of the truth.
fn quality(image: &Image, other: &Image, homography: &Matrix3<f64>, scale: f64, method: Method) -> (f64, f64, usize) {
    let (a, b) = (detect(image, method, 1000).unwrap(), detect(other, method, 1500).unwrap());
    let place = |k: &halcyon_reconstruction::core::features::Keypoint| Vector2::new(f64::from(k.x_px), f64::from(k.y_px));
    let (mut in_view, mut again) = (0.0, 0.0);
    for keypoint in &a.keypoints {
        let there = moved(homography, &place(keypoint));
        if there.x < 40.0 || there.y < 40.0 || there.x > f64::from(WIDTH) - 40.0 || there.y > f64::from(HEIGHT) - 40.0 {
            continue;
        }
        in_view += 1.0;
        let is_same = |k: &&halcyon_reconstruction::core::features::Keypoint| {
            let ratio = f64::from(k.size_px) / (scale * f64::from(keypoint.size_px));
            (place(k) - there).norm() < 2.0 * scale.max(1.0) && (0.67..1.5).contains(&ratio)
        };
        again += f64::from(u8::from(b.keypoints.iter().any(|k| is_same(&k))));
    }
    // The ratio of the paper (Bay et al. 2006, 5).
    let matches = match_features(&a, &b, &MatchRule { ratio_max: Some(0.7), is_mutual: true });
    let right = matches
        .iter()
        .filter(|m| (moved(homography, &place(&a.keypoints[m.left])) - place(&b.keypoints[m.right])).norm() < 3.0)
        .count();
    (again / in_view, right as f64 / matches.len() as f64, matches.len())
}

/// Under turns, scales, brightness and a slanted view SURF keeps up with SIFT.
#[test]
fn surf_finds_and_matches_again() {
    let image = aloe("aloeL.jpg");
    let cases = [
        ("as it is, darker", Matrix3::identity(), 1.0, 0.6, 20.0),
        ("turned 30°", turned(30.0, 1.0), 1.0, 1.0, 0.0),
        ("turned 135°", turned(135.0, 1.0), 1.0, 1.0, 0.0),
        ("0.7 times the size", turned(0.0, 0.7), 0.7, 1.0, 0.0),
        ("1.5 times the size, turned 10°, brighter", turned(10.0, 1.5), 1.5, 1.2, 10.0),
        ("camera turned", camera_turn(8.0, -12.0, 5.0), 1.0, 0.9, 5.0),
    ];
    for (what, homography, scale, gain, lift) in cases {
        let other = warp(&image, &homography, gain, lift);
        let start = Instant::now();
        let surf = quality(&image, &other, &homography, scale, Method::Surf);
        let middle = Instant::now();
        let sift = quality(&image, &other, &homography, scale, Method::Sift);
        println!("{what}: SURF {surf:.3?} in {:?}, SIFT {sift:.3?} in {:?}", middle - start, middle.elapsed());
        assert!(surf.1 >= 0.8, "{what}: {surf:?}");
        assert!(surf.1 >= sift.1 - 0.12, "{what}: SURF {surf:?}, SIFT {sift:?}");
        assert!(surf.0 >= 0.5 && surf.0 >= sift.0 - 0.15, "{what}: SURF {surf:?}, SIFT {sift:?}");
        assert!(surf.2 >= 100, "{what}: {surf:?}");
    }
}

/// The pair is rectified: whatever F is found must keep true matches, on the row and at the known disparity, on their lines.
#[test]
fn every_method_finds_the_geometry_of_a_pair() {
    let (left, right) = (aloe("aloeL.jpg"), aloe("aloeR.jpg"));
    for method in Method::ALL {
        let start = Instant::now();
        let study = study(&left, &right, method, &StudySettings::default(), &|pairs| pairs.to_vec()).unwrap();
        let counts = study.counts();
        let f = study.consensus.as_ref().unwrap().fundamental;
        let rows: Vec<f64> = (0..study.matches.len())
            .filter(|i| study.is_inlier(*i))
            .map(|i| study.points()[i])
            .map(|pair| (pair.left.y - pair.right.y).abs())
            .collect();
        let on_row = rows.iter().filter(|row| **row < 2.0).count() as f64 / rows.len() as f64;
        println!("{counts:?} in {:?}: {:.1} % on their row", start.elapsed(), 100.0 * on_row);
        assert!(counts.left > 300 && counts.right > 300 && counts.inliers <= counts.matches, "{counts:?}");
        assert!(counts.inliers > 100 && on_row > 0.95, "{counts:?} {on_row}");
        for (x, y, disparity) in [(200.0, 100.0, 60.0), (400.0, 450.0, 80.0), (600.0, 300.0, 40.0)] {
            let line = f * Vector3::new(x, y, 1.0);
            let off = (line.dot(&Vector3::new(x - disparity, y, 1.0)) / line.xy().norm()).abs();
            assert!(off < 1.5, "{method:?}: {off} px off at {x} {y}");
        }
        assert!(encode_png(&left, &right, &study).unwrap().starts_with(b"\x89PNG"));
    }
}

/// The pair with each camera turned on its own: rectified from its matches alone, the known disparities lie on rows again.
#[test]
fn hartleys_rectification_undoes_known_turns() {
    let truth = read_picture(&samples().join("aloeGT.png")).unwrap();
    let (to_left, to_right) = (camera_turn(3.0, 4.0, -4.0), camera_turn(-2.0, -3.0, 3.0));
    let (left, right) = (warp(&aloe("aloeL.jpg"), &to_left, 1.0, 0.0), warp(&aloe("aloeR.jpg"), &to_right, 0.95, 5.0));
    for method in [Method::Sift, Method::Surf] {
        let pairs = match_pictures(&left, &right, method, 2000, &MatchRule::default()).unwrap();
        let found = find_fundamental(&pairs, &RansacSettings::default()).unwrap();
        let inliers: Vec<PointPair> =
            pairs.iter().zip(&found.is_inlier).filter(|(_, inlier)| **inlier).map(|(pair, _)| *pair).collect();
        let homographies = rectify_from_matches(&found.fundamental, &inliers, (WIDTH, HEIGHT)).unwrap();
        let (mut sum, mut count, mut max) = (0.0, 0.0, 0.0_f64);
        for y in (20..1100).step_by(16) {
            for x in (250..1270).step_by(16) {
                let disparity = f64::from(truth.pixels()[y * truth.width_px() as usize + x]);
                if disparity == 0.0 {
                    continue;
                }
                // Full-size pixel u is (u + 1/2) / 2 − 1/2 of the half-size picture.
                let (u, v) = ((x as f64 + 0.5) / 2.0 - 0.5, (y as f64 + 0.5) / 2.0 - 0.5);
                let pair = PointPair {
                    left: moved(&to_left, &Vector2::new(u, v)),
                    right: moved(&to_right, &Vector2::new(u - disparity / 2.0, v)),
                };
                let there = homographies.apply(&pair);
                let off = there.left.y - there.right.y;
                sum += off * off;
                count += 1.0;
                max = max.max(off.abs());
            }
        }
        let rms = f64::sqrt(sum / count);
        println!("{method:?}: {} matches, {count} truths: rows off by {rms:.3} px RMS, {max:.2} px at most", found.inliers);
        assert!(count > 2000.0 && rms < 0.5 && max < 2.5, "{rms} {max}");
    }
}
