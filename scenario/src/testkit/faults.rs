//! Faults for tests.

use crate::fault::{Fault, FaultKind, MissionFault};

/// Returns the examples of a fault.
#[must_use]
pub fn examples_of(kind: &FaultKind) -> Vec<Fault> {
    let examples = kind.examples.iter();
    examples
        // Examples are constants in this crate, so a malformed one is a programming error.
        .map(|(json, _)| serde_json::from_str(json).expect("an example is a fault"))
        .collect()
}

/// Returns one fault of each kind, with every mode.
#[must_use]
pub fn one_of_each() -> Vec<Fault> {
    let of_mission = Fault::Mission(MissionFault::new(
        "shake",
        &[("x_m", 3.0), ("y_m", 4.5), ("times", 2.0)],
    ));
    let common = Fault::KINDS.into_iter().flat_map(examples_of);
    common.chain([of_mission]).collect()
}
