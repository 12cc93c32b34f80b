//! Readings of elevation, and which of them are used where there are too many.

use super::fit::Options;

/// One reading of elevation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Where, metres north of any fixed point.
    pub north_m: f64,
    /// Where, metres east of it.
    pub east_m: f64,
    /// When, seconds of the clock that `now_s` is of.
    pub t_s: f64,
    /// Elevation, metres, positive up.
    pub elevation_m: f64,
    /// Its standard error, metres.
    pub sigma_m: f64,
    /// Readings of the same number share a level (and tilt) where these are free: a number for each frame of each patch.
    pub group: u32,
}

impl Reading {
    /// Whether it says anything: finite, with an error above 0, and taken within the `span_s` seconds up to `now_s`.
    pub(super) fn is_usable(&self, now_s: f64, span_s: f64) -> bool {
        let sane = [self.north_m, self.east_m, self.elevation_m].iter().all(|x| x.abs() < 1e9);
        let age_s = now_s - self.t_s;
        sane && self.sigma_m > 0.0 && self.sigma_m < 1e9 && age_s >= 0.0 && age_s <= span_s
    }
}

/// Those of `readings` that are usable, thinned to the bounds of `options`.
pub(super) fn chosen(readings: &[Reading], now_s: f64, options: &Options) -> Vec<Reading> {
    let usable = readings.iter().filter(|r| r.is_usable(now_s, options.span_s)).copied().collect();
    let dense_s = if options.dense_s > 0.0 { options.dense_s } else { 1e-3 };
    thin(usable, now_s, options.readings_max.max(1), options.per_frame_max, dense_s)
}

/// At most `readings_max` of `readings`, which are usable ones: `per_frame` well apart of each frame (a group at one time), and frames that
/// lie the closer the younger they are, since what has been seen long ago has mostly left the place. Frame spacing grows with age a as a + `dense_s`.
fn thin(mut readings: Vec<Reading>, now_s: f64, readings_max: usize, per_frame: usize, dense_s: f64) -> Vec<Reading> {
    if readings.len() <= readings_max {
        return readings;
    }
    readings.sort_by(|a, b| b.t_s.total_cmp(&a.t_s).then(a.group.cmp(&b.group)));
    let frames: Vec<&[Reading]> = readings.chunk_by(|a, b| a.t_s == b.t_s && a.group == b.group).collect();
    let largest = frames.iter().map(|f| f.len()).max().unwrap_or(1).min(per_frame.max(1));
    let frames_max = (readings_max / largest).max(1);
    let mut kept = Vec::with_capacity(readings_max);
    for (turn, frame) in spaced(&frames, now_s, frames_max, dense_s).into_iter().enumerate() {
        scattered(frame, largest.min(readings_max - kept.len()), turn, &mut kept);
    }
    kept
}

/// At most `frames_max` of `frames`, youngest first, evenly in ln(age + `dense_s`).
fn spaced<'a>(frames: &[&'a [Reading]], now_s: f64, frames_max: usize, dense_s: f64) -> Vec<&'a [Reading]> {
    if frames.len() <= frames_max {
        return frames.to_vec();
    }
    let place = |frame: &[Reading]| (now_s - frame.first().map_or(now_s, |r| r.t_s) + dense_s).ln();
    let (Some(first), Some(last)) = (frames.first(), frames.last()) else { return Vec::new() };
    let (from, to) = (place(first), place(last));
    let mut chosen = Vec::with_capacity(frames_max);
    let mut next = 0;
    for i in 0..frames_max {
        // Where frames are sparser than wanted each is taken in turn, and the wish list is made anew for those left.
        let left = frames_max - i;
        let Some(frame) = frames.get(next) else { break };
        chosen.push(*frame);
        let here = place(frame).max(from);
        let step = if left > 1 { (to - here) / (left - 1) as f64 } else { 0.0 };
        next += 1;
        while next + left - 1 < frames.len() && place(frames[next]) < here + step - 1e-9 {
            next += 1;
        }
    }
    chosen
}

/// Adds `count` readings of `frame` that lie far apart, beginning elsewhere each `turn`: each next is the farthest from those taken.
fn scattered(frame: &[Reading], count: usize, turn: usize, kept: &mut Vec<Reading>) {
    if frame.len() <= count {
        kept.extend_from_slice(frame);
        return;
    }
    let mut gap_m2 = vec![f64::INFINITY; frame.len()];
    // Steps of a number prime to most sizes visit all readings in the long run.
    let mut next = turn * 7 % frame.len();
    for _ in 0..count {
        let taken = frame[next];
        kept.push(taken);
        let mut farthest = (next, -1.0);
        for (i, (reading, gap)) in frame.iter().zip(&mut gap_m2).enumerate() {
            *gap = gap.min((reading.north_m - taken.north_m).powi(2) + (reading.east_m - taken.east_m).powi(2));
            if *gap > farthest.1 {
                farthest = (i, *gap);
            }
        }
        next = farthest.0;
    }
}
