//! Impaired skills. The mission's world applies them; the robot's controller receives no information about them.

use scenario::Roster;
use scenario::fault::Fault;

use super::schedule::FaultIndex;
use crate::world::Impairment;

/// Returns the impairments of the faults in force, in the order of arming.
pub fn impairments<'f>(
    in_force: impl Iterator<Item = (FaultIndex, &'f Fault)>,
    roster: &Roster,
) -> impl Iterator<Item = (FaultIndex, Impairment)> {
    in_force.filter_map(|(index, fault)| {
        let Fault::Skill(fault) = fault else {
            return None;
        };
        let impairment = Impairment {
            robot: roster.find(&fault.robot)?,
            skill: fault.skill.clone(),
            share: fault.share,
            was_used: false,
        };
        Some((index, impairment))
    })
}
