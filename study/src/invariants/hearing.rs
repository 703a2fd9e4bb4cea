//! Who hears whom, as far as faults tell.

use alliance_proto::control::Phase;
use alliance_proto::fault::{Fault, Who};
use alliance_proto::scenario::Scenario;

use super::WorldState;

/// Nearer to the limit of the radio's range than this it may be either way, for robots move in a tick, m.
const MARGIN_M: f32 = 0.5;

/// Whether two robots, by rank, hear each other without loss and delay: both take part, and no fault is in force on a link
/// between them. That messages come twice harms nobody.
#[must_use]
pub fn hear_each_other(scenario: &Scenario, state: &WorldState, one: usize, other: usize) -> bool {
    let takes_part = |rank: usize| state.robots[rank].takes_part;
    let range_m = scenario.radio.range_m.unwrap_or(f32::INFINITY);
    let in_force = state.faults.iter().filter(|it| it.phase == Phase::InForce);
    takes_part(one)
        && takes_part(other)
        && apart_m(state, one, other) <= range_m - MARGIN_M
        && !in_force.into_iter().any(|fault| {
            let fault = &fault.order.fault;
            harms(scenario, state, fault, one, other) || harms(scenario, state, fault, other, one)
        })
}

fn apart_m(state: &WorldState, one: usize, other: usize) -> f32 {
    let at = |rank: usize| state.robots[rank].pose.position;
    at(one).distance(at(other))
}

/// Whether a fault changes what `to` hears of `from`.
fn harms(scenario: &Scenario, state: &WorldState, fault: &Fault, from: usize, to: usize) -> bool {
    let name = |rank: usize| scenario.robots[rank].name.as_str();
    let link =
        |speaker: &Who, hearer: &Who| speaker.includes(name(from)) && hearer.includes(name(to));
    match fault {
        Fault::Drop(it) => link(&it.from, &it.to),
        Fault::Delay(it) => link(&it.from, &it.to),
        Fault::Reorder(it) => link(&it.from, &it.to),
        Fault::Hold(it) => link(&it.from, &it.to),
        Fault::Mute(robot) => robot == name(from),
        Fault::Deaf(robot) => robot == name(to),
        Fault::Partition(it) => {
            let group = |rank: usize| {
                let mut groups = it.groups.iter();
                groups.position(|group| group.iter().any(|robot| robot == name(rank)))
            };
            matches!((group(from), group(to)), (Some(a), Some(b)) if a != b)
        }
        Fault::Range(it) => apart_m(state, from, to) > it.range_m - MARGIN_M,
        Fault::Radio(_) => true,
        _ => false,
    }
}
