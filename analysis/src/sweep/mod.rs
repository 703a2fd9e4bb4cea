//! `alliance sweep`: runs a mission in many variants and with many seeds, on all cores.
//!
//! - `plan` reads the plan file, `design` numbers the runs, and `sampling` draws random points.
//! - `run` executes one run. `journal` stores a row per finished run, in `lines` with checksums.
//!   Stored runs are not repeated, so an interrupted sweep resumes. The journals of all shards equal that of the entire sweep.
//! - `results`, `summary` and `figures` depend only on the rows, so interruptions do not change them. `statistics` has the formulas.
//! - `execution` executes a plan for any command. `best_known` reads the best known values of a plan. [`crate::compare`] also requests `measures` of each run and stores a `comparison`.
//! - `page` is the summary, and `command` the command line.

pub(crate) mod best_known;
pub mod command;
pub(crate) mod comparison;
pub(crate) mod design;
pub(crate) mod execution;
mod figures;
pub(crate) mod journal;
pub(crate) mod lines;
pub(crate) mod measures;
mod page;
pub(crate) mod plan;
pub(crate) mod results;
pub(crate) mod run;
mod sampling;
pub(crate) mod shard;
pub(crate) mod statistics;
mod summary;

pub use execution::{jobs, jobs_or_cores};
pub use journal::parse as parse_journal;
pub use plan::Plan;
pub use statistics::wilson;
