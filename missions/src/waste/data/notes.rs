//! The kinds of notes that robots of the clean-up write.

use proto::telemetry::NoteKind;

pub const POSITION_UPDATE: NoteKind = NoteKind::Mission(0);
/// The robot adopted locations from a teammate.
pub const LOCATIONS_LEARNED: NoteKind = NoteKind::Mission(1);
/// The robot found its locations wrong and withdrew them.
pub const LOCATIONS_WITHDRAWN: NoteKind = NoteKind::Mission(2);
/// The robot considers a spill empty.
pub const SPILL_EMPTY: NoteKind = NoteKind::Mission(3);
/// The robot put down its load because its behavior set hibernated.
pub const PUT_DOWN: NoteKind = NoteKind::Mission(4);

pub(super) const NAMES: [&str; 5] = [
    "position-update",
    "locations-learned",
    "locations-withdrawn",
    "spill-empty",
    "put-down",
];
