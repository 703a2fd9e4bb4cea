//! Pictures and films of the room, made from a log without a screen.
//!
//! The camera replays the run and takes a scene at each wanted time. The drawing is a pure function
//! from a scene to an SVG. The encoder joins pictures to a film. All parts
//! are deterministic: the same run gives the same bytes.

mod bodies;
pub mod camera;
pub mod command;
mod drawing;
mod film;
mod floor;
mod frame;
mod geometry;
mod gif_film;
pub mod live;
mod radio;
mod region;
mod scene;
#[cfg(test)]
mod tests;
mod webp_film;
