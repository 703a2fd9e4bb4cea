//! `alliance run`: one world and one process per robot, from start to summary.

pub mod args;
pub mod children;
mod progress;
mod summary;
mod supervise;
