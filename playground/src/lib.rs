//! The simulator for a web page: a run in one process, with a clock, orders of a person, and frames for the page.
//!
//! - [`choice`]: the choice of a scenario, an allocator and a seed.
//! - [`engine`]: one run, or two runs beside each other, with a clock. [`run`]: a run without a clock.
//! - [`edit`]: the editor of scenarios. [`gallery`]: runs worth watching.
//! - `exports`: the functions of the WebAssembly module. `launch/page/source/worker.js` calls them.
//!
//! The module has plain exports and one buffer for texts. That is less code than bindings of wasm-bindgen, whose command
//! would be one more tool of the same version for each build.

pub mod choice;
pub mod edit;
pub mod engine;
#[cfg(target_arch = "wasm32")]
mod exports;
pub mod gallery;
pub mod run;
