//! `alliance sweep`: a mission in many variants and with many seeds, on all cores.
//!
//! - `plan` reads the file that says what is varied; `design` numbers the runs that come of it; `sampling` draws points.
//! - `workers` do runs side by side, each as in `run`; `journal` keeps a row per run as it ends, in `lines` with checksums. Whatever stands there is
//!   not run again, so a sweep that was killed goes on, and the journals of shards together are that of the whole.
//! - `results`, `summary` and `figures` are computed from the rows, in the order of the runs, and hold nothing of the clock:
//!   however often a sweep was interrupted, its files are the same. `statistics` has the formulas.
//! - `task` is what a plan is run by, whatever is made of its runs: [`crate::compare`] does so, too, which asks for `measures` of
//!   each run and keeps a `comparison` in the journal.
//! - `folder` writes files, `page` the summary; `command` is what people call.

pub mod command;
pub(crate) mod comparison;
pub(crate) mod design;
mod figures;
pub(crate) mod folder;
pub(crate) mod journal;
pub(crate) mod lines;
pub(crate) mod measures;
mod page;
pub(crate) mod parquet;
pub(crate) mod plan;
pub(crate) mod progress;
pub(crate) mod results;
pub(crate) mod run;
mod sampling;
mod shard;
pub(crate) mod statistics;
mod summary;
pub(crate) mod task;
pub(crate) mod workers;

pub use journal::parse as parse_journal;
pub use plan::Plan;
pub use statistics::wilson;
