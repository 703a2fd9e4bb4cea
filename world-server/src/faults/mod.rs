//! Faults as the world sees them (DESIGN §6). Pure.
//!
//! - [`schedule`]: when they begin and end.
//! - [`links`]: what they do to messages; bursts of losses are in `bursts`.

mod bursts;
pub mod links;
pub mod schedule;
