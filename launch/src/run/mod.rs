//! `alliance run`: one world process and one process per robot, from start to summary.

pub mod args;
pub mod bus;
pub mod child_processes;
pub mod controllers;
pub mod crew;
mod disk;
mod news;
pub mod observers;
mod one_process;
mod orders;
pub mod plan;
mod progress;
pub mod shell;
mod summary;
pub mod supervise;
