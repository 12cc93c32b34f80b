//! One strip of 64 rows, matched by itself.
//!
//! A sweep needs the whole width before the sweep back may begin, and a strip's path costs (`width × count × 64` bytes) are far
//! larger than a cache. So the first sweep only leaves checkpoints, one each few columns; on the way back, a block of columns
//! after the other is swept again from its checkpoint, this time keeping the sums, and completed in the cache. That is half
//! as much arithmetic again in place of main memory's bandwidth, and needs a few MB whatever the picture.

use super::View;
use super::agree::Owners;
use super::census::{Census, Transposed};
use super::choose::{Number, choose};
use super::lanes::{LANES, Lanes};
use super::sweep::{ADD, BEGIN, CARRY, Columns, Front, PATHS, Penalties, step};
use super::{Paths, Settings};

/// Bytes that the sums of a block may take: what a core's second-level cache holds beside everything else.
const BLOCK_BYTES: usize = 1 << 18;

/// A strip to be matched.
pub(super) struct Job<'a> {
    pub(super) left: View<'a>,
    pub(super) right: View<'a>,
    pub(super) min_px: i32,
    pub(super) count: usize,
    pub(super) settings: Settings,
    /// The picture's row of the first of 64; beyond the last row it is repeated.
    pub(super) first_row: usize,
    /// How many rows above what is kept; these only lead the paths in.
    pub(super) lead: usize,
}

/// Where the rows that are kept go.
pub(super) struct Output<'a> {
    /// Disparities, pixels.
    pub(super) disparity_px: &'a mut [f32],
    /// Their sums.
    pub(super) sums: &'a mut [u8],
}

/// What a strip needs; kept from strip to strip.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    left: Transposed,
    right: Transposed,
    five: Planes<3>,
    nine: Planes<4>,
    seven: Planes<6>,
    /// Of the first four paths, and of the second.
    fronts: [Fronts; 2],
    sums: Vec<Lanes>,
    owners: Owners,
}

#[derive(Debug, Default)]
struct Planes<const BYTES: usize> {
    left: Vec<[Lanes; BYTES]>,
    right: Vec<[Lanes; BYTES]>,
}

#[derive(Debug, Default)]
struct Fronts {
    checkpoints: Vec<[Front; PATHS]>,
    now: [Front; PATHS],
}

/// Matches a strip.
#[inline(always)]
pub(super) fn run(job: &Job<'_>, workspace: &mut Workspace, output: Output<'_>) {
    match job.settings.census {
        Census::Five => with_census::<3>(job, workspace, output, |workspace| &mut workspace.five),
        Census::NineSymmetric => with_census::<4>(job, workspace, output, |workspace| &mut workspace.nine),
        Census::Seven => with_census::<6>(job, workspace, output, |workspace| &mut workspace.seven),
    }
}

#[inline(always)]
fn with_census<const BYTES: usize>(
    job: &Job<'_>,
    workspace: &mut Workspace,
    mut output: Output<'_>,
    planes_of: impl Fn(&mut Workspace) -> &mut Planes<BYTES>,
) {
    workspace.left.fill(job.left, job.first_row);
    workspace.right.fill(job.right, job.first_row);
    let mut planes = std::mem::take(planes_of(workspace));
    let width = job.left.width as isize;
    let (least, most) = (job.min_px as isize, job.min_px as isize + job.count as isize - 1);
    workspace.left.census(job.settings.census, 0..width, &mut planes.left);
    workspace.right.census(job.settings.census, -most..width - least, &mut planes.right);
    let columns = Columns { left: &planes.left, right: &planes.right, count: job.count };
    let Workspace { fronts, sums, .. } = workspace;
    match job.settings.paths {
        Paths::Four => sweep::<BYTES, 1>(job, &columns, fronts, sums, &mut output),
        Paths::Eight => sweep::<BYTES, 2>(job, &columns, fronts, sums, &mut output),
    }
    *planes_of(workspace) = planes;
    workspace.owners.left_right(job, &mut output);
}

