//! Phase-space despiking of evenly sampled readings.
//!
//! A record and its first two differences, drawn against each other, fill an ellipsoid; a spike lies outside it (Goring & Nikora,
//! *J. Hydraul. Eng.* 128, 2002). Its axes are λ σ of each, with the expected highest of n normal values λ = √(2 ln n); it is turned in the plane
//! of value and second difference. Two corrections: a true ellipsoid in place of three projections (Mori, Suzuki & Kakuno, *J. Eng. Mech.*
//! 133, 2007), and medians in place of means and deviations, which the spikes themselves inflate (Wahl, *J. Hydraul. Eng.*
//! 129, 2003). Spikes are replaced by a cubic spline through what is left, and the whole is repeated until none is found. Of
//! neighbours outside, only the furthest is replaced in one round: a spike bends the differences beside it, and good readings would go with it.
//!
//! A wave of few samples has large differences of its own: below about six samples a wave the ellipsoid is nearly a sphere and only the height
//! of a spike counts.

use super::repair::Repaired;
use crate::spline::Spline;

/// Which form of the method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variant {
    /// Goring & Nikora 2002: means, standard deviations, three ellipses.
    GoringNikora,
    /// Mori et al. 2007: means, standard deviations, one ellipsoid.
    Mori,
    /// Wahl 2003 with Mori's ellipsoid: medians and median absolute deviations. The one to use.
    Wahl,
}

/// How often the search is repeated at most; each round ends sooner where no new spike is found.
pub const ROUNDS_MAX: usize = 20;

/// Finds and replaces spikes. Missing readings (not finite) are replaced too and reported with the rest.
///
/// Needs eight finite readings; returns fewer as they are. At most [`ROUNDS_MAX`] rounds of linear cost.
#[must_use]
pub fn despike(samples_m: &[f64], variant: Variant) -> Repaired {
    const SAMPLES_MIN: usize = 8;
    // Squares of larger magnitudes overflow, as in a record.
    let mut bad: Vec<bool> = samples_m.iter().map(|x| !x.is_finite() || x.abs() > 1e100).collect();
    if bad.iter().filter(|bad| !**bad).count() < SAMPLES_MIN {
        return Repaired { samples_m: samples_m.to_vec(), changes: Vec::new() };
    }
    let Some(mut mended) = bridged(samples_m, &bad) else {
        return Repaired { samples_m: samples_m.to_vec(), changes: Vec::new() };
    };
    for _ in 0..ROUNDS_MAX {
        let distance = distances(&mended, variant);
        let outside: Vec<usize> = (0..bad.len()).filter(|i| distance[*i] > 1.0 && !bad[*i]).collect();
        // The differences of a spike reach two samples to either side, and it stands out most itself.
        let runs = outside.chunk_by(|a, b| b - a <= 2);
        let worst = runs.filter_map(|run| run.iter().copied().max_by(|a, b| distance[*a].total_cmp(&distance[*b])));
        worst.for_each(|i| bad[i] = true);
        if outside.is_empty() || bad.iter().filter(|bad| !**bad).count() < SAMPLES_MIN {
            break;
        }
        match bridged(samples_m, &bad) {
            Some(next) => mended = next,
            None => break,
        }
    }
    let indices: Vec<usize> = (0..bad.len()).filter(|i| bad[*i]).collect();
    Repaired::of(samples_m, mended, &indices)
}

/// The samples with those that are `bad` taken from a spline through the others; beyond the outermost good one its value.
fn bridged(samples_m: &[f64], bad: &[bool]) -> Option<Vec<f64>> {
    let good: Vec<usize> = (0..samples_m.len()).filter(|i| !bad[*i]).collect();
    let (first, last) = (*good.first()?, *good.last()?);
    let curve = Spline::new(good.iter().map(|i| *i as f64).collect(), good.iter().map(|i| samples_m[*i]).collect()).ok()?;
    let inside = curve.sampled(first as f64, 1.0, last - first + 1);
    let at = |i: usize| match i {
        i if !bad[i] => samples_m[i],
        i if i < first => samples_m[first],
        i if i > last => samples_m[last],
        i => inside[i - first],
    };
    Some((0..samples_m.len()).map(at).collect())
}

