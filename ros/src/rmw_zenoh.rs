//! The wire of `rmw_zenoh`, with which ROS 2 uses zenoh: keys of topics, liveliness tokens of the graph, and attachments
//! of messages (ros2/rmw_zenoh, docs/design.md).

use xxhash_rust::xxh3::xxh3_128;

use crate::description::MessageType;
use crate::hash::type_hash;
use crate::qos::Qos;

/// The number of messages that a publisher keeps if its token names none.
const DEFAULT_DEPTH: u32 = 42;

/// The size of an attachment, bytes.
const ATTACHMENT_BYTES: usize = 33;

/// The replacement for slashes in a part of a token.
const SLASH: &str = "%";

/// A node of ROS with the root namespace and the default enclave.
#[derive(Clone, Debug)]
pub struct Node {
    /// The domain, by which ROS separates systems on one network.
    pub domain: u8,
    /// The id of the zenoh session, as zenoh writes it.
    pub session: String,
    /// The name, which ROS accepts.
    pub name: &'static str,
}

/// The id of a publisher or a subscriber.
pub type EndpointId = [u8; 16];

/// A publisher or a subscriber of a node.
#[derive(Clone, Debug)]
pub struct Endpoint {
    /// The key of its messages.
    pub key: String,
    /// The key of its liveliness token.
    pub token: String,
    /// The id within the ROS graph: a hash of the token.
    pub id: EndpointId,
}

impl Node {
    /// Returns the key of the node's liveliness token.
    #[must_use]
    pub fn token(&self) -> String {
        self.entity(0, "NN")
    }

    /// Creates a publisher. `number` is different for each endpoint of the node, and above 0.
    #[must_use]
    pub fn publisher(
        &self,
        number: usize,
        topic: &str,
        message: &MessageType,
        qos: Qos,
    ) -> Endpoint {
        self.endpoint(number, "MP", topic, message, qos)
    }

    /// Creates a subscriber. `number` is different for each endpoint of the node, and above 0.
    #[must_use]
    pub fn subscriber(
        &self,
        number: usize,
        topic: &str,
        message: &MessageType,
        qos: Qos,
    ) -> Endpoint {
        self.endpoint(number, "MS", topic, message, qos)
    }

    /// Creates the server of a service, whose requests are queries for its key. `number` is as for a publisher.
    #[must_use]
    pub fn service(&self, number: usize, name: &str, service: &MessageType) -> Endpoint {
        self.endpoint(number, "SS", name, service, Qos::Stream)
    }

    fn endpoint(
        &self,
        number: usize,
        entity: &str,
        topic: &str,
        message: &MessageType,
        qos: Qos,
    ) -> Endpoint {
        let (kind, hash) = (dds_name(message), type_hash(message));
        let key = format!(
            "{}/{}/{kind}/{hash}",
            self.domain,
            topic.trim_start_matches('/')
        );
        let token = format!(
            "{}/{}/{kind}/{hash}/{}",
            self.entity(number, entity),
            topic.replace('/', SLASH),
            policies(qos)
        );
        Endpoint {
            key,
            id: xxh3_128(token.as_bytes()).to_le_bytes(),
            token,
        }
    }

    fn entity(&self, number: usize, kind: &str) -> String {
        let Self {
            domain,
            session,
            name,
        } = self;
        format!("@ros2_lv/{domain}/{session}/0/{number}/{kind}/{SLASH}/{SLASH}/{name}")
    }
}

impl Endpoint {
    /// Returns the attachment of a message: its sequence number from 1, its time in ns, and the id of the publisher with
    /// its length.
    #[must_use]
    pub fn attachment(&self, sequence: i64, time_ns: i64) -> [u8; ATTACHMENT_BYTES] {
        let mut bytes = [0; ATTACHMENT_BYTES];
        bytes[..8].copy_from_slice(&sequence.to_le_bytes());
        bytes[8..16].copy_from_slice(&time_ns.to_le_bytes());
        bytes[16] = self.id.len() as u8;
        bytes[17..].copy_from_slice(&self.id);
        bytes
    }
}

/// Returns the attachment of a response: that of the request with the time of the response, ns. `None` if the request has
/// none, because ROS programs cannot read a response without.
#[must_use]
pub fn response_attachment(request: &[u8], time_ns: i64) -> Option<Vec<u8>> {
    publisher_of(request)?;
    let mut bytes = request.to_vec();
    bytes[8..16].copy_from_slice(&time_ns.to_le_bytes());
    Some(bytes)
}

