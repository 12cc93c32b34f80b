//! Pictures of every sort, whole and damaged: each is read right or refused with one clear line.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "tests fail by panicking and print what they measured"
)]

mod support;

use std::path::{Path, PathBuf};

use halcyon_model::Image;
use halcyon_reconstruction::files::{FileError, read_pair, read_picture};
use opencv::core::{Mat, Vector};
use opencv::prelude::*;
use opencv::{imgcodecs, imgproc};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use support::png::{chunk, header, png, zlib};
use support::samples;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    fn read(&self, bytes: &[u8]) -> Result<Image, FileError> {
        read_picture(&self.write("picture", bytes))
    }

    #[track_caller]
    fn check(&self, bytes: &[u8], width: u32, expected: &[u8]) {
        let image = self.read(bytes).unwrap();
        assert_eq!((image.width_px(), &image.pixels()[..]), (width, expected));
    }

    #[track_caller]
    fn refused(&self, bytes: &[u8], why: &str) {
        let error = self.read(bytes).unwrap_err();
        let line = line(&error);
        assert!(line.contains(why) && !line.contains('\n'), "{line}");
    }
}

/// As the command line prints it.
fn line(error: &dyn std::error::Error) -> String {
    let source = error.source().map(|source| format!(": {}", line(source))).unwrap_or_default();
    format!("{error}{source}")
}

/// A part of the aloe picture in colour, of sides that are no multiple of anything.
fn colour() -> Mat {
    let whole = imgcodecs::imread(samples().join("aloeL.jpg").to_str().unwrap(), imgcodecs::IMREAD_COLOR).unwrap();
    Mat::roi(&whole, opencv::core::Rect::new(500, 400, 165, 117)).unwrap().try_clone().unwrap()
}

fn grey() -> Mat {
    let mut grey = Mat::default();
    imgproc::cvt_color_def(&colour(), &mut grey, imgproc::COLOR_BGR2GRAY).unwrap();
    grey
}

fn encoded(extension: &str, mat: &Mat, parameters: &[i32]) -> Vec<u8> {
    let mut bytes = Vector::<u8>::new();
    imgcodecs::imencode(extension, mat, &mut bytes, &Vector::from_slice(parameters)).unwrap();
    bytes.to_vec()
}

/// What OpenCV makes of the same bytes.
fn by_opencv(bytes: &[u8]) -> Vec<u8> {
    let decoded = imgcodecs::imdecode(&Mat::from_slice(bytes).unwrap(), imgcodecs::IMREAD_UNCHANGED).unwrap();
    let mut grey = Mat::default();
    if decoded.channels() == 1 {
        return decoded.data_bytes().unwrap().to_vec();
    }
    imgproc::cvt_color_def(&decoded, &mut grey, imgproc::COLOR_BGR2GRAY).unwrap();
    grey.data_bytes().unwrap().to_vec()
}

/// JPEGs of every sort that OpenCV writes: plain, progressive, with restart markers, with tables of their own; grey and colour.
fn jpegs() -> Vec<Vec<u8>> {
    use imgcodecs::{IMWRITE_JPEG_OPTIMIZE, IMWRITE_JPEG_PROGRESSIVE, IMWRITE_JPEG_QUALITY, IMWRITE_JPEG_RST_INTERVAL};
    let sorts: [&[i32]; 6] = [
        &[],
        &[IMWRITE_JPEG_QUALITY, 30],
        &[IMWRITE_JPEG_PROGRESSIVE, 1],
        &[IMWRITE_JPEG_RST_INTERVAL, 7],
        &[IMWRITE_JPEG_PROGRESSIVE, 1, IMWRITE_JPEG_RST_INTERVAL, 5, IMWRITE_JPEG_QUALITY, 99],
        &[IMWRITE_JPEG_OPTIMIZE, 1, IMWRITE_JPEG_QUALITY, 100],
    ];
    let (grey, colour) = (grey(), colour());
    sorts.iter().flat_map(|sort| [&grey, &colour].map(|mat| encoded(".jpg", mat, sort))).collect()
}

#[test]
fn whole_jpegs_are_read_as_opencv_reads_them() {
    let folder = Folder::new();
    for bytes in jpegs() {
        folder.check(&bytes, 165, &by_opencv(&bytes));
        // Bytes after the end, such as a maker's note or a second picture of the same shot, do no harm.
        folder.check(&[&bytes[..], b"tail"].concat(), 165, &by_opencv(&bytes));
    }
    for name in ["left01.jpg", "right14.jpg", "aloeL.jpg", "aloeR.jpg"] {
        let bytes = std::fs::read(samples().join(name)).unwrap();
        assert_eq!(read_picture(&samples().join(name)).unwrap().pixels()[..], by_opencv(&bytes), "{name}");
    }
}

