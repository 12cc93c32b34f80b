//! Walks the Huffman-coded data of a JPEG without making a picture of them (ITU-T T.81, annexes F and G): are there codes for
//! every block, no fewer and no more?

/// A code table in canonical order.
#[derive(Debug, Clone)]
pub(super) struct Table {
    counts: [u8; 16],
    values: Vec<u8>,
    /// For each next eight bits the length and the value of the code that they start with; length 0 where it is longer.
    short: Box<[(u8, u8); 256]>,
}

impl Table {
    /// `None` where there are more codes of a length than that length can tell apart.
    pub(super) fn new(counts: [u8; 16], values: &[u8]) -> Option<Self> {
        let mut short = Box::new([(0, 0); 256]);
        let (mut code, mut values_left) = (0_usize, values.iter());
        for (length, count) in (1_u8..).zip(counts) {
            code <<= 1;
            for _ in 0..count {
                let value = *values_left.next()?;
                if code >= 1 << length {
                    return None;
                }
                if let Some(free) = 8_u8.checked_sub(length) {
                    short[code << free..(code + 1) << free].fill((length, value));
                }
                code += 1;
            }
        }
        Some(Self { counts, values: values.to_vec(), short })
    }
}

/// Bits of one run of entropy-coded data, up to a marker.
struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
    /// The lowest `count` bits are next, the highest of them first.
    held: u64,
    count: u32,
}

/// The data end too early.
const SHORT: &str = "a scan ends too early";
/// No such code.
const CODE: &str = "a scan has a code that its table lacks";

impl<'a> Bits<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, held: 0, count: 0 }
    }

    /// Takes whole bytes, as many as there are before a marker and as fit.
    fn fill(&mut self) {
        while self.count <= 56 {
            let Some(byte) = self.bytes.get(self.at) else { return };
            if *byte == 0xff {
                // A zero is stuffed behind 0xff; anything else is a marker.
                if self.bytes.get(self.at + 1) != Some(&0) {
                    return;
                }
                self.at += 1;
            }
            self.at += 1;
            (self.held, self.count) = (self.held << 8 | u64::from(*byte), self.count + 8);
        }
    }

    fn bit(&mut self) -> Result<u32, &'static str> {
        self.bits(1)
    }

    /// At most 16 bits.
    fn bits(&mut self, count: u32) -> Result<u32, &'static str> {
        if self.count < count {
            self.fill();
        }
        self.count = self.count.checked_sub(count).ok_or(SHORT)?;
        Ok((self.held >> self.count) as u32 & ((1 << count) - 1))
    }

    fn code(&mut self, table: &Table) -> Result<u8, &'static str> {
        if self.count < 8 {
            self.fill();
        }
        if self.count >= 8 {
            let (length, value) = table.short[usize::from((self.held >> (self.count - 8)) as u8)];
            if length > 0 {
                self.count -= u32::from(length);
                return Ok(value);
            }
        }
        let (mut code, mut first, mut index) = (0_u32, 0_u32, 0_usize);
        for count in table.counts {
            code |= self.bit()?;
            let count = u32::from(count);
            if code < first + count {
                return table.values.get(index + (code - first) as usize).copied().ok_or(CODE);
            }
            index += count as usize;
            (first, code) = ((first + count) << 1, code << 1);
        }
        Err(CODE)
    }

    /// Goes past restart marker number `number`.
    fn restart(&mut self, number: usize) -> Result<(), &'static str> {
        self.fill();
        let unread = self.count >= 8;
        self.count = 0;
        while self.bytes[self.at..].starts_with(&[0xff, 0xff]) {
            self.at += 1;
        }
        if unread || !self.bytes[self.at..].starts_with(&[0xff, 0xd0 + (number % 8) as u8]) {
            return Err("a restart marker is missing");
        }
        self.at += 2;
        Ok(())
    }

    /// Nothing but zeros or fill bytes, which some cameras append, may be left.
    fn is_spent(&self) -> bool {
        let is_fill = |byte: u8| matches!(byte, 0 | 0xff);
        let held = (0..self.count / 8).map(|i| (self.held >> (8 * i)) as u8);
        held.chain(self.bytes[self.at..].iter().copied()).all(is_fill)
    }
}

/// One colour of a frame.
#[derive(Debug, Clone)]
pub(super) struct Component {
    id: u8,
    /// Blocks of a minimum coded unit, across and down.
    across: usize,
    down: usize,
    /// Blocks of the whole component, as stored: whole minimum coded units.
    columns: usize,
    /// Progressive: which coefficients of each block are not zero so far.
    nonzero: Vec<u64>,
    /// For each coefficient the lowest bit that has been sent; 14 where none has.
    lowest: [u8; 64],
}

