//! Code that the tests across processes and the benchmarks share.

pub mod closed_loop;
pub mod figures;
pub mod hosts;
pub mod lies;
pub mod mishaps;
pub mod needs;
pub mod recompute;
pub mod rooms;
pub mod storm;
pub mod ten_missions;
pub mod testkit;
