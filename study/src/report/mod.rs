//! `alliance report`: what happened in a run, as a page with figures and metrics.
//!
//! - `history` sorts the rows of a full log by robot and behavior set; `stints`, `failures` and `metrics` are computed
//!   from it. None of them does I/O or draws.
//! - `figures` draws, `page` and `page_of_two` write, `command` reads and writes files.
//!
//! **What is counted.** A tick counts from its time to that of the next one. A robot is *present* in the ticks in which its
//! report counted. A *stint* is an unbroken time in which a behavior set for a task is active in a present robot, and its
//! *effects* are the events that change a column of mission.csv, and the progress that the robot notes on the task.
//!
//! - *Makespan*: from the start to the end of the last tick of a mission that was completed.
//! - *Idle share*: part of the time present in which no set of the robot is active.
//! - *Activations per minute*, *messages and bytes per second*: per minute and second present. Each broadcast counts once, with
//!   its payload (encoded and sealed, without what zenoh and TCP add). Both come from run.json, which a killed run lacks.
//! - *Applicable*: some set for the task has sensory_feedback = 1 in a present robot.
//! - *Orphan time*: applicable, and nobody productive. A stint is productive from its beginning to its last effect; what comes
//!   after it, and a stint without effects, came to nothing.
//! - *Unattended time*: applicable, and no stint on the task.
//! - *Duplicate time*: two or more stints on an exclusive task.
//! - *Detection latency*: from the death or stop of a robot in a stint to the first moment, before it is back, at which a
//!   teammate's τ since it last heard the robot claim the task has passed, its impatience for the task rose to δ_fast, or it
//!   activated the task.
//! - *Takeover latency*: of an activation of an exclusive task by another robot than the one with the stint before it. It counts
//!   from that robot's death or stop; of a robot that lives, from the last effect of its stint, or its beginning without any.
//!   A stint that ended because the task was not applicable leaves nothing to take over, and one that gave in to an earlier
//!   claim took nothing over.
//! - *Lateness*: how much longer than the wanted period something that recurs came after the one before it, or after the start.

pub mod command;
pub(crate) mod failures;
mod faults;
pub(crate) mod figures;
pub(crate) mod history;
mod made;
pub(crate) mod metrics;
pub(crate) mod page;
mod page_of_two;
mod pdf;
mod spans;
mod stints;
#[cfg(test)]
mod tests;
mod thin;
