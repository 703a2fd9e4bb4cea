//! Topics with messages of one type each, in a file or at subscribers.

use std::marker::PhantomData;

use anyhow::Context;
use foxglove::{Encode, Schema};
use scenario::time::SimTime;

/// A destination of messages, to which topics are added before their first message.
pub trait Topics {
    /// Adds a topic whose messages are encoded elsewhere. Returns its channel id.
    ///
    /// # Errors
    /// Returns the errors of the destination, or an error for more than 65 535 topics.
    fn add(&mut self, topic: &str, schema: &Schema, encoding: &str) -> anyhow::Result<u16>;
}

/// A topic with its message type.
pub struct Channel<M> {
    id: u16,
    messages: PhantomData<fn(M)>,
}

/// An encoded message with its time and its topic.
#[derive(Clone, Debug)]
pub struct Message {
    pub at: SimTime,
    pub channel: u16,
    pub bytes: Vec<u8>,
}

impl dyn Topics + '_ {
    /// Adds a topic with its message type.
    pub(super) fn channel<M: Encode>(&mut self, topic: &str) -> anyhow::Result<Channel<M>> {
        let schema = M::get_schema().context("a message type without schema")?;
        Ok(Channel {
            id: self.add(topic, &schema, &M::get_message_encoding())?,
            messages: PhantomData,
        })
    }
}

impl Message {
    /// Returns the simulated time in ns.
    #[must_use]
    pub fn time_ns(&self) -> u64 {
        nanoseconds(self.at)
    }
}

/// Converts a simulated time to ns.
#[must_use]
pub fn nanoseconds(time: SimTime) -> u64 {
    time.0.saturating_mul(1_000_000)
}

impl<M: Encode> Channel<M> {
    /// Encodes a message for this topic.
    pub fn message(&self, at: SimTime, message: &M) -> Message {
        let mut bytes = Vec::with_capacity(message.encoded_len().unwrap_or(0));
        message
            .encode(&mut bytes)
            // Encoding fails only for lack of space, and a `Vec` grows.
            .expect("a message can be encoded");
        Message {
            at,
            channel: self.id,
            bytes,
        }
    }
}
