//! Writes PNGs of every sort, compressed by nothing but the rules: stored deflate blocks.

/// One chunk with its length and check sum.
pub(crate) fn chunk(name: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let body = [name.as_slice(), data].concat();
    [&(data.len() as u32).to_be_bytes(), &body[..], &crc(&body).to_be_bytes()].concat()
}

fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| if sum & 1 == 1 { 0xedb8_8320 ^ (sum >> 1) } else { sum >> 1 })
    })
}

/// A zlib stream that stores `data`.
pub(crate) fn zlib(data: &[u8]) -> Vec<u8> {
    let mut out = vec![0x78, 0x01];
    let blocks: Vec<&[u8]> = data.chunks(65535).collect();
    for (i, block) in blocks.iter().enumerate() {
        let length = block.len() as u16;
        out.push(u8::from(i + 1 == blocks.len()));
        out.extend(length.to_le_bytes());
        out.extend((!length).to_le_bytes());
        out.extend(*block);
    }
    let (a, b) = data.iter().fold((1_u32, 0_u32), |(a, b), byte| {
        let a = (a + u32::from(*byte)) % 65521;
        (a, (b + a) % 65521)
    });
    out.extend(((b << 16) | a).to_be_bytes());
    out
}

/// IHDR for these sides, bits a channel and colour type (0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGB and alpha).
pub(crate) fn header(width: u32, height: u32, bits: u8, colour: u8) -> Vec<u8> {
    let mut data = [width.to_be_bytes(), height.to_be_bytes()].concat();
    data.extend([bits, colour, 0, 0, 0]);
    chunk(b"IHDR", &data)
}

/// A whole PNG: `rows` are the bytes of each row, `between` are chunks between header and pixels.
pub(crate) fn png(width: u32, bits: u8, colour: u8, between: &[u8], rows: &[&[u8]]) -> Vec<u8> {
    let raw: Vec<u8> = rows.iter().flat_map(|row| [&[0], *row].concat()).collect();
    let signature = b"\x89PNG\r\n\x1a\n".as_slice();
    [signature, &header(width, rows.len() as u32, bits, colour), between, &chunk(b"IDAT", &zlib(&raw)), &chunk(b"IEND", b"")]
        .concat()
}
