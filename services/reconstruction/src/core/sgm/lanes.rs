//! Sixty-four rows side by side: what one vector register of 512 bits holds, two of 256, four of 128.
//!
//! Everything here is a loop over a fixed number of bytes, which the compiler turns into the widest instructions of the target
//! it compiles for. That is why all of it is `inline(always)`: a function takes on the target of its caller
//! ([`simd`](super::simd)) only where it is inlined.

/// How many rows are worked on side by side.
pub(super) const LANES: usize = 64;

/// One byte for each of 64 rows.
pub(super) type Lanes = [u8; LANES];

/// The same byte in every row.
#[inline(always)]
pub(super) const fn all(value: u8) -> Lanes {
    [value; LANES]
}

/// The 64 bytes that start at `at`; zeros beyond the end.
#[inline(always)]
pub(super) fn load(bytes: &[u8], at: usize) -> Lanes {
    bytes.get(at..).and_then(|from| from.first_chunk()).copied().unwrap_or([0; LANES])
}

/// Writes 64 bytes from `at`; nothing beyond the end.
#[inline(always)]
pub(super) fn store(bytes: &mut [u8], at: usize, lanes: &Lanes) {
    if let Some(to) = bytes.get_mut(at..).and_then(|to| to.first_chunk_mut()) {
        *to = *lanes;
    }
}
