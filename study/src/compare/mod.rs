//! `alliance compare`: which allocator copes best with which faults, and whether the difference is real.
//!
//! - A plan is one of [`crate::sweep`], which runs it; it varies `allocator`. A *block* is all that it varies but for the allocator and
//!   the seed, such as a mission under a class of faults; a *cell* is one allocator in a block. Runs of one block with the same seed
//!   are a pair: same world, same luck of the radio.
//! - `metrics` says what is counted, `data` sorts the rows, `analysis` compares them with `statistics`, `hypotheses` judges what the
//!   plan claims, `answer` puts it into words. None of them does I/O or knows the order in which runs ended.
//! - `tables`, `figures` and `page` show it; `memory` says beforehand whether there is room; `command` is what people call.
//!
//! **No data.** A run whose faults all hit nothing is no run under these faults: it counts in nothing, and neither does its seed in a
//! pair. A cell without a run that counts is no data, and says so.

mod analysis;
mod answer;
pub mod command;
mod data;
mod figures;
mod hypotheses;
mod memory;
pub(crate) mod metrics;
pub(crate) mod page;
pub mod statistics;
mod tables;
