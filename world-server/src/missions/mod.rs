//! The missions that there are.

pub mod waste;

use alliance_proto::scenario::Scenario;

use crate::mission::MissionKind;

/// The mission of a scenario.
#[must_use]
pub fn of(_scenario: &Scenario) -> &'static MissionKind {
    &waste::WASTE
}
