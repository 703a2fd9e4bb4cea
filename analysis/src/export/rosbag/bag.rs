//! A bag during writing: an MCAP file in a temporary folder, which gets its name when it is complete.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use ::mcap::records::{MessageHeader, Metadata};
use ::mcap::{Compression, WriteOptions, Writer};
use anyhow::Context;
use ros::{definition, type_hash};
use tempfile::TempDir;

use super::metadata::{self, BagFacts, TopicFacts};
use crate::new_file::Output;
use crate::ros_messages::{Destination, TopicSpec};

pub struct Bag {
    writer: Writer<Output<File>>,
    topics: Vec<TopicFacts>,
    /// The channels of the topics in the file.
    channels: Vec<u16>,
    /// The times of the first and the last message, ns.
    span_ns: Option<(u64, u64)>,
    /// The folder that contains the unfinished bag. It is removed with its contents unless the bag is moved out.
    unfinished: TempDir,
    target: PathBuf,
}

impl Bag {
    /// Creates a bag for the path `target`, where nothing is.
    pub fn create(target: &Path) -> anyhow::Result<Self> {
        let parent = match target.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        let at = || format!("cannot write {}", target.display());
        // The error of a missing folder would name the temporary folder.
        fs::metadata(parent).with_context(at)?;
        let unfinished = tempfile::Builder::new()
            .prefix(".alliance-new-")
            .tempdir_in(parent)
            .with_context(at)?;
        let folder = folder_in(&unfinished);
        fs::create_dir(&folder).with_context(at)?;
        let file = File::create_new(folder.join(file_name(target))).with_context(at)?;
        let options = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .profile("ros2");
        Ok(Self {
            writer: options.create(Output::new(file, target))?,
            topics: Vec::new(),
            channels: Vec::new(),
            span_ns: None,
            unfinished,
            target: target.to_owned(),
        })
    }

    /// Closes the file, writes metadata.yaml with `facts`, and moves the folder to its path. `details` become a metadata
    /// record of the file.
    pub fn finish(
        mut self,
        facts: &BTreeMap<String, String>,
        details: BTreeMap<String, String>,
    ) -> anyhow::Result<()> {
        let at = || format!("cannot write {}", self.target.display());
        self.writer.write_metadata(&Metadata {
            name: "run".to_owned(),
            metadata: details,
        })?;
        self.writer.finish()?;
        self.writer.into_inner().flush()?;
        let text = metadata::text(&BagFacts {
            file: &file_name(&self.target),
            span_ns: self.span_ns.unwrap_or_default(),
            topics: &self.topics,
            run: facts,
        });
        let folder = folder_in(&self.unfinished);
        fs::write(folder.join("metadata.yaml"), text).with_context(at)?;
        fs::rename(folder, &self.target).with_context(at)
    }
}

impl Destination for Bag {
    /// Adds a topic. A file has at most 65 535 topics.
    fn add(&mut self, topic: TopicSpec) -> anyhow::Result<usize> {
        let facts = TopicFacts {
            name: topic.name,
            type_name: topic.message.name,
            type_hash: type_hash(topic.message),
            qos: topic.qos,
            count: 0,
        };
        let text = definition(topic.message);
        let writer = &mut self.writer;
        let schema = writer.add_schema(facts.type_name, "ros2msg", text.as_bytes())?;
        let details = [
            ("offered_qos_profiles", metadata::qos_profiles(facts.qos)),
            ("topic_type_hash", facts.type_hash.clone()),
        ];
        let details = details.map(|(key, value)| (key.to_owned(), value)).into();
        let channel = writer.add_channel(schema, &facts.name, metadata::ENCODING, &details)?;
        self.topics.push(facts);
        self.channels.push(channel);
        Ok(self.topics.len() - 1)
    }

    fn put(&mut self, topic: usize, time_ns: u64, message: Vec<u8>) -> anyhow::Result<()> {
        let count = &mut self.topics[topic].count;
        *count += 1;
        let header = MessageHeader {
            channel_id: self.channels[topic],
            // The sequence number of MCAP has 32 bits and wraps around.
            sequence: *count as u32,
            log_time: time_ns,
            publish_time: time_ns,
        };
        self.writer.write_to_known_channel(&header, &message)?;
        let (first, last) = self.span_ns.unwrap_or((time_ns, time_ns));
        self.span_ns = Some((first.min(time_ns), last.max(time_ns)));
        Ok(())
    }
}

/// Returns the folder of the bag within its temporary folder, which only its owner may read.
fn folder_in(unfinished: &TempDir) -> PathBuf {
    unfinished.path().join("bag")
}

/// Returns the file name that `ros2 bag record` gives to the first file of a bag.
fn file_name(target: &Path) -> String {
    let name = target.file_name().unwrap_or(target.as_os_str());
    format!("{}_0.mcap", name.to_string_lossy())
}