impl Component {
    pub(super) fn new(id: u8, across: usize, down: usize) -> Self {
        Self { id, across, down, columns: 0, nonzero: Vec::new(), lowest: [14; 64] }
    }
}

/// What a frame's header says, and what its scans have brought.
#[derive(Debug)]
pub(super) struct Frame {
    width: usize,
    height: usize,
    progressive: bool,
    components: Vec<Component>,
}

/// A scan's header.
#[derive(Debug)]
pub(super) struct Scan<'a> {
    parts: Vec<Part<'a>>,
    start: usize,
    end: usize,
    high: u8,
    low: u8,
}

/// One component of a scan: its index and its tables.
#[derive(Debug)]
struct Part<'a> {
    index: usize,
    dc: Option<&'a Table>,
    ac: Option<&'a Table>,
}

impl<'a> Scan<'a> {
    /// `None` where it makes no sense.
    pub(super) fn read(segment: &[u8], frame: &Frame, dc: &'a [Option<Table>; 4], ac: &'a [Option<Table>; 4]) -> Option<Self> {
        let count = usize::from(*segment.first()?);
        let mut parts: Vec<Part<'a>> = Vec::new();
        for pair in segment.get(1..1 + 2 * count)?.chunks_exact(2) {
            let index = frame.components.iter().position(|component| component.id == pair[0])?;
            if parts.iter().any(|part| part.index == index) {
                return None;
            }
            let (dc, ac) = (dc.get(usize::from(pair[1] >> 4))?.as_ref(), ac.get(usize::from(pair[1] & 15))?.as_ref());
            parts.push(Part { index, dc, ac });
        }
        let [start, end, bits] = *segment.get(1 + 2 * count..)?.first_chunk::<3>()?;
        let (start, end) = (usize::from(start), usize::from(end));
        let scan = Self { parts, start, end, high: bits >> 4, low: bits & 15 };
        // Progressive: one bit at a time, DC apart from AC, AC one component at a time.
        let makes_sense = if frame.progressive {
            start <= end
                && end < 64
                && (start > 0 || end == 0)
                && (start == 0 || count == 1)
                && scan.low < 14
                && (scan.high == 0 || scan.high == scan.low + 1)
        } else {
            (start, end, bits) == (0, 63, 0)
        };
        (count > 0 && makes_sense).then_some(scan)
    }
}

impl Frame {
    pub(super) fn new(width: usize, height: usize, progressive: bool, components: Vec<Component>) -> Self {
        let mut frame = Self { width, height, progressive, components };
        let (units_across, units_down) = frame.units();
        for component in &mut frame.components {
            component.columns = units_across * component.across;
            if progressive {
                component.nonzero = vec![0; component.columns * units_down * component.down];
            }
        }
        frame
    }

    /// Largest sampling factors, across and down.
    fn sampling(&self) -> (usize, usize) {
        let most = |of: fn(&Component) -> usize| self.components.iter().map(of).max().unwrap_or(1);
        (most(|component| component.across), most(|component| component.down))
    }

    /// Minimum coded units, across and down.
    fn units(&self) -> (usize, usize) {
        let (across, down) = self.sampling();
        (self.width.div_ceil(8 * across), self.height.div_ceil(8 * down))
    }

    /// Every bit of every coefficient has come.
    pub(super) fn is_complete(&self) -> bool {
        self.components.iter().all(|component| component.lowest.iter().all(|lowest| *lowest == 0))
    }