/// libjpeg fills what is missing with grey and says so on stderr only. Cut at any length, with or without an end-of-image marker
/// put behind, a JPEG is refused; where a cut takes nothing that counts, the picture is the whole one.
#[test]
fn truncated_jpegs_are_refused() {
    let folder = Folder::new();
    let mut files = jpegs();
    files.push(std::fs::read(samples().join("left01.jpg")).unwrap());
    for bytes in files {
        let whole = folder.read(&bytes).unwrap();
        let (mut cuts, mut accepted) = (0, 0);
        for cut in (1..bytes.len()).step_by(bytes.len() / 120).chain(bytes.len() - 12..bytes.len()) {
            folder.read(&bytes[..cut]).unwrap_err();
            let closed = [bytes[..cut].strip_suffix(b"\xff").unwrap_or(&bytes[..cut]), &[0xff, 0xd9]].concat();
            cuts += 1;
            if let Ok(read) = folder.read(&closed) {
                accepted += 1;
                assert_eq!(read, whole, "cut at {cut} of {}", bytes.len());
            }
        }
        assert!(accepted <= 3, "{accepted} of {cuts}");
    }
}

/// Bytes lost in the middle of the data: a walk of the codes finds most. In the rest the decoder falls in step again with as many
/// blocks as before: no block is missing, and nothing in the format can tell.
#[test]
fn jpegs_with_a_hole_are_refused() {
    let folder = Folder::new();
    let (mut holes, mut accepted) = (0, 0);
    for bytes in jpegs() {
        let start = bytes.len() / 3;
        for at in (start..bytes.len() - 150).step_by(211) {
            let holed = [&bytes[..at], &bytes[at + 100..]].concat();
            holes += 1;
            accepted += usize::from(folder.read(&holed).is_ok());
        }
    }
    println!("{accepted} of {holes} holes went unseen");
    assert!(holes > 300 && accepted * 8 <= holes, "{accepted} of {holes}");
}

#[test]
fn jpegs_that_are_not_read_say_why() {
    let folder = Folder::new();
    let bytes = encoded(".jpg", &grey(), &[]);
    let frame = bytes.windows(2).position(|two| two == [0xff, 0xc0]).unwrap();
    let changed = |offset: usize, value: &[u8]| {
        let mut bytes = bytes.clone();
        bytes[frame + offset..][..value.len()].copy_from_slice(value);
        bytes
    };
    folder.refused(&changed(1, &[0xc9]), "arithmetic");
    folder.refused(&changed(1, &[0xc3]), "lossless");
    folder.refused(&changed(4, &[12]), "12 bits");
    folder.refused(&changed(9, &[4]), "CMYK");
    folder.refused(&changed(5, &[0, 0]), "claims 165 x 0 px");
    folder.refused(&changed(5, &[0xff, 0xff, 0xff, 0xff]), "claims 65535 x 65535 px");
    folder.refused(&changed(5, &[0x3f, 0xff, 0x1f, 0xff]), "cannot hold");
    // More rows than there are data for, and fewer.
    folder.refused(&changed(5, &[0, 125]), "damaged JPEG");
    folder.refused(&changed(5, &[0, 100]), "damaged JPEG");
}

