//! Quality of service of topics.

/// The quality of service that a publisher offers. Both kinds are reliable, so every subscriber is compatible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Qos {
    /// A stream of messages. Late subscribers receive only new messages.
    Stream,
    /// A state. Late subscribers receive the latest message (`transient_local`).
    Latched,
}

impl Qos {
    /// Returns the number of messages that a publisher keeps.
    #[must_use]
    pub fn depth(self) -> u32 {
        match self {
            Self::Stream => 10,
            Self::Latched => 1,
        }
    }

    /// Returns the durability as its number in `rmw`: 1 is transient local, 2 is volatile.
    #[must_use]
    pub fn durability(self) -> u32 {
        match self {
            Self::Stream => 2,
            Self::Latched => 1,
        }
    }
}
