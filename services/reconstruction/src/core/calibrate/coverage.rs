//! Where in the picture corners were seen: distortion is only known there.

use super::sighting::{Side, Sighting};

/// Corners used, counted over a grid of fields of one camera's picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CoverageMap {
    /// Fields along a row.
    pub cols: usize,
    /// Fields along a column.
    pub rows: usize,
    /// Corners in each field, row-major from the top left.
    pub counts: Vec<u32>,
}

impl CoverageMap {
    const COLS: usize = 8;
    const ROWS: usize = 6;

    pub(super) fn new(sightings: &[Sighting], side: Side, (width_px, height_px): (u32, u32)) -> Self {
        let mut counts = vec![0; Self::COLS * Self::ROWS];
        // A pixel's centre is at whole numbers: the picture runs from −0.5 on.
        let field = |at_px: f64, px: u32, fields: usize| {
            (((at_px + 0.5) / f64::from(px) * fields as f64).max(0.0) as usize).min(fields - 1)
        };
        for sighting in sightings.iter().filter(|sighting| sighting.is_used()) {
            for corner in sighting.kept(side) {
                let pixel = sighting.pixel(side, corner);
                counts[field(pixel.y, height_px, Self::ROWS) * Self::COLS + field(pixel.x, width_px, Self::COLS)] += 1;
            }
        }
        Self { cols: Self::COLS, rows: Self::ROWS, counts }
    }

    /// Share of the fields in which a corner was seen.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.counts.iter().filter(|count| **count > 0).count() as f64 / self.counts.len() as f64
    }
}
