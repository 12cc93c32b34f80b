//! Is this file a whole picture, and of what kind? Walks the container without decoding it.

mod jpeg;
mod png;
mod scan;

use halcyon_model::Image;

/// Formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureKind {
    /// JFIF or EXIF.
    Jpeg,
    /// Portable network graphics.
    Png,
    /// PBM, PGM or PPM, text or binary.
    Pnm,
}

/// What the header says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) width_px: u32,
    pub(super) height_px: u32,
    /// Bits a channel.
    pub(super) bits: u32,
}

/// Why a file is not read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Trouble {
    /// It ends too early.
    Truncated,
    /// It is not whole: what is wrong.
    Damaged(String),
    /// It may be whole, but is of a sort that is not read: which, to stand after the format's name.
    Unsupported(String),
}

/// More pixels than any stereo camera has; a decoder allocates up to 8 bytes for each.
const PIXELS_MAX: u64 = 128 << 20;

impl Header {
    /// Refuses sizes that no picture has, and sizes that a file of `file_bytes` cannot hold with at most `pixels_per_byte` in
    /// each: a decoder allocates what the header says.
    pub(super) fn check(&self, file_bytes: usize, pixels_per_byte: u64) -> Result<(), Trouble> {
        let Self { width_px, height_px, .. } = *self;
        let pixels = u64::from(width_px) * u64::from(height_px);
        let claim = || format!("its header claims {width_px} x {height_px} px");
        if pixels == 0 {
            return Err(Trouble::Damaged(claim()));
        }
        if width_px.max(height_px) > Image::SIDE_PX_MAX || pixels > PIXELS_MAX {
            return Err(Trouble::Damaged(format!(
                "{}, at most {} a side and {PIXELS_MAX} in all are read",
                claim(),
                Image::SIDE_PX_MAX
            )));
        }
        if pixels > (file_bytes as u64).saturating_mul(pixels_per_byte) {
            return Err(Trouble::Damaged(format!("{}, which {file_bytes} bytes cannot hold", claim())));
        }
        Ok(())
    }
}

const SIGNATURE_PNG: &[u8] = b"\x89PNG\r\n\x1a\n";

/// First bytes of formats that people have and we do not read; `?` stands for any byte.
const FOREIGN: [(&[u8], &str); 14] = [
    (b"II*\0", "TIFF"),
    (b"MM\0*", "TIFF"),
    (b"II+\0", "TIFF"),
    (b"GIF8", "GIF"),
    (b"BM", "BMP"),
    (b"RIFF????WEBP", "WebP"),
    (b"????ftyp", "HEIF, AVIF or MP4"),
    (b"\0\0\0\x0cjP  ", "JPEG 2000"),
    (b"\xff\x4f\xff\x51", "JPEG 2000"),
    (b"v/1\x01", "OpenEXR"),
    (b"P7", "PAM"),
    (b"Pf", "PFM, which holds numbers and no grey levels"),
    (b"PF", "PFM, which holds numbers and no grey levels"),
    (b"%PDF", "PDF"),
];

impl PictureKind {
    /// By the first bytes: names lie.
    pub(super) fn of(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            [b'P', b'1'..=b'6', ..] => Some(Self::Pnm),
            _ if bytes.starts_with(SIGNATURE_PNG) => Some(Self::Png),
            _ => None,
        }
    }

    /// For messages.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Jpeg => "JPEG",
            Self::Png => "PNG",
            Self::Pnm => "PBM, PGM or PPM",
        }
    }
}

/// The name of a format that is known but not read.
pub(super) fn foreign(bytes: &[u8]) -> Option<&'static str> {
    let fits = |pattern: &[u8]| {
        bytes.len() >= pattern.len() && pattern.iter().zip(bytes).all(|(expected, byte)| *expected == b'?' || expected == byte)
    };
    FOREIGN.iter().find(|(pattern, _)| fits(pattern)).map(|(_, name)| *name)
}

/// The header of a whole JPEG or PNG, which a decoder may then have.
pub(super) fn check(kind: PictureKind, bytes: &[u8]) -> Result<(), Trouble> {
    match kind {
        PictureKind::Jpeg => jpeg::check(bytes).map(|_| ()),
        PictureKind::Png => png::check(bytes).map(|_| ()),
        // Its own decoder checks it.
        PictureKind::Pnm => Ok(()),
    }
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    bytes.get(at..at + 2).map(|two| u16::from_be_bytes([two[0], two[1]]))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4).map(|four| u32::from_be_bytes([four[0], four[1], four[2], four[3]]))
}
