//! Whole missions by real processes: the command as its users run it.

mod harness;
mod by_command;
mod killed;
mod team;
