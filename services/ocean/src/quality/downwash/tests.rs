//! Rings and seas rendered by closed form, with the truth known.

use super::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const COLUMNS: usize = 140;
const ROWS: usize = 110;
const CELL_M: f64 = 0.02;

/// Rings of wavelength `length_m` about a point, damped as 1/√r, at `t_s`; `way` 1 outwards, −1 inwards.
fn ring_m(x_m: f64, y_m: f64, below_m: [f64; 2], length_m: f64, height_m: f64, way: f64, t_s: f64) -> f64 {
    let r_m = (x_m - below_m[0]).hypot(y_m - below_m[1]);
    let phase = TAU * (r_m / length_m - way * ripple_frequency_hz(length_m) * t_s);
    height_m * (0.3 / r_m.max(0.05)).sqrt() * phase.cos()
}

/// A short sea of lengths from 0.1 to 1.5 m within 40° of one direction, of about `sigma_m` in all; at `t_s`.
struct Sea(Vec<[f64; 5]>);

impl Sea {
    fn new(sigma_m: f64, lengths_m: RangeInclusive<f64>, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let main = TAU * random.random::<f64>();
        let waves = (0..40).map(|_| {
            let length_m = random.random_range(lengths_m.clone());
            let (k, towards) = (TAU / length_m, main + random.random_range(-0.7..0.7));
            let omega = TAU * ripple_frequency_hz(length_m);
            [sigma_m * (2.0f64 / 40.0).sqrt(), k * towards.cos(), k * towards.sin(), omega, TAU * random.random::<f64>()]
        });
        Self(waves.collect())
    }

    fn at(&self, x_m: f64, y_m: f64, t_s: f64) -> f64 {
        self.0.iter().map(|[a, kx, ky, w, p]| a * (kx * x_m + ky * y_m - w * t_s + p).cos()).sum()
    }
}

fn rendered(surface: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let at = |place: usize| surface((place % COLUMNS) as f64 * CELL_M, (place / COLUMNS) as f64 * CELL_M);
    (0..COLUMNS * ROWS).map(at).collect()
}

fn grid(elevation_m: &[f64]) -> ElevationGrid<'_> {
    ElevationGrid { elevation_m, columns: COLUMNS, cell_m: CELL_M }
}

fn one(elevation_m: &[f64], below_m: [f64; 2]) -> Downwash {
    detect(&[grid(elevation_m)], f64::NAN, below_m, &DownwashLimits::default()).unwrap()
}

fn variance(cells: &[f64]) -> f64 {
    cells.iter().map(|z| z * z).sum::<f64>() / cells.len() as f64
}

const MIDDLE_M: [f64; 2] = [1.4, 1.1];

/// Lamb: waves of 1.73 cm are slowest, 0.231 m/s, where tension and gravity are equal.
#[test]
fn ripples_have_their_dispersion() {
    assert!((ripple_frequency_hz(0.0173) * 0.0173 - 0.231).abs() < 1e-3);
    assert!((ripple_frequency_hz(0.05) - 5.9).abs() < 0.05 && (ripple_frequency_hz(0.4) - 1.98).abs() < 0.02);
}

#[test]
fn rings_alone_are_all_rings() {
    for length_m in [0.08, 0.15, 0.3] {
        let found = one(&rendered(|x, y| 0.01 * x - 0.02 * y + ring_m(x, y, MIDDLE_M, length_m, 0.01, 1.0, 0.0)), MIDDLE_M);
        assert!(found.ring_share > 0.93 && found.ring_share < 1.02, "{length_m}: {}", found.finding.reason);
        assert_eq!(found.finding.flag, Flag::Fail, "{}", found.finding.reason);
        assert!(found.masked_share > 0.95, "{}", found.masked_share);
    }
}

/// Twenty seas from everywhere, the point in the middle and off to a side: none is taken for rings.
#[test]
fn a_sea_alone_has_none() {
    let mut worst = 0.0_f64;
    for seed in 0..20 {
        let sea = Sea::new(0.02, 0.1..=1.5, seed);
        let surface = rendered(|x, y| sea.at(x, y, 0.0));
        for below_m in [MIDDLE_M, [0.7, 0.6]] {
            let found = one(&surface, below_m);
            assert_eq!(found.finding.flag, Flag::Pass, "{seed}: {}", found.finding.reason);
            assert!(!found.mask.iter().any(|m| *m));
            worst = worst.max(found.ring_share.abs());
        }
    }
    assert!(worst < 0.25, "{worst}");
}

/// Rings beside a sea of the same wavelengths: the share is that of their variances, within its own standard error.
#[test]
fn rings_beside_a_sea_have_their_share() {
    let mut off = Vec::new();
    for seed in 0..12 {
        let sea = Sea::new(0.006, 0.1..=0.35, 100 + seed);
        let rings = rendered(|x, y| ring_m(x, y, MIDDLE_M, 0.17, 0.012, 1.0, 0.0));
        let waves = rendered(|x, y| sea.at(x, y, 0.0));
        let both: Vec<f64> = rings.iter().zip(&waves).map(|(a, b)| a + b).collect();
        let found = one(&both, MIDDLE_M);
        let truth = variance(&rings) / (variance(&rings) + variance(&waves));
        assert!((found.ring_share - truth).abs() < 0.12, "{seed}: {} for {truth}", found.ring_share);
        assert_ne!(found.finding.flag, Flag::Pass, "{}", found.finding.reason);
        off.push((found.ring_share - truth) / found.ring_share_sigma);
    }
    let rms = (off.iter().map(|x| x * x).sum::<f64>() / off.len() as f64).sqrt();
    assert!((0.3..2.5).contains(&rms), "errors are {rms} standard errors: {off:?}");
}