#[test]
fn pngs_of_every_sort() {
    let folder = Folder::new();
    let palette = chunk(b"PLTE", &[0, 0, 0, 255, 255, 255, 10, 10, 10, 200, 200, 200]);
    folder.check(&png(3, 8, 0, b"", &[&[1, 2, 3], &[4, 5, 6]]), 3, &[1, 2, 3, 4, 5, 6]);
    folder.check(&png(10, 1, 0, b"", &[&[0b1010_0000, 0b0100_0000]]), 10, &[255, 0, 255, 0, 0, 0, 0, 0, 0, 255]);
    folder.check(&png(4, 2, 0, b"", &[&[0b0001_1011]]), 4, &[0, 85, 170, 255]);
    folder.check(&png(2, 4, 0, b"", &[&[0x0f]]), 2, &[0, 255]);
    folder.check(&png(4, 8, 3, &palette, &[&[3, 2, 1, 0]]), 4, &[200, 10, 255, 0]);
    folder.check(&png(8, 1, 3, &palette, &[&[0b0101_0011]]), 8, &[0, 255, 0, 255, 0, 0, 255, 255]);
    // 0.299 R + 0.587 G + 0.114 B, by hand.
    folder.check(&png(3, 8, 2, b"", &[&[255, 0, 0, 0, 255, 0, 0, 0, 255]]), 3, &[76, 150, 29]);
    folder.check(&png(2, 8, 4, b"", &[&[7, 255, 9, 255]]), 2, &[7, 9]);
    folder.check(&png(1, 8, 6, b"", &[&[50, 50, 50, 255]]), 1, &[50]);
    folder.check(&png(2, 16, 0, b"", &[&[0xff, 0xff, 0x01, 0x01]]), 2, &[255, 1]);
    folder.check(&png(1, 16, 2, b"", &[&[0xff, 0xff, 0xff, 0xff, 0xff, 0xff]]), 1, &[255]);

    folder.refused(&png(2, 8, 4, b"", &[&[7, 255, 9, 128]]), "transparent");
    folder.refused(&png(1, 8, 6, b"", &[&[50, 50, 50, 0]]), "transparent");
    folder.refused(&png(2, 8, 3, &[&palette[..], &chunk(b"tRNS", &[0])].concat(), &[&[0, 1]]), "transparent");
    folder.refused(&png(1, 8, 0, &chunk(b"acTL", &[0, 0, 0, 5, 0, 0, 0, 0]), &[&[9]]), "PNG of 5 frames");
}

#[test]
fn damaged_pngs_are_refused() {
    let folder = Folder::new();
    let signature = b"\x89PNG\r\n\x1a\n".as_slice();
    let end = chunk(b"IEND", b"");
    let file = |header: &[u8], pixels: &[u8]| [signature, header, pixels, &end].concat();
    // Whole chunks whose pixels end too early: half a picture, a cut stream, none at all, and other pixels than its check sum's.
    let rows = vec![0x55; 65 * 64];
    folder.check(&file(&header(64, 64, 8, 0), &chunk(b"IDAT", &zlib(&[0; 65 * 64]))), 64, &[0; 64 * 64]);
    folder.refused(&file(&header(64, 64, 8, 0), &chunk(b"IDAT", &zlib(&[0; 65 * 30]))), "damaged PNG");
    folder.refused(&file(&header(64, 64, 8, 0), &chunk(b"IDAT", &zlib(&[0; 65 * 64])[..1000])), "damaged PNG");
    folder.refused(&file(&header(64, 64, 8, 0), b""), "no pixels");
    folder.refused(&file(&header(64, 64, 8, 0), &chunk(b"IDAT", &rows)), "damaged PNG");
    folder.refused(&file(b"", &chunk(b"IDAT", &zlib(&[0; 65 * 64]))), "no header");
    folder.refused(&file(&header(64, 64, 7, 0), &chunk(b"IDAT", &zlib(&[0; 65 * 64]))), "damaged PNG");
    // Sizes that would take gigabytes.
    for (width, height) in [(100_000, 100_000), (16_384, 16_384), (12_000, 9_000), (u32::MAX, u32::MAX), (0, 5)] {
        folder.refused(&file(&header(width, height, 8, 0), &chunk(b"IDAT", &zlib(&[0; 999]))), "claims");
    }
    let whole = std::fs::read(samples().join("aloeGT.png")).unwrap();
    for cut in (0..whole.len()).step_by(whole.len() / 50).chain(whole.len() - 12..whole.len()) {
        folder.read(&whole[..cut]).unwrap_err();
    }
    for at in (40..whole.len()).step_by(whole.len() / 50) {
        let mut flipped = whole.clone();
        flipped[at] ^= 0x10;
        folder.read(&flipped).unwrap_err();
    }
}

#[test]
fn pnms_are_read_and_scaled() {
    let folder = Folder::new();
    folder.check(b"P1 3 1 1 0 1", 3, &[0, 255, 0]);
    folder.check(b"P2 3 1 15 0 5 15", 3, &[0, 85, 255]);
    folder.check(b"P4 9 1\n\x80\x00", 9, &[0, 255, 255, 255, 255, 255, 255, 255, 255]);
    folder.check(b"P5 2 1 4095\n\x0f\xff\x08\x00", 2, &[255, 128]);
    folder.check(b"P6 3 1 255\n\xff\0\0\0\xff\0\0\0\xff", 3, &[76, 150, 29]);
    folder.refused(b"P5 2 2 255\nabc", "truncated");
    folder.refused(b"P5 60000 60000 255\nabcd", "claims");
    folder.refused(b"P5 1 1 255\naP5 1 1 255\nb", "several pictures");
}

