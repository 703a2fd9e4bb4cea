//! Faults of messages, sensors, actuators, skills and processes. The code is pure.
//!
//! - [`schedule`]: begin and end of faults.
//! - [`links`]: effects on messages; `bursts` contains the loss bursts.
//! - [`sensors`], [`actuators`]: effects between a robot's controller and its body. [`skills`]: impaired skills.
//! - [`in_vain`]: faults that cannot take effect.
//! - [`campaign`]: random faults as orders for the schedule. `draws`: random numbers for all modules.
//!
//! Faults of the world itself are [interruptions](crate::interruption).

pub mod actuators;
mod bursts;
pub mod campaign;
mod draws;
pub mod in_vain;
pub mod links;
pub mod schedule;
pub mod sensors;
pub mod skills;
