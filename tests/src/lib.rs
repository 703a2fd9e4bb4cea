//! Code that the tests across processes and the benchmarks share.

#![allow(clippy::unwrap_used)] // An error here fails the test.

pub mod damage;
pub mod fault_fuzzer;
pub mod figures;
pub mod harness;
pub mod hosts;
pub mod lies;
pub mod needs;
pub mod observers;
pub mod operator;
pub mod python;
pub mod recompute;
pub mod runs;
pub mod team;
pub mod ten_missions;
pub mod testkit;
