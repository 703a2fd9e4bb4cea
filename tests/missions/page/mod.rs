//! The page of a run: its server, and the page itself in a real browser.

pub mod accessible;
pub mod browser;
mod client;
mod exported;
mod finished;
mod gate;
mod hundreds;
mod observer;
mod replayed;
mod stays;
mod took_over;
mod watched;

pub use client::get;
