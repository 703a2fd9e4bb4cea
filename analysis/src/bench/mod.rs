//! `alliance bench`: a suite of runs that never changes, with one result that can be checked.
//!
//! - `suite` contains the suites and makes a plan of one with the allocators to measure. [`crate::sweep`] executes it.
//! - `result` is the format of the result. `check` decides which runs are repeated, and compares them.
//! - `table` is the table of all allocators. `command` is the command line.

mod check;
pub mod command;
mod result;
mod suite;
mod table;
#[cfg(test)]
mod tests;
