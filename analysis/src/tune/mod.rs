//! `alliance tune`: searches parameters of allocators on training seeds and judges them on unseen seeds.
//!
//! - `task` checks a plan: the missions and faults of a sweep, and the table `tune`.
//! - `search` selects the next points. `race` drops the worst candidates of a generation early. `tuning` combines search, selection
//!   and test. These modules do no I/O: they request runs through `tuning::TrialExecutor`.
//! - `record` executes runs in parallel and stores their outcomes. A resumed search replays its record and gives identical results.
//! - `importance` and `verdict` compute the numbers of the result; `figures` and `page` present it; `command` is the command line.

pub mod command;
mod figures;
mod importance;
mod page;
mod race;
mod record;
mod search;
mod task;
mod tuning;
mod verdict;
