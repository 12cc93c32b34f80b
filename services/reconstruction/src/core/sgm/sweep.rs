//! Costs summed along paths (Hirschmüller 2008, thesis 4-16), one column after the other:
//!
//! L(p, d) = C(p, d) + min(L(q, d), L(q, d ± 1) + P1, min L(q, ·) + P2) − min L(q, ·),
//!
//! where q is the pixel before p on the path. A sweep to the right carries the paths that come from the left (level, from above,
//! from below), one to the left those from the right. All of them step from one column to the next, so that the rows of a column
//! do not depend on each other and 64 of them are worked on at once.

use std::cell::Cell;

use super::census::hamming;
use super::lanes::{LANES, Lanes, all, load, store};

/// What a step of disparity costs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Penalties {
    /// By one.
    pub(super) p1: u8,
    /// By more.
    pub(super) p2: u8,
}

/// Paths that are carried together: as many as the registers hold.
pub(super) const PATHS: usize = 2;

/// How many rows further down the next column's pixel of each path lies: level and the falling diagonal; for eight paths also the
/// rising diagonal and a steep line. A sweep back walks the same lines the other way round.
const fn slopes(group: usize, back: bool) -> [isize; PATHS] {
    let [a, b] = if group == 0 { [0, 1] } else { [-1, 2] };
    if back { [-a, -b] } else { [a, b] }
}

/// Path costs of the column before, in place of which those of the next are written.
///
/// They are stored where the next column reads them: a path that falls by a row stores row 5 where row 6 is read. A path that
/// enters the strip finds zeros there, and so begins with the cost of its first pixel.
#[derive(Debug, Clone, Default)]
pub(super) struct Front {
    /// `count` disparities of 64 rows, with 64 bytes before and after for what is shifted out.
    bytes: Vec<u8>,
    /// The least of each row, in the middle of three.
    least: Vec<u8>,
}

impl Front {
    /// Paths that have not begun.
    pub(super) fn reset(&mut self, count: usize) {
        self.bytes.clear();
        self.bytes.resize((count + 1) * LANES, 0);
        // Beyond the last disparity nothing is cheap.
        self.bytes.resize((count + 2) * LANES, u8::MAX);
        self.least.clear();
        self.least.resize(3 * LANES, 0);
    }

    /// Becomes a copy of `other`, without allocation where it has been as large before.
    #[inline(always)]
    pub(super) fn copy_from(&mut self, other: &Self) {
        self.bytes.clone_from(&other.bytes);
        self.least.clone_from(&other.least);
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.bytes.capacity() + self.least.capacity()
    }
}

/// Only carry the paths on.
pub(super) const CARRY: u8 = 0;
/// Carry, and begin the sums.
pub(super) const BEGIN: u8 = 1;
/// Carry, and add to the sums.
pub(super) const ADD: u8 = 2;

/// The columns that are compared.
#[derive(Clone, Copy)]
pub(super) struct Columns<'a, const BYTES: usize> {
    /// Census of the left picture, all columns.
    pub(super) left: &'a [[Lanes; BYTES]],
    /// Census of the right picture, from the column that the leftmost pixel sees at the largest disparity: those of column `x` are
    /// `x .. x + count`, largest disparity first.
    pub(super) right: &'a [[Lanes; BYTES]],
    /// How many disparities.
    pub(super) count: usize,
}

/// Bytes that are read in one place and written in another, in the order in which this is right.
type Row = [Cell<u8>; LANES];

/// Takes a group of paths to column `x`, to the left where `BACK`. `sums` have one entry a disparity, but for [`CARRY`].
#[inline(always)]
pub(super) fn step<const BYTES: usize, const MODE: u8, const GROUP: usize, const BACK: bool>(
    columns: &Columns<'_, BYTES>,
    x: usize,
    penalties: Penalties,
    fronts: &mut [Front; PATHS],
    sums: &mut [Lanes],
) {
    let slopes = const { slopes(GROUP, BACK) };
    let Penalties { p1, p2 } = penalties;
    let count = columns.count;
    let (left, right) = (&columns.left[x], &columns.right[x..x + count]);
    let sums = if MODE == CARRY { sums } else { &mut sums[..count] };
    // Of each path: L(q, d − 1) + P1, L(q, d), min L(q, ·), that + P2, and the least of the new column.
    let mut below = [all(u8::MAX); PATHS];
    let before: [Lanes; PATHS] = std::array::from_fn(|p| load(&fronts[p].least, LANES));
    let mut jump = before;
    let mut least = [all(u8::MAX); PATHS];
    for p in 0..PATHS {
        for i in 0..LANES {
            jump[p][i] = before[p][i].saturating_add(p2);
        }
    }
    {
        let cells = fronts.each_mut().map(|front| Cell::from_mut(&mut front.bytes[..]).as_slice_of_cells());
        let read: [&[Row]; PATHS] = std::array::from_fn(|p| &cells[p][LANES..].as_chunks().0[..=count]);
        let write: [&[Row]; PATHS] =
            std::array::from_fn(|p| &cells[p][LANES.wrapping_add_signed(slopes[p])..].as_chunks().0[..count]);
        let mut here: [Lanes; PATHS] = std::array::from_fn(|p| get(&read[p][0]));
        for d in 0..count {
            // Computed for each sweep: a byte from the second-level cache takes longer.
            let cost = hamming(left, &right[count - 1 - d]);
            let mut sum = if MODE == ADD { sums[d] } else { [0; LANES] };
            for p in 0..PATHS {
                let above = get(&read[p][d + 1]);
                let mut to = [0; LANES];
                for i in 0..LANES {
                    let beside = below[p][i].min(above[i].saturating_add(p1));
                    let value = here[p][i].min(beside).min(jump[p][i]).wrapping_sub(before[p][i]).wrapping_add(cost[i]);
                    least[p][i] = least[p][i].min(value);
                    sum[i] = sum[i].saturating_add(value);
                    below[p][i] = here[p][i].saturating_add(p1);
                    to[i] = value;
                }
                leave(&mut to, slopes[p]);
                for i in 0..LANES {
                    write[p][d][i].set(to[i]);
                }
                here[p] = above;
            }
            if MODE != CARRY {
                sums[d] = sum;
            }
        }
    }
    for p in 0..PATHS {
        leave(&mut least[p], slopes[p]);
        store(&mut fronts[p].least, LANES.wrapping_add_signed(slopes[p]), &least[p]);
    }
}

#[inline(always)]
fn get(row: &Row) -> Lanes {
    let mut lanes = [0; LANES];
    for i in 0..LANES {
        lanes[i] = row[i].get();
    }
    lanes
}

/// The path that leaves the strip is forgotten: what is shifted out must be the zero of a path that enters.
#[inline(always)]
fn leave(lanes: &mut Lanes, slope: isize) {
    for (i, lane) in lanes.iter_mut().enumerate() {
        let leaves = (i as isize + slope) < 0 || (i as isize + slope) >= LANES as isize;
        *lane = if leaves { 0 } else { *lane };
    }
}
