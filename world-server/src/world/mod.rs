//! The world: components, penetrability, energy, physics and sensing (thesis §3.2 and §4.1). The code is pure: results
//! depend only on the setup and the commands.
//!
//! - [`outline`](Outline): geometry of one solid: distance, ray cast, and the sweep of a disc.
//! - [`component`](Component): objects on the floor, with [`Penetrability`]. `battery`: the energy of a robot, an aspect.
//! - `space`: the border and the rectangles. [`start_poses`]: the start poses of the robots. [`Places`]: free places.
//!   [`Regions`]: places with ways between them.
//! - `grid`: neighbor search. `ground`: speed changes by the floor. `motion`: turning, then moving straight ahead.
//! - `bar`: solids of a mission that bodies can push.
//! - `vicinity`: search results that stay valid for several steps. `unchanged`: validity of the latest readings.
//! - `radio`: robots in radio range. `channel`: fading and obstacles between two robots. `sensing`: readings of the
//!   devices that every mission has. `beams`: collision avoidance, also from the [`Scan`] of a real scanner.
//! - `change`: changes by interruption handlers between steps. `external_body`: bodies that move in another world.
//! - [`Floor`]: the combination of these modules. `state`: [`World`], a floor and the [mission](crate::mission) on it.
//!
//! # One step
//! Interruption handlers change the world between steps (`change`: [`Floor::add_obstacle`], [`Floor::move_robot`], …). In a
//! step the components act in rank order, then the batteries discharge. A robot first acts on its mission at the position
//! where it read its sensors. Then it turns and moves. If a bar stops it, the mission may let the bar
//! [give way](crate::mission::MissionWorld::handle_push), and the body continues. Robots of lower rank have moved by
//! then, others have not.
//!
//! # Design decisions
//! - The center beam of the proximity sensor uses the same sweep as a moving body, so it is free exactly when the body can
//!   move.
//! - Driving draws energy by the actual speed, so pushing against a wall draws none. A robot without energy ignores
//!   commands, but its sensors still work.

mod bar;
mod battery;
mod beams;
pub(crate) mod change;
mod channel;
mod component;
mod external_body;
pub(crate) mod floor;
mod grid;
mod ground;
mod motion;
mod neighbor_cache;
mod outline;
mod places;
mod radio;
mod readings_cache;
mod regions;
mod sensing;
mod space;
pub(crate) mod start;
mod state;
pub(crate) mod step_events;

pub use bar::{Bar, Push};
pub use beams::Scan;
pub use change::ChangeError;
pub use component::{Component, ComponentId, ObstacleId, Penetrability, Shape};
pub use floor::{Floor, Impairment};
pub use grid::Grid;
pub use motion::{limit_command, wrap_angle};
pub use neighbor_cache::{Circle, CircleCache};
pub use outline::{Outline, SKIN_M};
pub use places::Places;
pub use regions::Regions;
pub use space::{ROUNDING_M, directions_around};
pub use start::{StartError, start_poses};
pub use state::World;
