//! The `robot` and `section` columns of ticks.csv.

/// The `robot` column of ticks.csv for what belongs to no robot.
pub const WORLD: &str = "world";

/// The `section` column of the row that ends a tick in ticks.csv.
pub const RUN_SECTION: &str = "run";

/// A part of a tick that is hashed by itself, so that a difference between two runs can be named.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Section {
    /// What came from outside; of the world, in ticks with inputs.
    Inputs,
    /// A robot's readings.
    Readings,
    /// Broadcasts that reached or missed a robot, and how many it sent; in ticks with any.
    Messages,
    /// A robot's motivations, changes of state and notes.
    Motivations,
    /// A robot's actuation.
    Commands,
    /// The world's events; in ticks with any.
    Events,
    /// The world's bodies at the start of the tick, items and last report.
    State,
}

impl Section {
    /// The `section` column of ticks.csv.
    #[must_use]
    #[inline(always)]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Inputs => "inputs",
            Self::Readings => "readings",
            Self::Messages => "messages",
            Self::Motivations => "motivations",
            Self::Commands => "commands",
            Self::Events => "events",
            Self::State => "state",
        }
    }
}