/// Twelve bits in sixteen, as machine-vision cameras write them: both pictures of a pair on one scale, whichever is brighter.
#[test]
fn sixteen_bits_of_a_pair_share_their_scale() {
    let folder = Folder::new();
    let row = |samples: &[u16]| -> Vec<u8> { samples.iter().flat_map(|sample| sample.to_be_bytes()).collect() };
    let file = |name: &str, samples: &[u16]| folder.write(name, &png(samples.len() as u32, 16, 0, b"", &[&row(samples)]));
    let (left, right) = (file("left.png", &[0, 1000, 2000]), file("right.png", &[100, 1000, 4000]));
    let (bright, dark) = (read_pair(&right, &left).unwrap(), read_pair(&left, &right).unwrap());
    assert_eq!((&bright.0, &bright.1), (&dark.1, &dark.0));
    assert_eq!(dark.0.pixels()[..], [0, 62, 125]);
    assert_eq!(dark.1.pixels()[..], [6, 62, 249]);
    // Alone, the darker one needs only eleven bits.
    assert_eq!(read_picture(&left).unwrap().pixels()[..], [0, 125, 249]);
    // Eight bits beside sixteen stay as they are.
    let eight = folder.write("eight.png", &png(3, 8, 0, b"", &[&[1, 2, 3]]));
    assert_eq!(read_pair(&eight, &right).unwrap().0.pixels()[..], [1, 2, 3]);
}

#[test]
fn what_is_no_picture_says_what_it_is() {
    let folder = Folder::new();
    folder.refused(b"", "is empty");
    folder.refused(b"this is no picture\n", "is not a picture");
    folder.refused(b"\xff\xd8", "is not a picture");
    for (bytes, name) in [
        (b"II*\0\x08\0\0\0".as_slice(), "TIFF"),
        (b"GIF89a", "GIF"),
        (b"BM\x36\0\0\0", "BMP"),
        (b"RIFF\x10\0\0\0WEBPVP8 ", "WebP"),
        (b"\0\0\0\x18ftypheic", "HEIF"),
        (b"Pf\n1 1\n-1\n\0\0\0\0", "PFM"),
        (b"P7\nWIDTH 1", "PAM"),
        (b"%PDF-1.4", "PDF"),
    ] {
        folder.refused(bytes, name);
    }
    let error = |path: &Path| line(&read_picture(path).unwrap_err());
    assert!(error(&folder.0.path().join("nowhere.png")).contains("No such file"));
    assert!(error(folder.0.path()).contains("directory"));
    assert!(error(Path::new("/dev/zero")).contains("device"));
}

/// Whatever the bytes, a picture or an error: random changes to files of every sort.
#[test]
fn no_bytes_do_harm() {
    let folder = Folder::new();
    let mut random = ChaCha8Rng::seed_from_u64(20);
    let mut files = jpegs();
    files.push(png(64, 8, 0, b"", &[[9; 64].as_slice(); 64]));
    files.push([b"P5 64 64 255\n".as_slice(), &[7; 4096]].concat());
    files.push([b"P2 8 8 255\n".as_slice(), &b"12 ".repeat(64)].concat());
    let (mut read, mut refused) = (0, 0);
    for bytes in &files {
        for _ in 0..40 {
            let mut changed = bytes.clone();
            for _ in 0..random.random_range(1..6) {
                // The first bytes hold what decides most.
                let within = if random.random() { 700.min(changed.len()) } else { changed.len() };
                let at = random.random_range(0..within);
                match random.random_range(0..4) {
                    0 => changed[at] = random.random(),
                    1 => changed[at] ^= 1 << random.random_range(0..8),
                    2 => changed.insert(at, random.random()),
                    _ => drop(changed.remove(at)),
                }
            }
            match folder.read(&changed) {
                Ok(_) => read += 1,
                Err(error) => {
                    assert!(!line(&error).contains('\n'));
                    refused += 1;
                }
            }
        }
    }
    println!("{read} read, {refused} refused");
    assert!(refused > read);
}
