//! What is made of runs: they are made again, checked, compared, drawn, counted and written for other tools.
//!
//! - [`replay`]: a run again, from its log; [`learned`]: what
//!   its robots have learned; [`diff`]: where two runs
//!   differ; [`retrace`]: a finished run with a view of each tick.
//! - [`report`]: figures and metrics of a run; [`export`]: it for other tools.
//! - [`sweep`]: many runs, and what is common to them; [`compare`]: which allocator copes best with which faults;
//!   [`random_mission`]: missions that are drawn for sweeps; [`invariants`]: what must hold in every run.
//! - [`tune`]: parameters of allocators, found by a search.
//! - [`strategies`]: L-ALLIANCE's strategies against the optimum.
//! - [`check`]: what a scenario's parameters mean, before anything runs. [`table`]: how tables look in a terminal.
//!
//! Logs are read by [`alliance_proto::log`]. Each subcommand of `alliance` that is about runs stands with what it does.

pub mod check;
pub mod compare;
pub mod diff;
pub mod export;
pub mod interrupted;
pub mod invariants;
pub mod learned;
mod new_file;
mod optional;
mod page_head;
mod palette;
pub mod random_mission;
pub mod replay;
pub mod report;
pub mod retrace;
pub mod strategies;
pub mod sweep;
pub mod table;
pub mod tune;
#[cfg(test)]
mod visit;
