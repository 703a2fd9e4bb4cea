//! The consensus of CBBA on the winner of each task (Choi, Brunet, How, IEEE T-RO 25(4):912–926, 2009), for all rules
//! that use it: CBAA, CBBA, ACBBA, PI and HIPC. A rule makes the bids; this module stores, sends and merges them.
//!
//! - `winners`: the winner of each task.
//! - `rules`: the rules that merge a teammate's list (Table I).
//! - `tables`: messages, and the removal of silent robots (FORGET). `known`: the robots that are not silent.
//! - `team`: a team in lockstep, for tests of these rules.

pub(super) mod known;
#[cfg(test)]
mod rows;
pub(super) mod rules;
pub(super) mod tables;
#[cfg(test)]
pub(super) mod team;
pub(super) mod winners;