    /// Walks one scan.
    pub(super) fn walk(&mut self, scan: &Scan<'_>, bytes: &[u8], restart_interval: usize) -> Result<(), &'static str> {
        let (most_across, most_down) = self.sampling();
        // A scan of one component has only the blocks that the picture reaches; one of several, whole units.
        let (units_across, units_down, alone) = match &scan.parts[..] {
            [part] => {
                let component = &self.components[part.index];
                let blocks = |side: usize, factor: usize, most: usize| (side * factor).div_ceil(most).div_ceil(8);
                let across = blocks(self.width, component.across, most_across);
                (across, blocks(self.height, component.down, most_down), true)
            }
            _ => {
                let (across, down) = self.units();
                (across, down, false)
            }
        };
        let mut bits = Bits::new(bytes);
        let mut end_of_band_run = 0;
        let mut restarts = 0;
        for unit in 0..units_across * units_down {
            if restart_interval > 0 && unit > 0 && unit % restart_interval == 0 {
                bits.restart(restarts)?;
                (restarts, end_of_band_run) = (restarts + 1, 0);
            }
            let (unit_x, unit_y) = (unit % units_across, unit / units_across);
            for part in &scan.parts {
                let component = &mut self.components[part.index];
                let (across, down) = if alone { (1, 1) } else { (component.across, component.down) };
                for (y, x) in (0..down).flat_map(|y| (0..across).map(move |x| (y, x))) {
                    if self.progressive {
                        let block = (unit_y * down + y) * component.columns + unit_x * across + x;
                        let nonzero = component.nonzero.get_mut(block).ok_or(CODE)?;
                        walk_progressive(&mut bits, scan, part, nonzero, &mut end_of_band_run)?;
                    } else {
                        walk_sequential(&mut bits, part)?;
                    }
                }
            }
        }
        if !bits.is_spent() {
            return Err("a scan has more data than its picture");
        }
        for part in &scan.parts {
            self.components[part.index].lowest[scan.start..=scan.end].fill(scan.low);
        }
        Ok(())
    }
}

fn walk_sequential(bits: &mut Bits<'_>, part: &Part<'_>) -> Result<(), &'static str> {
    let (dc, ac) = (part.dc.ok_or(CODE)?, part.ac.ok_or(CODE)?);
    let size = bits.code(dc)?;
    bits.bits(size.into())?;
    let mut k = 1;
    while k < 64 {
        let code = bits.code(ac)?;
        let (zeros, size) = (usize::from(code >> 4), u32::from(code & 15));
        match (zeros, size) {
            (15, 0) => k += 16,
            (_, 0) => break,
            _ => {
                k += zeros + 1;
                bits.bits(size)?;
            }
        }
        if k > 64 {
            return Err("a block has more than 64 coefficients");
        }
    }
    Ok(())
}

fn walk_progressive(
    bits: &mut Bits<'_>,
    scan: &Scan<'_>,
    part: &Part<'_>,
    nonzero: &mut u64,
    run: &mut u32,
) -> Result<(), &'static str> {
    match (scan.start, scan.high) {
        (0, 0) => {
            let size = bits.code(part.dc.ok_or(CODE)?)?;
            bits.bits(size.into())?;
        }
        (0, _) => {
            bits.bit()?;
        }
        (_, 0) => walk_first(bits, scan, part.ac.ok_or(CODE)?, nonzero, run)?,
        _ => walk_refinement(bits, scan, part.ac.ok_or(CODE)?, nonzero, run)?,
    }
    Ok(())
}

/// First bits of AC coefficients (G.1.2.2).
fn walk_first(bits: &mut Bits<'_>, scan: &Scan<'_>, ac: &Table, nonzero: &mut u64, run: &mut u32) -> Result<(), &'static str> {
    if *run > 0 {
        *run -= 1;
        return Ok(());
    }
    let mut k = scan.start;
    while k <= scan.end {
        let code = bits.code(ac)?;
        let (zeros, size) = (code >> 4, u32::from(code & 15));
        if size == 0 && zeros < 15 {
            *run = (1 << zeros) - 1 + bits.bits(zeros.into())?;
            break;
        }
        k += usize::from(zeros);
        if size > 0 {
            if k > scan.end {
                return Err("a block has more than 64 coefficients");
            }
            bits.bits(size)?;
            *nonzero |= 1 << k;
        }
        k += 1;
    }
    Ok(())
}

/// One more bit of AC coefficients (G.1.2.3): those that are not zero get a bit each wherever they are passed.
fn walk_refinement(
    bits: &mut Bits<'_>,
    scan: &Scan<'_>,
    ac: &Table,
    nonzero: &mut u64,
    run: &mut u32,
) -> Result<(), &'static str> {
    let mut k = scan.start;
    while *run == 0 && k <= scan.end {
        let code = bits.code(ac)?;
        let (mut zeros, size) = (code >> 4, code & 15);
        match size {
            0 if zeros < 15 => {
                *run = (1 << zeros) + bits.bits(zeros.into())?;
                break;
            }
            0 => {}
            1 => {
                bits.bit()?;
            }
            _ => return Err(CODE),
        }
        while k <= scan.end {
            if *nonzero & (1 << k) != 0 {
                bits.bit()?;
            } else if zeros == 0 {
                break;
            } else {
                zeros -= 1;
            }
            k += 1;
        }
        if size == 1 {
            if k > scan.end {
                return Err("a block has more than 64 coefficients");
            }
            *nonzero |= 1 << k;
        }
        k += 1;
    }
    if *run > 0 {
        for k in k..=scan.end {
            if *nonzero & (1 << k) != 0 {
                bits.bit()?;
            }
        }
        *run -= 1;
    }
    Ok(())
}
