//! Samples to MCAP, on any sink.

use std::collections::{BTreeMap, HashMap};
use std::io::{Seek, Write};

use halcyon_model::{Bytes, Stamp};
use mcap::records::{MessageHeader, Metadata};

/// Keys in one file; more are refused. MCAP has 65535.
const CHANNELS_MAX: usize = 16_384;
/// Uncompressed bytes after which a chunk ends even between flushes.
const CHUNK_BYTES: u64 = 1 << 20;

/// One message as it came over the bus.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Full key.
    pub key: String,
    /// Encoding as the bus names it, such as `application/protobuf;halcyon.v1.SeaState`.
    pub encoding: String,
    /// Payload.
    pub payload: Bytes,
    /// When it arrived, fleet time.
    pub received: Stamp,
}

/// A sample was not recorded.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// There are too many keys in this file.
    #[error("{key} is one key more than the {CHANNELS_MAX} that fit into one recording")]
    TooManyKeys {
        /// The key.
        key: String,
    },
    /// The sink failed.
    #[error("the recording could not be written")]
    Write(#[from] mcap::McapError),
}

/// A recording being written.
pub struct Recording<W: Write + Seek> {
    writer: mcap::Writer<W>,
    /// Channel and next sequence number by key and encoding.
    channels: HashMap<(String, String), (u16, u32)>,
    schemas: &'static [u8],
    messages: u64,
    bytes: u64,
}

impl<W: Write + Seek> Recording<W> {
    /// Begins a recording. `schemas` is an encoded `FileDescriptorSet` of the messages; `about` goes into the file's metadata.
    ///
    /// # Errors
    /// [`RecordError::Write`].
    pub fn new(sink: W, schemas: &'static [u8], about: BTreeMap<String, String>) -> Result<Self, RecordError> {
        let mut writer = mcap::WriteOptions::new()
            .library(concat!("halcyon-recorder ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK_BYTES))
            // The recorder shares its processor with what it records.
            .compression_level(1)
            .compression_threads(0)
            .create(sink)?;
        writer.write_metadata(&Metadata { name: "halcyon".into(), metadata: about })?;
        Ok(Self { writer, channels: HashMap::new(), schemas, messages: 0, bytes: 0 })
    }

    /// Adds a sample.
    ///
    /// # Errors
    /// [`RecordError`]. After [`RecordError::Write`] the recording is broken.
    pub fn add(&mut self, sample: &Sample) -> Result<(), RecordError> {
        let (channel_id, sequence) = self.channel(sample)?;
        // MCAP's times begin at the epoch.
        let stamp_ns = u64::try_from(sample.received.as_nanos()).unwrap_or(0);
        let header = MessageHeader { channel_id, sequence, log_time: stamp_ns, publish_time: stamp_ns };
        self.writer.write_to_known_channel(&header, &sample.payload)?;
        self.messages += 1;
        self.bytes += sample.payload.len() as u64;
        Ok(())
    }

    fn channel(&mut self, sample: &Sample) -> Result<(u16, u32), RecordError> {
        let name = (sample.key.clone(), sample.encoding.clone());
        if let Some((id, sequence)) = self.channels.get_mut(&name) {
            *sequence = sequence.wrapping_add(1);
            return Ok((*id, *sequence));
        }
        if self.channels.len() >= CHANNELS_MAX {
            return Err(RecordError::TooManyKeys { key: sample.key.clone() });
        }
        let metadata = BTreeMap::from([("encoding".to_owned(), sample.encoding.clone())]);
        let (schema, encoding) = match sample.encoding.split_once(';') {
            Some(("application/protobuf", name)) if name.starts_with("halcyon.v1.") => {
                (self.writer.add_schema(name, "protobuf", self.schemas)?, "protobuf")
            }
            // Kept as it is; only its reader knows what it means.
            _ => (0, ""),
        };
        let id = self.writer.add_channel(schema, &sample.key, encoding, &metadata)?;
        self.channels.insert(name, (id, 0));
        Ok((id, 0))
    }

    /// Messages so far.
    pub fn messages(&self) -> u64 {
        self.messages
    }

    /// Payload so far, bytes, before compression.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Ends the chunk, so that what was added can be read from the sink as it is now.
    ///
    /// # Errors
    /// [`RecordError::Write`].
    pub fn flush(&mut self) -> Result<(), RecordError> {
        Ok(self.writer.flush()?)
    }

    /// Writes the index and gives the sink back.
    ///
    /// # Errors
    /// [`RecordError::Write`].
    pub fn finish(mut self) -> Result<W, RecordError> {
        self.writer.finish()?;
        Ok(self.writer.into_inner())
    }
}