/// Rings that a long swell carries: of all the variance they are little, and the flag only suspects; near the point they are masked, far away not.
#[test]
fn rings_on_a_swell_are_masked_where_they_are() {
    let sea = Sea::new(0.004, 0.1..=0.35, 7);
    let surface = rendered(|x, y| {
        let r_m = (x - MIDDLE_M[0]).hypot(y - MIDDLE_M[1]);
        let rings = ring_m(x, y, MIDDLE_M, 0.12, 0.015, 1.0, 0.0) * (-r_m / 0.35).exp();
        0.05 * (TAU * x / 4.0 + 0.3).sin() + sea.at(x, y, 0.0) + rings
    });
    let found = one(&surface, MIDDLE_M);
    assert_eq!(found.finding.flag, Flag::Suspect, "{}", found.finding.reason);
    assert!(found.ring_share_of_all < 0.1);
    let masked = |x_m: f64, y_m: f64| found.mask[(y_m / CELL_M) as usize * COLUMNS + (x_m / CELL_M) as usize];
    assert!(masked(1.4, 1.1) && masked(1.7, 1.1) && masked(1.4, 0.8), "{:?}", found.bins);
    assert!(!masked(0.1, 0.1) && !masked(2.6, 2.0), "{:?}", found.bins);
}

/// A sequence at 20 Hz says which way they run; at 5 Hz it cannot.
#[test]
fn a_sequence_tells_which_way_rings_run() {
    let sea = Sea::new(0.004, 0.1..=0.35, 9);
    for way in [1.0, -1.0] {
        let frames: Vec<Vec<f64>> = (0..6)
            .map(|i| f64::from(i) * 0.05)
            .map(|t| rendered(|x, y| sea.at(x, y, t) + ring_m(x, y, MIDDLE_M, 0.15, 0.012, way, t)))
            .collect();
        let grids: Vec<ElevationGrid<'_>> = frames.iter().map(|f| grid(f)).collect();
        let found = detect(&grids, 0.05, MIDDLE_M, &DownwashLimits::default()).unwrap();
        let outward = found.outward.unwrap();
        // sin(2π 3.3 Hz × 0.05 s) = 0.86 of them.
        assert!(way * outward > 0.6 && way * outward < 1.1, "{outward}");
        assert_eq!(found.finding.reason.contains("running outwards"), way > 0.0);
        assert_eq!(detect(&grids, 0.2, MIDDLE_M, &DownwashLimits::default()).unwrap().outward, None);
    }
}

#[test]
fn holes_do_not_matter_much() {
    let sea = Sea::new(0.004, 0.1..=0.35, 3);
    let mut surface = rendered(|x, y| 0.1 * x + sea.at(x, y, 0.0) + ring_m(x, y, MIDDLE_M, 0.17, 0.012, 1.0, 0.0));
    let whole = one(&surface, MIDDLE_M);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..60 {
        let (column, row) = (random.random_range(0..COLUMNS - 8), random.random_range(0..ROWS - 8));
        (0..8).for_each(|i| surface[(row + i) * COLUMNS + column..][..8].fill(f64::NAN));
    }
    let holed = one(&surface, MIDDLE_M);
    assert!((holed.ring_share - whole.ring_share).abs() < 0.15, "{} {}", holed.ring_share, whole.ring_share);
    assert_eq!(holed.finding.flag, whole.finding.flag);
}

#[test]
fn from_one_side_nothing_can_be_said() {
    let surface = rendered(|x, y| ring_m(x, y, [60.0, 1.0], 0.15, 0.05, 1.0, 0.0));
    assert_eq!(one(&surface, [60.0, 1.0]).finding.flag, Flag::NotEvaluated);
    assert_eq!(one(&rendered(|_, _| 0.0), MIDDLE_M).finding.flag, Flag::NotEvaluated, "still water");
}

#[test]
fn what_cannot_be_judged_is_refused_by_name() {
    let surface = rendered(|x, _| x.sin());
    let limits = DownwashLimits::default();
    let with = |grid: ElevationGrid<'_>, below_m: [f64; 2]| detect(&[grid], f64::NAN, below_m, &limits).unwrap_err();
    let good = grid(&surface);
    assert!(matches!(detect(&[], 0.1, MIDDLE_M, &limits), Err(DownwashError::Frames { .. })));
    assert!(matches!(detect(&vec![good; 257], 0.1, MIDDLE_M, &limits), Err(DownwashError::Frames { .. })));
    for columns in [0, 1, 137, usize::MAX] {
        assert!(matches!(with(ElevationGrid { columns, ..good }, MIDDLE_M), DownwashError::Shape { .. }));
    }
    for cell_m in [0.0, -1.0, f64::NAN, f64::INFINITY, 0.2] {
        assert!(matches!(with(ElevationGrid { cell_m, ..good }, MIDDLE_M), DownwashError::Cell { .. }), "{cell_m}");
    }
    assert!(matches!(with(good, [f64::NAN, 0.0]), DownwashError::Point { .. }));
    let empty = vec![f64::NAN; surface.len()];
    assert!(matches!(with(grid(&empty), MIDDLE_M), DownwashError::Empty { .. }));
    let other = ElevationGrid { elevation_m: &surface[..COLUMNS * 60], ..good };
    assert!(matches!(detect(&[good, other], 0.1, MIDDLE_M, &limits), Err(DownwashError::Shape { frame: 1, .. })));
    assert!(detect(&[good], 0.1, [1e300, -1e300], &limits).is_ok());
}
