//! The destination of the messages of a run: a bag, or subscribers.

use std::marker::PhantomData;

use ros::{Message, MessageType, Qos, encode};
use scenario::time::SimTime;

use super::convert::nanoseconds;

/// A topic before its first message.
pub struct TopicSpec {
    pub name: String,
    pub message: &'static MessageType,
    pub qos: Qos,
}

/// A destination of encoded messages.
pub trait Destination {
    /// Adds a topic and returns its number.
    ///
    /// # Errors
    /// Returns the errors of the destination.
    fn add(&mut self, topic: TopicSpec) -> anyhow::Result<usize>;

    /// Takes a message of a topic, with its simulated time in ns. Times never decrease, except for sensor readings, which
    /// are one tick older.
    ///
    /// # Errors
    /// Returns the errors of the destination.
    fn put(&mut self, topic: usize, time_ns: u64, message: Vec<u8>) -> anyhow::Result<()>;
}

/// A topic with its message type.
pub struct Topic<M> {
    /// The number at the destination.
    number: usize,
    messages: PhantomData<fn(M)>,
}

impl dyn Destination + '_ {
    /// Adds a topic with its message type.
    pub(super) fn topic<M: Message>(
        &mut self,
        name: impl Into<String>,
        qos: Qos,
    ) -> anyhow::Result<Topic<M>> {
        let number = self.add(TopicSpec {
            name: name.into(),
            message: M::MESSAGE,
            qos,
        })?;
        Ok(Topic {
            number,
            messages: PhantomData,
        })
    }

    /// Encodes a message and hands it over.
    pub(super) fn write<M: Message>(
        &mut self,
        topic: &Topic<M>,
        at: SimTime,
        message: &M,
    ) -> anyhow::Result<()> {
        self.put(topic.number, nanoseconds(at), encode(message))
    }
}
