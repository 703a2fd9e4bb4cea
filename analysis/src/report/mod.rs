//! `alliance report`: a page with figures and metrics of a run.
//!
//! - `history` sorts the rows of a full log by robot and behavior set (`robot_history`). `failures` and `metrics` are computed from it,
//!   without I/O or drawing.
//! - [`takeovers`] reads the events after a loss. `figures` draws. `page` and `page_of_two` write pages. `command` reads and writes files.
//!
//! A tick lasts until the start of the next one. A robot is *present* in the ticks in which its report counted. A *stint*
//! is an unbroken time in which a behavior set for a task is active in a present robot. The *effects* of a stint are the
//! events that change a column of mission.csv, and the progress that the robot noted on the task. `page` contains the
//! definitions of all metrics.

pub mod command;
mod comparison_page;
pub(crate) mod failures;
mod faults;
pub(crate) mod figures;
pub(crate) mod files;
pub(crate) mod history;
mod links;
mod made;
pub(crate) mod metrics;
pub(crate) mod page;
pub(crate) mod robot_history;
pub(crate) mod spans;
mod stream;
pub mod takeovers;
#[cfg(test)]
mod tests;
mod verdict;

pub use history::{History, HistoryError};
pub use metrics::Metrics;
