//! The dispersion filter: what lies on the shell ω = √(g k tanh kh) + k·U of a film's spectrum is waves, the rest is noise, harmonics and
//! reflections (Young, Rosenthal and Ziemer 1985; Nieto Borge et al. 2004, for films of marine radars).

use std::f64::consts::TAU;

use super::water::Water;
use super::welch3::Spectrum3;

/// How far off the dispersion relation a cell may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shell {
    /// The water.
    pub water: Water,
    /// Cells to either side, in wavenumber and in frequency. Hann's taper puts all but a thousandth of a wave within 2 of it.
    pub half_width_cells: f64,
    /// Whether the mean variance of a cell off the shell, taken for white noise, is taken off those on it.
    pub less_noise: bool,
}

impl Shell {
    /// Two cells to either side, noise left in.
    #[must_use]
    pub fn new(water: Water) -> Self {
        Self { water, half_width_cells: 2.0, less_noise: false }
    }
}

/// What the filter found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnShell {
    /// Variance on the shell, m², noise taken off where that was asked for.
    pub on_m2: f64,
    /// Variance off it, m².
    pub off_m2: f64,
    /// Share of the variance on it, 0 to 1; 0 for a still sea.
    pub energy_share: f64,
    /// Share of the cells on it: white noise has that share of its energy there.
    pub cells_share: f64,
}

impl Spectrum3 {
    /// This spectrum with nothing left off the shell, and what share of it was on it. A film that is short against its waves has a coarse
    /// grid of wavenumbers and so a thick shell, which keeps nearly all.
    #[must_use]
    pub fn on_shell(mut self, shell: &Shell) -> (Self, OnShell) {
        let n = self.segment_frames;
        let domega = TAU * self.df_hz();
        let width = shell.half_width_cells.max(0.0);
        let [dk_north, dk_east] = self.dk_radpm();
        let (dk, domega) = (width * dk_north.max(dk_east), width * domega);
        let to_index = n as f64 / (TAU * self.rate_hz);
        let highest = self.frequencies();
        // Bins of the positive frequencies of waves from a direction, first to last; none as (1, 0).
        let band = |k: f64, from_rad: f64| -> (usize, usize) {
            let along = shell.water.along_mps(from_rad);
            let at = |k: f64| crate::dispersion::angular_frequency_radps(k.max(0.0), shell.water.depth) + k.max(0.0) * along;
            let (one, other) = (at(k - dk), at(k + dk));
            // Against a current the highest frequency may lie between the two.
            let (low, high) = (one.min(other), one.max(other).max(at(k)));
            let first = ((low - domega) * to_index).ceil().max(1.0);
            let last = ((high + domega) * to_index).floor().min(highest as f64);
            if last >= first { (first as usize, last as usize) } else { (1, 0) }
        };
        let (mut on, mut off) = (Tally::default(), Tally::default());
        let bands: Vec<Option<[(usize, usize); 2]>> = self
            .grid()
            .map(|k| {
                let [north, east] = k?;
                let (k, from_rad) = (north.hypot(east), east.atan2(north));
                // Of negative frequency, waves come from the opposite.
                Some([band(k, from_rad), band(k, from_rad + std::f64::consts::PI)])
            })
            .collect();
        for (variances, bands) in self.variance_m2.chunks_exact_mut(n).zip(&bands) {
            let Some(bands) = bands else {
                variances.fill(0.0);
                continue;
            };
            for m in 1..=highest {
                for (place, (first, last)) in [m, n - m].into_iter().zip(bands) {
                    if (*first..=*last).contains(&m) {
                        on.add(variances[place]);
                    } else {
                        off.add(variances[place]);
                        variances[place] = 0.0;
                    }
                }
            }
            variances[0] = 0.0;
            if n.is_multiple_of(2) {
                variances[n / 2] = 0.0;
            }
        }
        let total = on.variance_m2 + off.variance_m2;
        let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
        let (energy_share, cells_share) = (share(on.variance_m2, total), share(on.cells, on.cells + off.cells));
        if shell.less_noise && off.cells > 0.0 {
            let noise_m2 = off.variance_m2 / off.cells;
            for (variances, bands) in self.variance_m2.chunks_exact_mut(n).zip(&bands) {
                let Some([ahead, behind]) = bands else { continue };
                (ahead.0..=ahead.1).for_each(|m| variances[m] -= noise_m2 as f32);
                (behind.0..=behind.1).for_each(|m| variances[n - m] -= noise_m2 as f32);
            }
            on.variance_m2 -= noise_m2 * on.cells;
        }
        (self, OnShell { on_m2: on.variance_m2, off_m2: off.variance_m2, energy_share, cells_share })
    }
}

#[derive(Default)]
struct Tally {
    variance_m2: f64,
    cells: f64,
}

impl Tally {
    fn add(&mut self, variance_m2: f32) {
        self.variance_m2 += f64::from(variance_m2);
        self.cells += 1.0;
    }
}
