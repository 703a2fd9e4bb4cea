//! The page of a run: what its server tells and takes, and the page itself in a real browser.

mod browser;
mod client;
mod finished;
mod gate;
mod hundreds;
mod observer;
mod replayed;
mod stays;
mod watched;