/// Squared distance of each sample from the centre, in half axes: more than 1 is outside.
fn distances(samples_m: &[f64], variant: Variant) -> Vec<f64> {
    let n = samples_m.len();
    let centre_m = match variant {
        Variant::Wahl => median(samples_m.to_vec()),
        _ => samples_m.iter().sum::<f64>() / n as f64,
    };
    let value: Vec<f64> = samples_m.iter().map(|x| x - centre_m).collect();
    let first = difference(&value);
    let second = difference(&first);
    let scale = |x: &[f64]| match variant {
        // 1.483 makes the median absolute deviation a normal variable's standard deviation.
        Variant::Wahl => 1.483 * median(x.iter().map(|x| x.abs()).collect()),
        _ => (x.iter().map(|x| x * x).sum::<f64>() / n as f64).sqrt(),
    };
    let lambda = (2.0 * (n as f64).ln()).sqrt();
    let [a, b, c] = [&value, &first, &second].map(|x| lambda * scale(x));
    let smallest = 1e-12 * value.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    // Half the readings alike: a scale of zero says nothing.
    if !(a > smallest && b > smallest && c > smallest) {
        return vec![0.0; n];
    }
    // Spikes turn the ellipse as well; the robust form leaves them out of its angle.
    let counts = |x: f64, z: f64| variant != Variant::Wahl || (x.abs() <= a && z.abs() <= c);
    let pairs = || value.iter().zip(&second).filter(|(x, z)| counts(**x, **z));
    let theta_rad = pairs().map(|(x, z)| x * z).sum::<f64>().atan2(pairs().map(|(x, _)| x * x).sum());
    let (sin, cos) = theta_rad.sin_cos();
    let (major, minor) = axes(a, c, sin, cos);
    (0..n)
        .map(|i| {
            let (x, y, z) = (value[i], first[i], second[i]);
            let (along, across) = (x * cos + z * sin, z * cos - x * sin);
            let turned = (along / major).powi(2) + (across / minor).powi(2);
            let (flat, steep) = ((x / a).powi(2), (y / b).powi(2));
            match variant {
                Variant::GoringNikora => turned.max(flat + steep).max(steep + (z / c).powi(2)),
                Variant::Mori | Variant::Wahl => turned + steep,
            }
        })
        .collect()
}

/// Half axes of the turned ellipse whose projections on the axes are `a` and `c`: Goring & Nikora's (10) and (11),
/// a² = A² cos² + B² sin², c² = A² sin² + B² cos².
fn axes(a: f64, c: f64, sin: f64, cos: f64) -> (f64, f64) {
    let (sin2, cos2) = (sin * sin, cos * cos);
    let determinant = cos2 * cos2 - sin2 * sin2;
    let major2 = (a * a * cos2 - c * c * sin2) / determinant;
    let minor2 = (c * c * cos2 - a * a * sin2) / determinant;
    // Turned by 45°, or further than its projections allow: the unturned ellipse is as good as any.
    if major2 > 0.0 && minor2 > 0.0 && major2.is_finite() && minor2.is_finite() {
        (major2.sqrt(), minor2.sqrt())
    } else {
        (a, c)
    }
}

