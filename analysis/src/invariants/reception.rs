//! Reception between robots under the faults in force.

use proto::control::Phase;
use scenario::fault::{Fault, FaultGroup, LinkEnd};
use scenario::{Scenario, Walls};

use super::WorldState;

/// Margin at the limit of the radio range, m. Robots move within a tick, so reception near the limit is undetermined.
const MARGIN_M: f32 = 0.5;

/// Returns whether two robots, by rank, receive each other without loss and delay. Both must take part, and no fault
/// may affect a link between them. Duplicates do not matter. Under fading, and with walls that block, reception is
/// undetermined.
#[must_use]
pub fn hear_each_other(scenario: &Scenario, state: &WorldState, one: usize, other: usize) -> bool {
    let takes_part = |rank: usize| state.robots[rank].takes_part;
    let range_m = scenario.radio.range_m.unwrap_or(f32::INFINITY);
    let in_force = state
        .faults
        .iter()
        .filter(|fault| fault.phase == Phase::InForce);
    scenario.radio.fading.is_none()
        && scenario.radio.walls == Walls::Pass
        && takes_part(one)
        && takes_part(other)
        && apart_m(state, one, other) <= range_m - MARGIN_M
        && !in_force.into_iter().any(|fault| {
            let fault = &fault.order.fault;
            affects(scenario, state, fault, one, other)
                || affects(scenario, state, fault, other, one)
        })
}

fn apart_m(state: &WorldState, one: usize, other: usize) -> f32 {
    let at = |rank: usize| state.robots[rank].pose.position;
    at(one).distance(at(other))
}

/// Returns whether a fault changes the messages that `to` receives from `from`.
fn affects(scenario: &Scenario, state: &WorldState, fault: &Fault, from: usize, to: usize) -> bool {
    let name = |rank: usize| scenario.robots[rank].name.as_str();
    let link = |sender: &LinkEnd, receiver: &LinkEnd| {
        sender.includes(name(from)) && receiver.includes(name(to))
    };
    match fault {
        Fault::Drop(spec) => link(&spec.from, &spec.to),
        Fault::Delay(spec) => link(&spec.from, &spec.to),
        Fault::Reorder(spec) => link(&spec.from, &spec.to),
        Fault::Hold(spec) => link(&spec.from, &spec.to),
        Fault::Corrupt(spec) => link(&spec.from, &spec.to),
        Fault::Mute(robot) => robot == name(from),
        Fault::Deaf(robot) => robot == name(to),
        Fault::Partition(spec) => {
            let group = |rank: usize| {
                let mut groups = spec.groups.iter();
                groups.position(|group| group.iter().any(|robot| robot == name(rank)))
            };
            matches!((group(from), group(to)), (Some(a), Some(b)) if a != b)
        }
        Fault::Range(spec) => apart_m(state, from, to) > spec.range_m - MARGIN_M,
        Fault::Duplicate(_) => false,
        other => other.group() == FaultGroup::Radio,
    }
}
