//! Faults as the world sees them (DESIGN §6). Pure.
//!
//! - [`schedule`]: when they begin and end.

pub mod schedule;
