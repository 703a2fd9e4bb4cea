//! `alliance run`: one world and one process per robot, from start to summary.

pub mod args;
mod bus;
pub mod children;
pub mod minds;
mod one_process;
mod orders;
mod plan;
mod progress;
mod summary;
mod supervise;