/// Goring & Nikora's differences: half of next less previous; at the ends zero.
fn difference(x: &[f64]) -> Vec<f64> {
    let inner = |i: usize| match (i.checked_sub(1), x.get(i + 1)) {
        (Some(before), Some(after)) => 0.5 * (after - x[before]),
        _ => 0.0,
    };
    (0..x.len()).map(inner).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

#[cfg(test)]
mod tests {
    use super::super::sampling::tests::sea;
    use super::*;

    /// By hand: A² cos² + B² sin² and A² sin² + B² cos² of A = 3, B = 1, 0.3 rad.
    #[test]
    fn the_axes_are_those_of_the_turned_ellipse() {
        let (sin, cos) = 0.3_f64.sin_cos();
        let a = (9.0 * cos * cos + sin * sin).sqrt();
        let c = (9.0 * sin * sin + cos * cos).sqrt();
        let (major, minor) = axes(a, c, sin, cos);
        assert!((major - 3.0).abs() < 1e-12 && (minor - 1.0).abs() < 1e-12);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        assert_eq!(axes(2.0, 2.0, half, half), (2.0, 2.0));
    }

    /// Forty spikes of half a metre to a metre in a sea of 0.3 m at 10 Hz.
    fn spiked() -> (Vec<f64>, Vec<f64>, Vec<usize>) {
        let clean = sea(0.3, 2.5, 10.0, 6000).samples_m().to_vec();
        let places: Vec<usize> = (0..40).map(|i| 50 + i * 147).collect();
        let mut dirty = clean.clone();
        for (k, i) in places.iter().enumerate() {
            dirty[*i] += if k % 2 == 0 { 0.5 } else { -1.0 } * (0.8 + 0.01 * k as f64);
        }
        (clean, dirty, places)
    }

    #[test]
    fn every_spike_is_found_and_nearly_nothing_else() {
        let (clean, dirty, places) = spiked();
        for variant in [Variant::GoringNikora, Variant::Mori, Variant::Wahl] {
            let found = despike(&dirty, variant);
            let indices: Vec<usize> = found.changes.iter().map(|c| c.index).collect();
            assert!(places.iter().all(|i| indices.contains(i)), "{variant:?}");
            assert!(indices.len() <= places.len() + 12, "{variant:?}: {} changed", indices.len());
            let worst = found.samples_m.iter().zip(&clean).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 0.03, "{variant:?}: {worst}");
            for change in &found.changes {
                assert_eq!(change.before_m, dirty[change.index]);
                assert_eq!(change.after_m, found.samples_m[change.index]);
            }
        }
    }

    /// Mori's ellipsoid lies within the three projections: it can only find more. And on clean water it takes next to nothing: λ is made so that
    /// of n normal values about one is outside.
    #[test]
    fn a_clean_sea_is_left_alone() {
        let clean = sea(0.3, 2.5, 10.0, 6000).samples_m().to_vec();
        for variant in [Variant::GoringNikora, Variant::Mori, Variant::Wahl] {
            let changed = despike(&clean, variant).changes.len();
            assert!(changed <= 12, "{variant:?}: {changed} of 6000");
        }
    }

    /// Spikes everywhere hide each other from standard deviations, not from medians (Wahl's point).
    #[test]
    fn medians_see_what_deviations_do_not() {
        let clean = sea(0.3, 2.5, 10.0, 6000).samples_m().to_vec();
        let mut dirty = clean.clone();
        for (k, i) in (5..6000).step_by(12).enumerate() {
            dirty[i] += if k % 2 == 0 { 0.45 } else { -0.45 };
        }
        let rms = |x: &[f64]| (x.iter().zip(&clean).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / 6000.0).sqrt();
        let wahl = rms(&despike(&dirty, Variant::Wahl).samples_m);
        let mori = rms(&despike(&dirty, Variant::Mori).samples_m);
        assert!(wahl < 0.01, "{wahl}");
        assert!(wahl < mori, "{wahl} {mori}");
    }

    #[test]
    fn anything_is_survived() {
        for samples in [
            vec![],
            vec![1.0; 5],
            vec![2.0; 100],
            vec![f64::NAN; 50],
            (0..50).map(|i| if i == 20 { f64::INFINITY } else { f64::from(i % 7) }).collect(),
            (0..50).map(|i| if i < 30 { f64::NAN } else { f64::from(i % 5) * 1e99 }).collect(),
        ] {
            let found = despike(&samples, Variant::Wahl);
            assert_eq!(found.samples_m.len(), samples.len());
        }
        let mut missing: Vec<f64> = (0..50).map(|i| (f64::from(i) * 0.4).sin()).collect();
        missing[0] = f64::NAN;
        missing[20] = f64::NAN;
        let found = despike(&missing, Variant::Wahl);
        assert!(found.samples_m.iter().all(|x| x.is_finite()));
        assert!((found.samples_m[20] - 8f64.sin()).abs() < 0.02);
        assert_eq!(found.changes.len(), 2);
    }
}
