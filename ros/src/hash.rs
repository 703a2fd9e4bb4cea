//! Hashes of message types: RIHS01 of REP 2011, by which ROS 2 since Iron compares types.

use sha2::{Digest, Sha256};

use crate::description::{BaseType, FieldSpec, MessageType, Shape};

/// Returns the hash of a type: `RIHS01_` and 64 hexadecimal digits. The hash covers names and types of all fields,
/// including those within other types.
#[must_use]
pub fn type_hash(message: &MessageType) -> String {
    let digest = Sha256::digest(description(message));
    let digits: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("RIHS01_{digits}")
}

/// Returns the text under the hash: a `type_description_interfaces/msg/TypeDescription` as JSON. Names contain no
/// characters that JSON escapes.
fn description(message: &MessageType) -> String {
    let mut referenced = message.referenced();
    referenced.sort_by_key(|message| message.name);
    let referenced: Vec<String> = referenced.into_iter().map(individual).collect();
    format!(
        r#"{{"type_description": {}, "referenced_type_descriptions": [{}]}}"#,
        individual(message),
        referenced.join(", ")
    )
}

fn individual(message: &MessageType) -> String {
    let fields: Vec<String> = message.fields.iter().map(field).collect();
    format!(
        r#"{{"type_name": "{}", "fields": [{}]}}"#,
        message.name,
        fields.join(", ")
    )
}

fn field(field: &FieldSpec) -> String {
    let (shape, capacity) = match field.of.shape {
        Shape::Single => (0, 0),
        Shape::Array(length) => (48, length),
        Shape::Bounded(length) => (96, length),
        Shape::Sequence => (144, 0),
    };
    let (base, nested) = match field.of.base {
        BaseType::Message(message) => (1, message.name),
        BaseType::Int8 => (2, ""),
        BaseType::Uint8 => (3, ""),
        BaseType::Int32 => (6, ""),
        BaseType::Uint32 => (7, ""),
        BaseType::Int64 => (8, ""),
        BaseType::Float32 => (10, ""),
        BaseType::Float64 => (11, ""),
        BaseType::Bool => (15, ""),
        BaseType::Byte => (16, ""),
        BaseType::String => (17, ""),
    };
    format!(
        r#"{{"name": "{}", "type": {{"type_id": {}, "capacity": {capacity}, "string_capacity": 0, "nested_type_name": "{nested}"}}}}"#,
        field.name,
        shape + base
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Message;
    use crate::messages::{
        DiagnosticArray, LaserScan, MarkerArray, OccupancyGrid, Odometry, PointCloud2,
        StringMessage, TfMessage, Twist, TwistStamped,
    };

    /// Hashes of the Python package `rosbags` 0.11 for ROS 2 Humble to Kilted.
    #[test]
    fn hashes_are_those_of_ros() {
        for (message, expected) in [
            (
                StringMessage::MESSAGE,
                "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
            ),
            (
                TfMessage::MESSAGE,
                "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
            ),
            (
                Odometry::MESSAGE,
                "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
            ),
            (
                OccupancyGrid::MESSAGE,
                "8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7",
            ),
            (
                LaserScan::MESSAGE,
                "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828",
            ),
            (
                PointCloud2::MESSAGE,
                "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
            ),
            (
                MarkerArray::MESSAGE,
                "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
            ),
            (
                Twist::MESSAGE,
                "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
            ),
            (
                TwistStamped::MESSAGE,
                "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
            ),
            (
                DiagnosticArray::MESSAGE,
                "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
            ),
        ] {
            assert_eq!(type_hash(message), format!("RIHS01_{expected}"));
        }
    }
}
