//! MCAP to samples, from any source, in bounded memory, from a file that may have been cut off.

use std::collections::BTreeMap;
use std::io::Read;

use halcyon_model::{Bytes, Stamp};
use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::recording::Sample;

/// A record larger than this is no message of ours, but a damaged length.
const RECORD_BYTES_MAX: usize = 256 << 20;
/// Channels that are kept in mind.
const CHANNELS_MAX: usize = 65_536;

/// A recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The source failed.
    #[error("the recording could not be read")]
    Io(#[from] std::io::Error),
    /// The file is no MCAP, or is damaged. What came before is good.
    #[error("the recording is no MCAP file, or is damaged")]
    Format(#[from] McapError),
    /// A message of a channel that was not declared.
    #[error("the recording is damaged: channel {0} is used before it is declared")]
    UnknownChannel(u16),
}

/// What comes out of a recording.
#[derive(Debug, Clone, PartialEq)]
pub enum Recorded {
    /// A message.
    Sample(Sample),
    /// The end. `complete` is false for a file that was cut off, by a crash say.
    End {
        /// Whether the file was ended properly.
        complete: bool,
    },
}

/// A recording being read from its start.
pub struct Reading<R: Read> {
    source: R,
    reader: LinearReader,
    channels: BTreeMap<u16, (String, String)>,
    complete: bool,
}

impl<R: Read> Reading<R> {
    /// Begins to read.
    pub fn new(source: R) -> Self {
        let options = LinearReaderOptions::default().with_validate_chunk_crcs(true).with_record_length_limit(RECORD_BYTES_MAX);
        Self { source, reader: LinearReader::new_with_options(options), channels: BTreeMap::new(), complete: false }
    }

    /// The next message, or the end.
    ///
    /// # Errors
    /// [`ReadError`]; a file that merely ends too soon is no error.
    pub fn next_sample(&mut self) -> Result<Recorded, ReadError> {
        loop {
            let event = match self.reader.next_event() {
                None => return Ok(Recorded::End { complete: self.complete }),
                // Cut off in the middle of a record or a chunk: everything before that was given out.
                Some(Err(McapError::UnexpectedEof | McapError::UnexpectedEoc)) => return Ok(Recorded::End { complete: false }),
                Some(event) => event?,
            };
            match event {
                LinearReadEvent::ReadRequest(wanted) => {
                    let read = self.source.read(self.reader.insert(wanted))?;
                    self.reader.notify_read(read);
                }
                LinearReadEvent::Record { data, opcode } => match mcap::parse_record(opcode, data)? {
                    Record::Channel(channel) if self.channels.len() < CHANNELS_MAX => {
                        let encoding = channel.metadata.get("encoding").cloned().unwrap_or_default();
                        self.channels.insert(channel.id, (channel.topic, encoding));
                    }
                    Record::Message { header, data } => {
                        let channel = self.channels.get(&header.channel_id);
                        let (key, encoding) = channel.cloned().ok_or(ReadError::UnknownChannel(header.channel_id))?;
                        return Ok(Recorded::Sample(Sample {
                            key,
                            encoding,
                            payload: Bytes::from(data.into_owned()),
                            received: Stamp::from_nanos(i64::try_from(header.log_time).unwrap_or(i64::MAX)),
                        }));
                    }
                    Record::Footer(_) => self.complete = true,
                    _ => {}
                },
            }
        }
    }
}
