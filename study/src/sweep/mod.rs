//! `alliance sweep`: a mission in many variants and with many seeds, on all cores.
//!
//! - `plan` reads the file that says what is varied; `design` numbers the runs that come of it; `sampling` draws points.
//! - `workers` do runs side by side, each as in `run`; `journal` keeps a row per run as it ends. Whatever stands there is
//!   not run again, so a sweep that was killed goes on, and the journals of shards together are that of the whole.
//! - `results`, `summary` and `figures` are computed from the rows, in the order of the runs, and hold nothing of the clock:
//!   however often a sweep was interrupted, its files are the same. `statistics` has the formulas.
//! - `folder` writes files, `page` the summary; `command` is what people call.

pub mod command;
mod design;
mod figures;
pub(crate) mod folder;
mod journal;
mod page;
mod parquet;
mod plan;
pub(crate) mod progress;
mod results;
mod run;
mod sampling;
mod shard;
mod statistics;
mod summary;
pub(crate) mod workers;

pub use journal::parse as parse_journal;
pub use plan::Plan;
