//! A run as people observe it. Nothing here reads files, sockets or clocks, so the page of a server, a page that
//! contains the simulator, and reports share it.
//!
//! - [`about`]: the description of a run for the page. [`colors`]: colors of robots and tasks.
//! - [`feed`]: views and events as frames for the page. [`past`]: the history for pages that open later.
//! - [`detections`], [`takeovers`]: events after the loss of a robot. [`stints`]: the spans of work that decide about
//!   them.

pub mod about;
pub mod colors;
pub mod detections;
pub mod feed;
pub mod past;
pub mod stints;
pub mod takeovers;
