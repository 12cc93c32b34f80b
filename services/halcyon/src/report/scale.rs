//! What every chart has in common: ranges, colours, axis labels.

use plotters::style::RGBColor;

/// Colours that stay apart for colour-blind readers and in grey print (Okabe and Ito 2008).
pub(super) const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(60, 60, 60),
];

/// Colour of series or bar number `index`.
pub(super) fn colour(index: usize) -> RGBColor {
    COLOURS[index % COLOURS.len()]
}

/// Least and largest of the finite values, with a little room; `None` where there is none.
pub(super) fn range(values: impl Iterator<Item = f64>, from_zero: bool) -> Option<(f64, f64)> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in values.filter(|value| value.is_finite()) {
        (low, high) = (low.min(value), high.max(value));
    }
    if low > high {
        return None;
    }
    if from_zero {
        (low, high) = (low.min(0.0), high.max(0.0));
    }
    // A flat line gets a range of its own size, or of 1 about zero.
    let span = if high > low { high - low } else { low.abs().max(1.0) };
    let room = 0.05 * span;
    Some((if from_zero && low == 0.0 { 0.0 } else { low - room }, high + room))
}

/// A number for an axis: four significant digits at most, and no more than it needs.
pub(super) fn label(value: f64) -> String {
    let size = value.abs();
    if size < 1e-12 {
        // What is left of a tick at zero.
        return "0".into();
    }
    if !(1e-3..1e5).contains(&size) {
        return format!("{value:.1e}");
    }
    let decimals = (3 - size.log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

/// A number for an axis that spans `span`: enough digits that neighbouring ticks differ.
pub(super) fn label_in(value: f64, span: f64) -> String {
    let plain = label(value);
    let is_small = value.abs() < 1e-3 * span;
    // Ticks are a tenth of the span apart, or a twentieth.
    let decimals = (1.4 - span.log10()).ceil();
    if is_small || !(1e-3..1e5).contains(&value.abs()) || !(1.0..=9.0).contains(&decimals) {
        return plain;
    }
    let text = format!("{value:.0$}", decimals as usize);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text.len() > plain.len() { text.into() } else { plain }
}

/// Viridis by a polynomial fit to its published table, `share` 0 to 1: dark is low, and equal steps look equal.
pub(super) fn viridis(share: f64) -> RGBColor {
    let t = share.clamp(0.0, 1.0);
    let channel = |c: [f64; 7]| {
        let value = c.iter().rev().fold(0.0, |sum, c| sum * t + c);
        (255.0 * value.clamp(0.0, 1.0)).round() as u8
    };
    RGBColor(
        channel([0.277_727, 0.105_093, -0.330_861, -4.634_231, 6.228_270, 4.776_385, -5.435_456]),
        channel([0.005_407, 1.404_613, 0.214_848, -5.799_101, 14.179_933, -13.745_145, 4.645_853]),
        channel([0.334_100, 1.384_590, 0.095_095, -19.332_441, 56.690_553, -65.353_034, 26.312_435]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_leave_room_and_survive_nonsense() {
        assert_eq!(range([f64::NAN, f64::INFINITY].into_iter(), false), None);
        assert_eq!(range([0.0, 10.0].into_iter(), true), Some((0.0, 10.5)));
        let (low, high) = range([3.0, 3.0].into_iter(), false).unwrap();
        assert!(low < 3.0 && high > 3.0);
    }

    #[test]
    fn labels_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.25, "0.25"),
            (12.0, "12"),
            (-0.5, "-0.5"),
            (2.5e-6, "2.5e-6"),
            (1e6, "1.0e6"),
            (31.622_8, "31.62"),
            (-2e-16, "0"),
            (100.0, "100"),
        ] {
            assert_eq!(label(value), text);
        }
    }

    #[test]
    fn neighbouring_ticks_differ_however_narrow_the_axis() {
        for (low, span) in [(0.4998, 0.0004), (0.5, 2e-6), (12.0, 0.01), (-1.0, 2.0), (0.0, 1e-5), (99_000.0, 500.0)] {
            let labels: Vec<String> = (0..=10).map(|i| label_in(low + f64::from(i) * 0.1 * span, span)).collect();
            assert!(labels.windows(2).all(|pair| pair[0] != pair[1]), "{labels:?}");
        }
        assert_eq!(label_in(0.25, 1.0), "0.25");
    }

    /// The ends and the middle of matplotlib's table.
    #[test]
    fn viridis_is_viridis() {
        for (share, (r, g, b)) in [(0.0, (68, 1, 84)), (0.5, (33, 145, 140)), (1.0, (253, 231, 37))] {
            let RGBColor(red, green, blue) = viridis(share);
            for (got, expected) in [(red, r), (green, g), (blue, b)] {
                assert!((i32::from(got) - expected).abs() <= 6, "{share}: {red} {green} {blue}");
            }
        }
    }
}
