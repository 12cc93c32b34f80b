//! Against what is published and what is exact.

use super::hessian::Layer;
use super::*;

/// 128 plus Gaussian blobs: (x, y, standard deviation, height).
fn blobs(width: usize, height: usize, blobs: &[(f64, f64, f64, f64)]) -> Vec<u8> {
    (0..width * height)
        .map(|at| {
            let (x, y) = ((at % width) as f64, (at / width) as f64);
            let sum: f64 =
                blobs.iter().map(|(cx, cy, s, h)| h * (-((x - cx).powi(2) + (y - cy).powi(2)) / (2.0 * s * s)).exp()).sum();
            (128.0 + sum).round().clamp(0.0, 255.0) as u8
        })
        .collect()
}

fn detect_in(pixels: &[u8], width: usize, height: usize) -> Features {
    detect(pixels, width, height, &Settings::default())
}

/// A Gaussian blob of standard deviation s blurred by σ has a Hessian whose scale-normalised determinant, (σ² s² / (s² + σ²)²)²,
/// is largest at σ = s. So that is where and at what scale it must be found. (Below 2.4 px the maximum lies at the smallest filter,
/// which has no smaller one to be a maximum against.)
#[test]
fn blobs_are_found_in_place_and_scale() {
    for (x, y, s) in [(80.3, 77.6, 2.7), (81.0, 80.0, 3.5), (79.75, 80.5, 5.0), (100.4, 95.1, 9.0), (110.0, 112.7, 14.0)] {
        for height in [100.0, -100.0] {
            let features = detect_in(&blobs(220, 220, &[(x, y, s, height)]), 220, 220);
            let best = features.keypoints[0];
            let sigma = f64::from(best.size_px) * 1.2 / 9.0;
            assert!((f64::from(best.x_px) - x).abs() < 0.1 * s, "x {x} {s}: {best:?}");
            assert!((f64::from(best.y_px) - y).abs() < 0.1 * s, "y {y} {s}: {best:?}");
            println!("{s}: {sigma:.2}, off {:.3} {:.3}", f64::from(best.x_px) - x, f64::from(best.y_px) - y);
            // Three boxes answer strongest to a blob somewhat larger than the Gaussian that they stand for, alike at all scales.
            assert!((0.7..0.95).contains(&(sigma / s)), "{s}: {sigma}");
            // The Laplacian is positive in a dark blob.
            assert_eq!(best.is_dark, height < 0.0);
        }
    }
}

/// The exact determinant of the Hessian of a blurred Gaussian blob is known everywhere:
/// g(r) = A s²/v exp(−r²/2v), v = s² + σ², and det = (g/v)² (1 − r²/v). The boxes must follow it, times one constant for all scales,
/// to within an eighth of the peak or so: that is what cropping a Gaussian to three boxes costs.
#[test]
fn boxes_follow_exact_gaussian_derivatives() {
    let (side, centre) = (161, 80.0);
    let mut constants = Vec::new();
    for (filter, sigma) in [(9, 1.2), (15, 2.0), (21, 2.8), (27, 3.6), (39, 5.2), (51, 6.8)] {
        let s = 1.5 * sigma;
        let amplitude = 110.0;
        let pixels = blobs(side, side, &[(centre, centre, s, amplitude)]);
        let layer = Layer::new(&Integral::new(&pixels, side, side), filter, 1);
        let v = s * s + sigma * sigma;
        let exact = |r2: f64| {
            let g = amplitude * s * s / v * (-r2 / (2.0 * v)).exp();
            (g * sigma * sigma / v).powi(2) * (1.0 - r2 / v)
        };
        let at = |dx: usize, dy: usize| f64::from(layer.responses[(80 + dy) * layer.cols + 80 + dx]);
        let constant = at(0, 0) / exact(0.0);
        constants.push(constant);
        for (dx, dy) in [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (2.0, 0.0), (1.5, 1.5), (0.5, 2.0)] {
            let (dx, dy) = ((dx * sigma).round() as usize, (dy * sigma).round() as usize);
            let (boxes, truth) = (at(dx, dy) / constant, exact((dx * dx + dy * dy) as f64));
            assert!((boxes - truth).abs() < 0.14 * exact(0.0), "{filter} {dx} {dy}: {boxes} {truth}");
        }
    }
    let (low, high) = constants.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), c| (low.min(*c), high.max(*c)));
    assert!(high / low < 1.35, "one constant for all scales: {constants:?}");
}

