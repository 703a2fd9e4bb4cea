//! Kinds of notes that robots of the clean-up write.

use alliance_proto::telemetry::NoteKind;

/// Broadcast a PositionUpdate.
pub const POSITION_UPDATE: NoteKind = NoteKind::Mission(0);
/// Took locations over from a teammate.
pub const LOCATIONS_LEARNED: NoteKind = NoteKind::Mission(1);
/// Found the locations to be wrong and withdrew them.
pub const LOCATIONS_WITHDRAWN: NoteKind = NoteKind::Mission(2);
/// Believes a spill to be empty.
pub const SPILL_EMPTY: NoteKind = NoteKind::Mission(3);
/// Put down what it carried because its behavior set hibernated.
pub const PUT_DOWN: NoteKind = NoteKind::Mission(4);

/// Their names, in their order.
pub(super) const NAMES: [&str; 5] = [
    "position-update",
    "locations-learned",
    "locations-withdrawn",
    "spill-empty",
    "put-down",
];
