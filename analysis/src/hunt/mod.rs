//! `alliance hunt`: searches the faults that break an allocator, and shrinks them to the least ones.
//!
//! - `plan` reads and checks the plan. `violation` names the violations, and `case` is a scenario with faults and seed.
//! - `space` draws and changes fault schedules. It derives all ranges from the declarations of the faults
//!   ([`scenario::fault::FaultSpec`]), so a new kind of fault needs no change here.
//! - `search` selects the next cases, uniformly or guided by `coverage` and severity. `judge` runs one case exactly.
//! - `ddmin` is delta debugging over any list. `shrink` applies it to faults, robots and tasks, and `simpler` to values.
//!   None of these modules does I/O: they request runs through [`case::Judge`].
//! - `record` executes runs in parallel and stores their judgements. A resumed hunt replays its record.
//! - `results` and `page` present the result, and `command` is the command line.

pub mod case;
pub mod command;
mod cooperation;
mod coverage;
pub mod ddmin;
mod hunting;
mod judge;
mod page;
pub mod plan;
mod record;
mod results;
mod search;
mod shrink;
mod simpler;
mod space;
pub mod violation;
