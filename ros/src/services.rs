//! The service type that a team offers. ROS describes a service as a type whose fields are its request, its response and
//! the event that tools may record. No value of that type exists.

use crate::description::{BaseType, FieldSpec, FieldType, MessageType, Shape};
use crate::message::Message;
use crate::messages::{Time, TriggerRequest, TriggerResponse};

/// The type `std_srvs/srv/Trigger`: a request without content.
pub const TRIGGER: &MessageType = &MessageType {
    name: "std_srvs/srv/Trigger",
    constants: &[],
    fields: &[
        message("request_message", Shape::Single, TriggerRequest::MESSAGE),
        message("response_message", Shape::Single, TriggerResponse::MESSAGE),
        message("event_message", Shape::Single, EVENT),
    ],
};

const EVENT: &MessageType = &MessageType {
    name: "std_srvs/srv/Trigger_Event",
    constants: &[],
    fields: &[
        message("info", Shape::Single, EVENT_INFO),
        message("request", Shape::Bounded(1), TriggerRequest::MESSAGE),
        message("response", Shape::Bounded(1), TriggerResponse::MESSAGE),
    ],
};

const EVENT_INFO: &MessageType = &MessageType {
    name: "service_msgs/msg/ServiceEventInfo",
    constants: &[],
    fields: &[
        field("event_type", BaseType::Uint8, Shape::Single),
        message("stamp", Shape::Single, Time::MESSAGE),
        field("client_gid", BaseType::Uint8, Shape::Array(16)),
        field("sequence_number", BaseType::Int64, Shape::Single),
    ],
};

const fn message(name: &'static str, shape: Shape, of: &'static MessageType) -> FieldSpec {
    field(name, BaseType::Message(of), shape)
}

const fn field(name: &'static str, base: BaseType, shape: Shape) -> FieldSpec {
    let of = FieldType { base, shape };
    FieldSpec { name, of }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::type_hash;

    /// The hash in public programs for ROS 2 Jazzy, for example in the firmware RaftROS.
    #[test]
    fn the_hash_of_a_service_is_that_of_ros() {
        let expected = "eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f";
        assert_eq!(type_hash(TRIGGER), format!("RIHS01_{expected}"));
    }
}
