//! An MCAP file: topics with messages of one type each.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use ::mcap::records::{MessageHeader, Metadata};
use ::mcap::{Compression, WriteOptions, Writer};
use foxglove::Schema;

use crate::foxglove_messages::{Message, Topics};

/// An MCAP file during writing. The writer of the foxglove crate ignores the errors of a full disk. Messages are
/// therefore encoded by foxglove and written by the mcap crate.
pub struct Recording<'f> {
    writer: Writer<&'f mut dyn File>,
    /// The number of messages per channel.
    counts: BTreeMap<u16, u32>,
}

/// The target of a recording.
pub trait File: Write + Seek {}

impl<W: Write + Seek> File for W {}

impl<'f> Recording<'f> {
    pub fn new(file: &'f mut dyn File) -> anyhow::Result<Self> {
        let options = WriteOptions::new().compression(Some(Compression::Lz4));
        Ok(Self {
            writer: options.create(file)?,
            counts: BTreeMap::new(),
        })
    }

    /// Adds a record of facts about the whole file.
    pub fn write_metadata(
        &mut self,
        name: &str,
        metadata: BTreeMap<String, String>,
    ) -> anyhow::Result<()> {
        let name = name.to_owned();
        self.writer.write_metadata(&Metadata { name, metadata })?;
        Ok(())
    }

    pub fn write(&mut self, message: &Message) -> anyhow::Result<()> {
        let count = self.counts.entry(message.channel).or_default();
        *count = count.wrapping_add(1);
        let time_ns = message.time_ns();
        let header = MessageHeader {
            channel_id: message.channel,
            sequence: *count,
            log_time: time_ns,
            publish_time: time_ns,
        };
        self.writer
            .write_to_known_channel(&header, &message.bytes)?;
        Ok(())
    }

    /// Writes the index and closes the file.
    pub fn finish(mut self) -> anyhow::Result<()> {
        self.writer.finish()?;
        self.writer.into_inner().flush()?;
        Ok(())
    }
}

impl Topics for Recording<'_> {
    fn add(&mut self, topic: &str, schema: &Schema, encoding: &str) -> anyhow::Result<u16> {
        let writer = &mut self.writer;
        let schema = writer.add_schema(&schema.name, &schema.encoding, &schema.data)?;
        Ok(writer.add_channel(schema, topic, encoding, &BTreeMap::new())?)
    }
}
