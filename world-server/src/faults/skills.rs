//! Skills that have got worse: a mission's world takes them into account, the robot's mind does not know.

use alliance_proto::fault::Fault;
use alliance_proto::scenario::Roster;

use super::schedule::FaultIndex;
use crate::world::Impairment;

/// What the faults in force impair, in the order of arming.
pub fn impairments<'f>(
    in_force: impl Iterator<Item = (FaultIndex, &'f Fault)>,
    roster: &Roster,
) -> impl Iterator<Item = (FaultIndex, Impairment)> {
    in_force.filter_map(|(index, fault)| {
        let Fault::Skill(fault) = fault else {
            return None;
        };
        let impairment = Impairment {
            robot: roster.robot_named(&fault.robot)?,
            skill: fault.skill.clone(),
            share: fault.share,
            has_acted: false,
        };
        Some((index, impairment))
    })
}