/// Returns the id of the publisher in an attachment; `None` for bytes that do not have its form: 33 bytes, with the length
/// of the id in its place.
#[must_use]
pub fn publisher_of(attachment: &[u8]) -> Option<EndpointId> {
    let id = attachment.get(17..)?.try_into().ok()?;
    (usize::from(attachment[16]) == size_of::<EndpointId>()).then_some(id)
}

/// Returns the name of a type as DDS has it, such as `std_msgs::msg::dds_::Header_`.
fn dds_name(message: &MessageType) -> String {
    let (package, name) = message.name.rsplit_once('/').unwrap_or_default();
    format!("{}::dds_::{name}_", package.replace('/', "::"))
}

/// Returns the quality of service in a token: reliability, durability, history and depth, deadline, lifespan and
/// liveliness. A value is empty if it is the default.
fn policies(qos: Qos) -> String {
    let durability = match qos {
        Qos::Stream => String::new(),
        Qos::Latched => qos.durability().to_string(),
    };
    let depth = match qos.depth() {
        DEFAULT_DEPTH => String::new(),
        depth => depth.to_string(),
    };
    format!(":{durability}:,{depth}:,:,:,,")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Message;
    use crate::messages::{StringMessage, TfMessage};
    use crate::services::TRIGGER;

    const NODE: Node = Node {
        domain: 2,
        session: String::new(),
        name: "alliance",
    };

    fn node() -> Node {
        let session = "aac3178e146ba6f1fc6e6a4085e77f21".to_owned();
        Node { session, ..NODE }
    }

    #[test]
    fn keys_and_tokens_are_those_of_the_design() {
        let hash = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18";
        let node = node();
        let start = "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0";
        assert_eq!(node.token(), format!("{start}/0/NN/%/%/alliance"));
        let chatter = node.publisher(10, "/blue/chatter", StringMessage::MESSAGE, Qos::Stream);
        let kind = "std_msgs::msg::dds_::String_";
        assert_eq!(chatter.key, format!("2/blue/chatter/{kind}/{hash}"));
        assert_eq!(
            chatter.token,
            format!("{start}/10/MP/%/%/alliance/%blue%chatter/{kind}/{hash}/::,10:,:,:,,")
        );
        let subscriber = node.subscriber(10, "/blue/chatter", StringMessage::MESSAGE, Qos::Stream);
        assert_eq!(subscriber.key, chatter.key);
        assert_eq!(subscriber.token, chatter.token.replace("/MP/", "/MS/"));
        let pause = node.service(12, "/alliance/pause", TRIGGER);
        let kind = "std_srvs::srv::dds_::Trigger_";
        assert!(
            pause
                .key
                .starts_with(&format!("2/alliance/pause/{kind}/RIHS01_eeff"))
        );
        let rest = format!("/12/SS/%/%/alliance/%alliance%pause/{kind}/RIHS01_eeff");
        assert!(pause.token.starts_with(&format!("{start}{rest}")));
        let fixed = node.publisher(11, "/tf_static", TfMessage::MESSAGE, Qos::Latched);
        assert!(fixed.token.ends_with("/:1:,1:,:,:,,"), "{}", fixed.token);
    }

    #[test]
    fn an_attachment_has_33_bytes() {
        let publisher = node().publisher(1, "/chatter", StringMessage::MESSAGE, Qos::Stream);
        let bytes = publisher.attachment(0x0102, 50_000_001);
        assert_eq!(bytes[..8], [2, 1, 0, 0, 0, 0, 0, 0]);
        assert_eq!(bytes[8..16], 50_000_001_i64.to_le_bytes());
        assert_eq!(bytes[16], 16);
        assert_eq!(publisher_of(&bytes), Some(publisher.id));
        let response = response_attachment(&bytes, 60_000_001).unwrap();
        assert_eq!(response, publisher.attachment(0x0102, 60_000_001));
        for wrong in [&bytes[..32], &[&bytes[..], &[0]].concat(), &[0; 33], &[]] {
            assert_eq!(publisher_of(wrong), None);
            assert_eq!(response_attachment(wrong, 0), None);
        }
        assert_eq!(
            bytes[17..],
            xxh3_128(publisher.token.as_bytes()).to_le_bytes()
        );
    }
}
