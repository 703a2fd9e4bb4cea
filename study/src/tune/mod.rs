//! `alliance tune`: parameters of allocators, found by a search on training seeds and judged on seeds that it has never seen.
//!
//! - `task` checks a plan: missions and faults as a sweep has them, and a table `tune`. `space` maps coordinates to values.
//! - `search` says which points come next, by CMA-ES or at random, `race` who of a generation goes early; `tuning` puts them together:
//!   search, selection, test. None of them does I/O: they ask for the `tuning::Runs` that they need.
//! - `record` does the runs, side by side, and keeps what came of them. One that is interrupted is made again from its record, up to
//!   where it was: so the result is the same to the byte.
//! - `importance` and `verdict` are the numbers of the result; `figures` and `page` show it, `command` is what people call.

pub mod command;
mod figures;
mod importance;
mod page;
mod race;
mod record;
mod search;
pub(crate) mod space;
mod task;
mod tuning;
mod verdict;
