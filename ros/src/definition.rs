//! Definitions of message types as text, in the format `ros2msg` of MCAP files.

use crate::description::{MessageType, Shape};

/// The line between the types of a definition.
const SEPARATOR: &str =
    "================================================================================";

/// Returns the definition of a type, followed by those of all types that it contains.
#[must_use]
pub fn definition(message: &MessageType) -> String {
    let mut text = own_definition(message);
    for referenced in message.referenced() {
        text += &format!("{SEPARATOR}\nMSG: {}\n", referenced.short_name());
        text += &own_definition(referenced);
    }
    text
}

/// Returns the definition of a type without the types of its fields.
fn own_definition(message: &MessageType) -> String {
    let mut text = String::new();
    for constant in message.constants {
        let base = constant.base.name();
        text += &format!("{base} {}={}\n", constant.name, constant.value);
    }
    for field in message.fields {
        let base = field.of.base.name();
        let shape = match field.of.shape {
            Shape::Single => String::new(),
            Shape::Array(length) => format!("[{length}]"),
            Shape::Sequence => "[]".to_owned(),
            Shape::Bounded(length) => format!("[<={length}]"),
        };
        text += &format!("{base}{shape} {}\n", field.name);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Message;
    use crate::messages::{DiagnosticArray, PoseWithCovariance};

    #[test]
    fn a_definition_contains_each_type_once() {
        insta::assert_snapshot!(definition(DiagnosticArray::MESSAGE));
    }

    #[test]
    fn a_definition_names_the_length_of_an_array() {
        let text = definition(PoseWithCovariance::MESSAGE);
        assert!(text.starts_with("geometry_msgs/Pose pose\nfloat64[36] covariance\n===="));
    }
}
