//! Whole missions by real processes: the command as its users run it.

#![allow(clippy::unwrap_used)] // Clippy takes only test functions for tests, not what they share.

mod by_command;
mod by_hand;
mod ends;
mod golden;
mod harness;
mod in_process;
mod hostile;
mod killed;
mod log_folder;
mod other_version;
mod refusals;
mod repeatable;
mod rooms;
mod soak;
mod stopped;
mod superseded;
mod team;
