//! The census transform (Zabih and Woodfill 1994): a pixel is described by which of its neighbours are brighter. It does not care
//! for gain, offset or glare that both pictures do not share, and its Hamming distance fits into a byte.
//!
//! The bits of a pixel are kept as bytes, each in a plane of its own, so that 64 rows are compared by one exclusive-or and one
//! population count for each plane.

use std::ops::Range;

use super::View;
use super::lanes::{LANES, Lanes, load};

/// Furthest that any comparison reaches: columns and rows.
pub(super) const REACH: usize = 4;
/// Bytes of one column of a strip with what its neighbours above and below reach.
const COLUMN: usize = LANES + 2 * REACH;

/// Two neighbours, as (dx, dy) from the pixel: the bit is set where the second is brighter.
type Pair = ((isize, isize), (isize, isize));

/// Which pixels are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Census {
    /// Each of the 24 neighbours within 5 × 5 with the pixel itself: 24 bits.
    Five,
    /// Opposite pixels within 9 wide × 7 high, centre-symmetric (Spangenberg, Langner and Rojas 2013): 31 bits.
    NineSymmetric,
    /// Each of the 48 neighbours within 7 × 7 with the pixel itself: 48 bits.
    Seven,
}

impl Census {
    /// How many bits describe a pixel, which is also the largest cost.
    #[must_use]
    pub const fn bits(self) -> u8 {
        match self {
            Self::Five => 24,
            Self::NineSymmetric => 31,
            Self::Seven => 48,
        }
    }

    /// Half width and half height of the neighbourhood, pixels.
    const fn reach(self) -> (isize, isize) {
        match self {
            Self::Five => (2, 2),
            Self::NineSymmetric => (4, 3),
            Self::Seven => (3, 3),
        }
    }

    /// The comparison that bit number `bit` stands for; `None` beyond the last.
    const fn pair(self, bit: usize) -> Option<Pair> {
        if bit >= self.bits() as usize {
            return None;
        }
        let (half_width, half_height) = self.reach();
        let width = 2 * half_width + 1;
        // Row by row from the top left; the centre has the number `bits` or half of it.
        let skip = if !matches!(self, Self::NineSymmetric) && bit >= self.bits() as usize / 2 { 1 } else { 0 };
        let number = (bit + skip) as isize;
        let (dx, dy) = (number % width - half_width, number / width - half_height);
        Some(match self {
            Self::NineSymmetric => ((dx, dy), (-dx, -dy)),
            Self::Five | Self::Seven => ((0, 0), (dx, dy)),
        })
    }
}

/// One picture's strip of 64 rows, transposed: columns follow one another.
#[derive(Debug, Default)]
pub(super) struct Transposed {
    bytes: Vec<u8>,
}

impl Transposed {
    /// Copies the rows `first_row .. first_row + 64` in, with a margin of repeated edge pixels.
    #[inline(always)]
    pub(super) fn fill(&mut self, view: View<'_>, first_row: usize) {
        let columns = view.width + 2 * REACH;
        self.bytes.resize(columns * COLUMN, 0);
        for group in 0..COLUMN / 8 {
            // Eight rows at a time, so that what is written is eight neighbouring bytes.
            let rows: [&[u8]; 8] = std::array::from_fn(|i| {
                let row = (first_row + 8 * group + i).saturating_sub(REACH).min(view.height - 1);
                &view.pixels[row * view.stride..][..view.width]
            });
            for (column, to) in self.bytes.chunks_exact_mut(COLUMN).enumerate() {
                let x = column.saturating_sub(REACH).min(view.width - 1);
                for i in 0..8 {
                    to[8 * group + i] = rows[i][x];
                }
            }
        }
    }

    /// The census of these columns, in `BYTES` planes; beyond the edges the edge goes on.
    #[inline(always)]
    pub(super) fn census<const BYTES: usize>(&self, census: Census, columns: Range<isize>, to: &mut Vec<[Lanes; BYTES]>) {
        let last = (self.bytes.len() / COLUMN) as isize - 2 * REACH as isize - 1;
        to.clear();
        let mut before = None;
        for column in columns {
            let x = column.clamp(0, last) as usize;
            let planes = match (before, to.last()) {
                (Some(same), Some(planes)) if same == x => *planes,
                _ => self.planes(census, x),
            };
            before = Some(x);
            to.push(planes);
        }
    }

    #[inline(always)]
    fn planes<const BYTES: usize>(&self, census: Census, x: usize) -> [Lanes; BYTES] {
        let mut planes = [[0; LANES]; BYTES];
        for (byte, plane) in planes.iter_mut().enumerate() {
            for bit in 0..8 {
                if let Some((a, b)) = census.pair(8 * byte + bit) {
                    let (a, b) = (self.at(x, a), self.at(x, b));
                    for i in 0..LANES {
                        plane[i] |= u8::from(b[i] > a[i]) << bit;
                    }
                }
            }
        }
        planes
    }

    /// The 64 pixels at (dx, dy) from column `x`.
    #[inline(always)]
    fn at(&self, x: usize, (dx, dy): (isize, isize)) -> Lanes {
        let column = (x + REACH).wrapping_add_signed(dx);
        load(&self.bytes, (column * COLUMN + REACH).wrapping_add_signed(dy))
    }
}

/// How many bits differ, in each of 64 rows.
#[inline(always)]
pub(super) fn hamming<const BYTES: usize>(a: &[Lanes; BYTES], b: &[Lanes; BYTES]) -> Lanes {
    let mut sum = [0; LANES];
    for i in 0..LANES {
        for byte in 0..BYTES {
            sum[i] = u8::wrapping_add(sum[i], (a[byte][i] ^ b[byte][i]).count_ones() as u8);
        }
    }
    sum
}

impl Transposed {
    pub(super) fn memory_bytes(&self) -> usize {
        self.bytes.capacity()
    }
}
