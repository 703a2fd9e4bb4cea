//! The text of metadata.yaml (rosbag2_storage, version 8: the latest one that ROS 2 Humble can also read).

use std::collections::BTreeMap;
use std::fmt::Write;

use ros::Qos;
use serde_json::Value;

/// The encoding of messages, as bags and MCAP files name it.
pub const ENCODING: &str = "cdr";

/// The facts about a bag.
pub struct BagFacts<'b> {
    /// The name of the MCAP file.
    pub file: &'b str,
    /// The times of the first and the last message, ns.
    pub span_ns: (u64, u64),
    pub topics: &'b [TopicFacts],
    /// Facts about the run, by name.
    pub run: &'b BTreeMap<String, String>,
}

/// The facts about a topic.
pub struct TopicFacts {
    pub name: String,
    pub type_name: &'static str,
    pub type_hash: String,
    pub qos: Qos,
    /// The number of messages.
    pub count: u64,
}

/// Returns the text of metadata.yaml.
pub fn text(bag: &BagFacts<'_>) -> String {
    let (first, last) = bag.span_ns;
    let duration = last - first;
    let count: u64 = bag.topics.iter().map(|topic| topic.count).sum();
    let file = quoted(bag.file);
    let mut topics = String::new();
    for topic in bag.topics {
        topics += &topic_text(topic);
    }
    let mut run = String::new();
    for (key, value) in bag.run {
        let _ = writeln!(run, "    {}: {}", quoted(key), quoted(value));
    }
    format!(
        "rosbag2_bagfile_information:
  version: 8
  storage_identifier: mcap
  duration:
    nanoseconds: {duration}
  starting_time:
    nanoseconds_since_epoch: {first}
  message_count: {count}
  topics_with_message_count:
{topics}  compression_format: \"\"
  compression_mode: \"\"
  relative_file_paths:
    - {file}
  files:
    - path: {file}
      starting_time:
        nanoseconds_since_epoch: {first}
      duration:
        nanoseconds: {duration}
      message_count: {count}
  custom_data:
{run}  ros_distro: unknown
"
    )
}

fn topic_text(topic: &TopicFacts) -> String {
    format!(
        "    - topic_metadata:
        name: {}
        type: {}
        serialization_format: {ENCODING}
        offered_qos_profiles: {}
        type_description_hash: {}
      message_count: {}
",
        topic.name,
        topic.type_name,
        quoted(&qos_profiles(topic.qos)),
        topic.type_hash,
        topic.count
    )
}

/// Returns the quality of service that the publisher of a topic offers, as YAML: the numbers are those of `rmw`, and the
/// spans are unlimited.
pub fn qos_profiles(qos: Qos) -> String {
    let unlimited = "\n    sec: 9223372036\n    nsec: 854775807";
    // Keeps the last messages, reliably; the publisher's liveliness is automatic.
    format!(
        "- history: 1
  depth: {}
  reliability: 1
  durability: {}
  deadline:{unlimited}
  lifespan:{unlimited}
  liveliness: 1
  liveliness_lease_duration:{unlimited}
  avoid_ros_namespace_conventions: false",
        qos.depth(),
        qos.durability()
    )
}

/// Returns a text in double quotes. A text of JSON is one of YAML.
fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metadata_names_files_topics_and_run() {
        let topic = |name: &str, qos, count| TopicFacts {
            name: name.to_owned(),
            type_name: "rosgraph_msgs/msg/Clock",
            type_hash: "RIHS01_0".to_owned(),
            qos,
            count,
        };
        let bag = BagFacts {
            file: "a \"bag\"_0.mcap",
            span_ns: (1, 50_000_001),
            topics: &[
                topic("/clock", Qos::Stream, 2),
                topic("/map", Qos::Latched, 1),
            ],
            run: &[("seed".to_owned(), "1".to_owned())].into(),
        };
        insta::assert_snapshot!(text(&bag));
    }
}