/// The published balance: 0.9 is the ratio of Frobenius norms (Bay et al. 2008, eq. 3), |L_xy(1.2)| |D_xx(9)| / (|L_xx(1.2)| |D_xy(9)|).
#[test]
fn the_weight_of_the_mixed_derivative_is_the_published_one() {
    let s2 = 1.2_f64 * 1.2;
    let (mut xx, mut xy) = (0.0, 0.0);
    for y in -4..=4 {
        for x in -4..=4 {
            let (x, y) = (f64::from(x), f64::from(y));
            let g = (-(x * x + y * y) / (2.0 * s2)).exp();
            xx += ((x * x / s2 - 1.0) / s2 * g).powi(2);
            xy += (x * y / (s2 * s2) * g).powi(2);
        }
    }
    // Boxes of 9: two lobes of 15 ones, one of 15 minus-twos; four of 9 ones.
    let (box_xx, box_xy) = ((2.0_f64 * 15.0 + 15.0 * 4.0).sqrt(), 36.0_f64.sqrt());
    let weight = xy.sqrt() * box_xx / (xx.sqrt() * box_xy);
    assert!((weight - 0.912).abs() < 0.01, "{weight}");
}

#[test]
fn plain_steps_and_ramps_are_no_blobs() {
    let step: Vec<u8> = (0..120 * 120).map(|at| if at % 120 < 60 { 40 } else { 200 }).collect();
    assert_eq!(detect_in(&step, 120, 120).keypoints, []);
    let ramp: Vec<u8> = (0..120 * 120).map(|at| (at % 120 + at / 120) as u8).collect();
    assert_eq!(detect_in(&ramp, 120, 120).keypoints, []);
}

/// The orientation turns with the picture; the descriptor does not, nor does it mind brightness and contrast.
#[test]
fn descriptors_do_not_mind_turning_and_contrast() {
    let scene = |angle_deg: f64, gain: f64, lift: f64| {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        // A blob with two smaller ones beside it, which give it a direction.
        let around = [(0.0, 0.0, 4.0, 80.0), (9.0, 3.0, 4.0, 50.0), (-4.0, 10.0, 3.0, -45.0)];
        let turned: Vec<_> = around
            .iter()
            .map(|(x, y, s, h)| (80.0 + cos * x - sin * y, 80.0 + sin * x + cos * y, *s, gain * h + 0.0 * lift))
            .collect();
        let mut pixels = blobs(160, 160, &turned);
        for pixel in &mut pixels {
            *pixel = (f64::from(*pixel) + lift).clamp(0.0, 255.0) as u8;
        }
        pixels
    };
    let central = |features: &Features| {
        let index = features.keypoints.iter().position(|k| (k.x_px - 80.0).hypot(k.y_px - 80.0) < 2.0 && !k.is_dark).unwrap();
        let Descriptors::Float { values, .. } = &features.descriptors else { panic!("floats") };
        (features.keypoints[index], values[64 * index..][..64].to_vec())
    };
    let (keypoint, descriptor) = central(&detect_in(&scene(0.0, 1.0, 0.0), 160, 160));
    assert!((descriptor.iter().map(|v| v * v).sum::<f32>() - 1.0).abs() < 1e-5);
    for (angle_deg, gain, lift) in
        [(0.0, 0.5, 30.0), (30.0, 1.0, 0.0), (90.0, 1.0, -20.0), (155.0, 0.7, 0.0), (270.0, 1.0, 0.0)]
    {
        let (turned, other) = central(&detect_in(&scene(angle_deg, gain, lift), 160, 160));
        let turn_deg = f64::from(turned.angle_rad - keypoint.angle_rad).to_degrees();
        let off_deg = (turn_deg - angle_deg + 180.0).rem_euclid(360.0) - 180.0;
        assert!(off_deg.abs() < 8.0, "{angle_deg}: off by {off_deg}");
        let distance = descriptor.iter().zip(&other).map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt();
        assert!(distance < 0.2, "{angle_deg} {gain} {lift}: {distance}");
    }
}

/// Uprightness leaves the orientation out, and bounds are kept.
#[test]
fn settings_are_kept() {
    let many: Vec<_> = (0..16)
        .map(|i| (30.0 + 45.0 * f64::from(i % 4), 30.0 + 45.0 * f64::from(i / 4), 4.0, 60.0 + 3.0 * f64::from(i)))
        .collect();
    let pixels = blobs(200, 200, &many);
    let upright = detect(&pixels, 200, 200, &Settings { is_upright: true, keypoints_max: 5, ..Settings::default() });
    assert_eq!(upright.keypoints.len(), 5);
    assert!(upright.keypoints.iter().all(|keypoint| keypoint.angle_rad == 0.0));
    assert!(upright.keypoints.windows(2).all(|two| two[0].response >= two[1].response));
    let none = detect(&pixels, 200, 200, &Settings { response_min: 1e9, ..Settings::default() });
    assert_eq!(none.keypoints, []);
    // Smaller than the largest filters, and smaller than the smallest.
    for side in [8, 9, 30, 60] {
        detect(&pixels[..side * side], side, side, &Settings::default());
    }
}
