//! JPEG (ITU-T T.81): segments up to the end-of-image marker, and every scan walked code by code, because libjpeg fills what is
//! missing with grey and goes on.

use super::scan::{Component, Frame, Scan, Table};
use super::{Header, Trouble, u16_at};

/// Each scan is walked over the whole picture; an encoder makes a dozen.
const SCANS_MAX: usize = 100;

/// The header of a whole JPEG.
pub(super) fn check(bytes: &[u8]) -> Result<Header, Trouble> {
    let mut frame: Option<Frame> = None;
    let mut header = None;
    let mut dc: [Option<Table>; 4] = [const { None }; 4];
    let mut ac: [Option<Table>; 4] = [const { None }; 4];
    let (mut restart_interval, mut scans) = (0, 0);
    let mut at = 2;
    loop {
        if *bytes.get(at).ok_or(Trouble::Truncated)? != 0xff {
            return Err(Trouble::Damaged(format!("byte {at} should start a segment")));
        }
        let marker = *bytes.get(at + 1).ok_or(Trouble::Truncated)?;
        match marker {
            0xff => {
                at += 1;
                continue;
            }
            0x01 | 0xd0..=0xd7 => {
                at += 2;
                continue;
            }
            0xd9 => break,
            _ => {}
        }
        let length = usize::from(u16_at(bytes, at + 2).ok_or(Trouble::Truncated)?).max(2);
        let segment = bytes.get(at + 4..at + 2 + length).ok_or(Trouble::Truncated)?;
        at += 2 + length;
        match marker {
            0xc4 => read_tables(segment, &mut dc, &mut ac).ok_or_else(|| damaged("a code table is damaged"))?,
            // Baseline, extended and progressive, Huffman-coded: what libjpeg decodes.
            0xc0..=0xc2 if frame.is_none() => {
                let (read, shape) = read_frame(segment, marker == 0xc2, bytes.len())?;
                (header, frame) = (Some(read), Some(shape));
            }
            0xc0..=0xc2 => return Err(damaged("it has two frames")),
            0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf => {
                return Err(Trouble::Unsupported("lossless, hierarchical or arithmetic-coded".into()));
            }
            0xdd => restart_interval = usize::from(u16_at(segment, 0).ok_or(Trouble::Truncated)?),
            0xda => {
                scans += 1;
                if scans > SCANS_MAX {
                    return Err(Trouble::Damaged(format!("it has more than {SCANS_MAX} scans")));
                }
                let frame = frame.as_mut().ok_or_else(|| damaged("it has no frame"))?;
                let scan = Scan::read(segment, frame, &dc, &ac).ok_or_else(|| damaged("a scan's header is damaged"))?;
                let end = end_of_scan(bytes, at).ok_or(Trouble::Truncated)?;
                frame.walk(&scan, &bytes[at..end], restart_interval).map_err(damaged)?;
                at = end;
            }
            _ => {}
        }
    }
    if !frame.is_some_and(|frame| frame.is_complete()) {
        return Err(damaged("some of its picture is missing"));
    }
    header.ok_or_else(|| damaged("it has no frame"))
}

fn damaged(why: &str) -> Trouble {
    Trouble::Damaged(why.to_owned())
}

fn read_frame(segment: &[u8], progressive: bool, file_bytes: usize) -> Result<(Header, Frame), Trouble> {
    let byte = |at: usize| segment.get(at).copied().ok_or(Trouble::Truncated);
    let bits = u32::from(byte(0)?);
    let side = |at: usize| u16_at(segment, at).map(u32::from).ok_or(Trouble::Truncated);
    let header = Header { width_px: side(3)?, height_px: side(1)?, bits };
    // A block of 64 pixels takes at least one bit.
    header.check(file_bytes, 512)?;
    if bits != 8 {
        return Err(Trouble::Unsupported(format!("of {bits} bits")));
    }
    let count = usize::from(byte(5)?);
    match count {
        1 | 3 => {}
        4 => return Err(Trouble::Unsupported("with four colours (CMYK)".into())),
        _ => return Err(Trouble::Damaged(format!("it has {count} colours"))),
    }
    let mut components = Vec::new();
    for three in segment.get(6..6 + 3 * count).ok_or(Trouble::Truncated)?.chunks_exact(3) {
        let (across, down) = (usize::from(three[1] >> 4), usize::from(three[1] & 15));
        if !(1..=4).contains(&across) || !(1..=4).contains(&down) {
            return Err(damaged("its frame is damaged"));
        }
        components.push(Component::new(three[0], across, down));
    }
    Ok((header, Frame::new(header.width_px as usize, header.height_px as usize, progressive, components)))
}

/// Code tables; `None` where they are damaged.
fn read_tables(mut segment: &[u8], dc: &mut [Option<Table>; 4], ac: &mut [Option<Table>; 4]) -> Option<()> {
    while let Some((kind, rest)) = segment.split_first() {
        let (counts, rest) = rest.split_first_chunk::<16>()?;
        let total = counts.iter().map(|count| usize::from(*count)).sum();
        let values = rest.get(..total)?;
        let tables = if kind >> 4 == 0 { &mut *dc } else { &mut *ac };
        *tables.get_mut(usize::from(kind & 15))? = Some(Table::new(*counts, values)?);
        segment = &rest[total..];
    }
    Some(())
}

/// Where the entropy-coded data that start at `at` end: the next marker that is no stuffing and no restart.
fn end_of_scan(bytes: &[u8], mut at: usize) -> Option<usize> {
    loop {
        let next = bytes.get(at..)?.iter().position(|byte| *byte == 0xff)? + at;
        match *bytes.get(next + 1)? {
            0x00 | 0xd0..=0xd7 => at = next + 2,
            0xff => at = next + 1,
            _ => return Some(next),
        }
    }
}
