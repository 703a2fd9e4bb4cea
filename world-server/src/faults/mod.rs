//! Faults as the world sees them (DESIGN §6). Pure.
//!
//! - [`schedule`]: when they begin and end.
//! - [`links`]: what they do to messages; bursts of losses are in `bursts`.
//! - [`sensors`], [`actuators`]: what stands between a robot's mind and its body while they are in force. [`skills`]: what it does worse.
//! - [`campaign`]: random faults, as orders for the schedule. `draws`: what chance does to all of them.
//!
//! Faults of the world itself are [interruptions](crate::interruption).

pub mod actuators;
mod bursts;
pub mod campaign;
mod draws;
pub mod links;
pub mod schedule;
pub mod sensors;
pub mod skills;
