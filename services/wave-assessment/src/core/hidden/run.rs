//! Values of an unbroken row of frames, by frequency and back.

use std::sync::Arc;

use halcyon_ocean::filter::Mirrored;
use halcyon_ocean::spline::Places;
use halcyon_ocean::{Knots, Record, Spline};

use crate::core::series::despike;

/// Fewer samples in a row than this cannot be filtered.
const SAMPLES_MIN: usize = 16;

/// An unbroken row of frames, and the even instants over it.
pub(super) struct Run {
    /// Their places in the window.
    pub(super) frames: Vec<usize>,
    interval_s: f64,
    /// The frames' own instants, and where the even ones lie between them …
    uneven: Arc<Knots>,
    evenly: Places,
    /// … the even instants, and where the frames' own lie between those.
    even: Arc<Knots>,
    unevenly: Places,
}

impl Run {
    /// `None` for one that is too short.
    pub(super) fn new(points: &[(usize, f64)], interval_s: f64) -> Option<Self> {
        let times_s: Vec<f64> = points.iter().map(|(_, t)| *t).collect();
        let (start_s, end_s) = (*times_s.first()?, *times_s.last()?);
        let samples = ((end_s - start_s) / interval_s).floor() as usize + 1;
        if samples < SAMPLES_MIN {
            return None;
        }
        let even_s: Vec<f64> = (0..samples).map(|i| start_s + i as f64 * interval_s).collect();
        let (uneven, even) = (Knots::new(times_s).ok()?, Knots::new(even_s).ok()?);
        let (evenly, unevenly) = (uneven.places(even.at().iter().copied()), even.places(uneven.at().iter().copied()));
        let (uneven, even) = (Arc::new(uneven), Arc::new(even));
        let frames = points.iter().map(|(i, _)| *i).collect();
        Some(Self { frames, interval_s, uneven, evenly, even, unevenly })
    }

    /// One value for each frame, without spikes, at even instants, by frequency; `None` if that is no record.
    pub(super) fn even(&self, mut values: Vec<f64>) -> Option<Mirrored> {
        despike(&mut values, &mut []);
        let even = Spline::over(&self.uneven, values).ok()?.read(&self.evenly);
        Some(Mirrored::of(&Record::new(even, 1.0 / self.interval_s).ok()?))
    }

    /// From even instants back to the frames' own.
    pub(super) fn back(&self, even: Vec<f64>) -> Option<Vec<f64>> {
        Some(Spline::over(&self.even, even).ok()?.read(&self.unevenly))
    }
}
