//! Messages between allocators of different robots, with one file per allocator.
//!
//! - [`ble`], [`murdoch`], [`grape`], [`ssi`], [`dhba`]: the messages of the allocator with that name.
//! - [`consensus`]: the messages of CBAA, CBBA, ACBBA, PI and HIPC.
//! - [`awareness`]: the messages of HIPC beside its tables.

pub mod awareness;
pub mod ble;
pub mod consensus;
pub mod dhba;
pub mod grape;
pub mod murdoch;
mod short_list;
pub mod ssi;

use serde::{Deserialize, Serialize};

/// The size limit of an [`OpenMessage`], bytes.
pub const OPEN_MESSAGE_MAX: usize = 1200;

/// A message between allocators. All allocators share one broadcast kind: a link numbers its draws by kind, so all
/// allocators get the same losses. An allocator ignores messages of other allocators.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum AllocationMessage {
    /// A message of an allocator without its own variant here.
    Open(OpenMessage),
    Ble(ble::Eligibility),
    Murdoch(murdoch::Negotiation),
    Table(consensus::BidTable),
    Deltas(consensus::Deltas),
    Partition(grape::CoalitionPartition),
    Ssi(ssi::AuctionBid),
    Dhba(dhba::MatrixPart),
    /// The table of PI. The bid is the negative impact.
    Impacts(consensus::BidTable),
    Awareness(awareness::Awareness),
}

/// A message in the allocator's own encoding.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OpenMessage {
    /// The allocator and optionally the kind of message: `NAME` or `NAME/KIND`.
    pub schema: String,
    /// The encoded message, at most [`OPEN_MESSAGE_MAX`] bytes.
    pub bytes: Vec<u8>,
}
