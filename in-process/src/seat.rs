//! The places of a team's controllers, and the workspaces in which they step.

use robot_agent::agent::{Agent, Workspace};

/// The number of robots that run through sensing, perception, thinking, acting and reporting together. Each of these steps runs a
/// lot of code, which stays in the cache for the whole group.
pub(super) const TOGETHER: usize = 32;

/// The controller of a robot's current incarnation.
#[derive(Clone)]
pub(super) enum Seat {
    Empty,
    Agent(Agent),
    /// A controller outside this program.
    Foreign,
}

/// The workspaces of the robots of a group. Several teams that are stepped in turn can share one set, which then stays in the
/// cache.
#[derive(Default)]
pub struct Workspaces(pub(super) Vec<Workspace>);
