//! The `robot` and `section` columns of ticks.csv.

/// The `robot` column of ticks.csv for data that belongs to no robot.
pub const WORLD_ROBOT: &str = scenario::names::WORLD;

/// The `section` column of ticks.csv in the last row of a tick.
pub const RUN_SECTION: &str = "run";

/// A part of a tick with its own hash. It locates a difference between two runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Section {
    /// The external inputs of a tick, in ticks with inputs.
    Inputs,
    Readings,
    /// The deliveries at a robot and the number of broadcasts that it sent, in ticks with any.
    Messages,
    /// The motivations, state changes and notes of a robot.
    Motivations,
    Commands,
    /// The events of the world, in ticks with any.
    Events,
    /// The bodies at the start of the tick, the items and the report of the world.
    State,
}

impl Section {
    /// Returns the `section` column of ticks.csv.
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
