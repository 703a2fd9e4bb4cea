//! Whole missions by real processes, as users run the command, and some within one process.

#![allow(clippy::unwrap_used)] // Clippy takes only test functions for tests, not what they share.

mod allocators;
mod bodies;
mod by_command;
mod by_hand;
mod campaign;
mod check;
mod closed_loop;
mod consensus;
mod control;
mod control_python;
mod differential;
mod ends;
mod export;
mod family;
mod faults;
mod first_moments;
mod golden;
mod harness;
mod hostile;
mod in_process;
mod killed;
mod log_folder;
mod negotiation;
mod on_time;
mod other_version;
mod page;
mod parity;
mod parker;
mod python;
mod recompute;
mod refusals;
mod repeatable;
mod rooms;
mod soak;
mod steady;
mod stopped;
mod story;
mod superseded;
mod sweep;
mod takeover;
mod team;
mod thesis;
mod trapped;
mod words;
