//! What allocators tell each other: a file for the messages of each.
//!
//! - [`ble`], [`murdoch`], [`grape`]: of those.
//! - [`consensus`]: of CBAA, CBBA and ACBBA.

pub mod ble;
pub mod consensus;
mod few;
pub mod grape;
pub mod murdoch;

use serde::{Deserialize, Serialize};

/// Most bytes of an [`OpenMessage`].
pub const OPEN_MESSAGE_MAX: usize = 1200;

/// What an allocator tells the team. One kind for all of them: the draws of a link are numbered by kind, so the same losses fall on
/// each. An allocator ignores what is not its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum AllocationMessage {
    /// Of an allocator that has no place of its own here.
    Open(OpenMessage),
    /// Of BLE.
    Ble(ble::Eligibility),
    /// Of MURDOCH.
    Murdoch(murdoch::Negotiation),
    /// Of CBAA and CBBA.
    Table(consensus::Table),
    /// Of ACBBA.
    Deltas(consensus::Deltas),
    /// Of GRAPE.
    Partition(grape::Partition),
}

/// A message in an encoding of its allocator's own.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OpenMessage {
    /// Which allocator's, and which kind of message: `NAME` or `NAME/KIND`.
    pub schema: String,
    /// At most [`OPEN_MESSAGE_MAX`] bytes.
    pub bytes: Vec<u8>,
}
