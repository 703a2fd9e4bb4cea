//! The consensus of CBBA on the winner of each task (Choi, Brunet, How, IEEE T-RO 25(4):912–926, 2009), for all rules
//! that use it: CBAA, CBBA, ACBBA, PI and HIPC. A rule makes the bids; this module stores, sends and merges them.
//!
//! - `winners`: the winner of each task.
//! - `rules`: the rules that merge a teammate's list (Table I).
//! - `tables`: messages, and the removal of silent robots (FORGET). `known`: the robots that are not silent.
//! - `team`: a team in lockstep, for tests of these rules.

use proto::telemetry::Reason;
use scenario::ids::BehaviorId;

use crate::allocator::Decision;

pub(super) mod known;
#[cfg(test)]
mod rows;
pub(super) mod rules;
pub(super) mod tables;
#[cfg(test)]
pub(super) mod team;
pub(super) mod winners;

/// Starts the first task of a robot's plan at once, without waiting for agreement, and states the reason of a change.
pub(super) fn start(decision: &mut Decision, first: Option<BehaviorId>, was_outbid: bool) {
    if first == decision.active {
        return;
    }
    decision.active = first;
    decision.reason = Some(if was_outbid {
        Reason::Outbid
    } else {
        Reason::Claimed
    });
}