#[inline(always)]
fn sweep<const BYTES: usize, const GROUPS: usize>(
    job: &Job<'_>,
    columns: &Columns<'_, BYTES>,
    [first_group, second_group]: &mut [Fronts; 2],
    sums: &mut Vec<Lanes>,
    output: &mut Output<'_>,
) {
    let (width, count) = (job.left.width, job.count);
    let penalties = Penalties { p1: job.settings.p1, p2: job.settings.p2 };
    // Not too few columns where there are many disparities: every block has a checkpoint.
    let block = (BLOCK_BYTES / (count * LANES)).max(width.isqrt() / 2).clamp(1, width);
    sums.resize(block * count, [0; LANES]);
    carry::<BYTES, 0>(columns, penalties, first_group, block);
    if GROUPS > 1 {
        carry::<BYTES, 1>(columns, penalties, second_group, block);
    }
    for number in (0..width.div_ceil(block)).rev() {
        let first = number * block;
        let last = (first + block).min(width);
        for x in first..last {
            let sums = &mut sums[(x - first) * count..][..count];
            step::<BYTES, BEGIN, 0, false>(columns, x, penalties, &mut first_group.checkpoints[number], sums);
            if GROUPS > 1 {
                step::<BYTES, ADD, 1, false>(columns, x, penalties, &mut second_group.checkpoints[number], sums);
            }
        }
        for x in (first..last).rev() {
            let sums = &mut sums[(x - first) * count..][..count];
            step::<BYTES, ADD, 0, true>(columns, x, penalties, &mut first_group.now, sums);
            if GROUPS > 1 {
                step::<BYTES, ADD, 1, true>(columns, x, penalties, &mut second_group.now, sums);
            }
            if count <= 1 << 8 {
                write::<u8>(job, x, sums, output);
            } else {
                write::<u16>(job, x, sums, output);
            }
        }
    }
}

/// The first sweep of a group: leaves a checkpoint before each block, and paths that have not begun for the sweep back.
#[inline(always)]
fn carry<const BYTES: usize, const GROUP: usize>(
    columns: &Columns<'_, BYTES>,
    penalties: Penalties,
    Fronts { checkpoints, now }: &mut Fronts,
    block: usize,
) {
    let width = columns.left.len();
    checkpoints.resize_with(width.div_ceil(block), Default::default);
    now.iter_mut().for_each(|front| front.reset(columns.count));
    for (number, checkpoint) in checkpoints.iter_mut().enumerate() {
        for (to, from) in checkpoint.iter_mut().zip(now.iter()) {
            to.copy_from(from);
        }
        // Nothing follows the last one.
        if (number + 1) * block < width {
            for x in number * block..(number + 1) * block {
                step::<BYTES, CARRY, GROUP, false>(columns, x, penalties, now, &mut []);
            }
        }
    }
    now.iter_mut().for_each(|front| front.reset(columns.count));
}

/// Chooses for column `x` and writes what is kept.
#[inline(always)]
fn write<N: Number>(job: &Job<'_>, x: usize, sums: &[Lanes], output: &mut Output<'_>) {
    let winners = choose::<N>(sums, job.settings.uniqueness_percent);
    let width = job.left.width;
    let rows = output.disparity_px.chunks_exact_mut(width).zip(output.sums.chunks_exact_mut(width));
    for (i, (disparities, sums)) in rows.enumerate() {
        let disparity_px = winners.disparity_px[job.lead + i] + job.min_px as f32;
        // A match beyond the right picture's edges was never seen.
        let at_px = x as f32 - disparity_px;
        let seen = at_px >= 0.0 && at_px <= (width - 1) as f32;
        disparities[x] = if seen { disparity_px } else { f32::NAN };
        sums[x] = winners.sum[job.lead + i];
    }
}

impl Workspace {
    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        fn planes<const BYTES: usize>(planes: &Planes<BYTES>) -> usize {
            (planes.left.capacity() + planes.right.capacity()) * BYTES * LANES
        }
        let fronts = self.fronts.iter().flat_map(|fronts| fronts.checkpoints.iter().chain([&fronts.now])).flatten();
        planes(&self.five)
            + planes(&self.nine)
            + planes(&self.seven)
            + fronts.map(Front::memory_bytes).sum::<usize>()
            + self.sums.capacity() * LANES
            + self.left.memory_bytes()
            + self.right.memory_bytes()
            + self.owners.memory_bytes()
    }
}
