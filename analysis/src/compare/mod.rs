//! `alliance compare`: compares allocators under faults, with the significance of the differences.
//!
//! - [`crate::sweep`] runs the plan, which varies `allocator`. A *block* is one combination of all other settings except the seed,
//!   such as a mission under a class of faults. A *cell* is one allocator in a block. Runs of a block with the same seed are a pair:
//!   they have the same world and the same random numbers of the radio.
//! - `metrics` defines the metrics, `primary` selects the one that ranks the runs of a scenario, `data` sorts the rows into
//!   `blocks` and `cell`s, `analysis` compares them with `statistics`, `hypotheses` judges the claims, `answer` formulates
//!   the result, and `overview` states how it was found and what would change it. These modules do no I/O and do not
//!   depend on the order in which runs ended.
//! - `tables`, `figures` and `page` present the result; `memory` checks the memory and `power` the number of seeds beforehand;
//!   `command` is the command line.
//!
//! **No data.** A run whose faults had no effect does not count, and its seed is omitted from pairs. A cell without counted runs
//! has no data.
//!
//! **No chance.** If all runs of a cell are equal, they count as one run. The difference of two such cells is exact: no test applies.

mod analysis;
mod answer;
mod blocks;
mod cell;
pub mod command;
mod data;
mod figures;
mod hypotheses;
mod memory;
pub(crate) mod metrics;
mod overview;
pub(crate) mod page;
mod power;
pub(crate) mod primary;
pub mod statistics;
mod tables;
#[cfg(test)]
mod tests;
