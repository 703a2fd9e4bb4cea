//! The text of an instance file, and an instance with the lines of its records.

use scenario::Problem;

use super::model::Instance;

/// The text of a file with its name, which stands in error messages.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    pub name: &'a str,
    pub text: &'a str,
}

impl Source<'_> {
    /// Creates an error for a line of the file, from 1.
    #[must_use]
    pub fn error(
        &self,
        line: usize,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Problem {
        Problem::with_source(self.name, problem, remedy).on_line(line)
    }

    /// Returns the line of a byte of the text, from 1.
    #[must_use]
    pub fn line_at(&self, byte: usize) -> usize {
        let before = self.text.as_bytes().iter().take(byte);
        before.filter(|byte| **byte == b'\n').count() + 1
    }

    /// Returns the name of the file without folders and extension.
    #[must_use]
    pub fn stem(&self) -> &str {
        let name = self.name.rsplit(['/', '\\']).next().unwrap_or_default();
        name.rsplit_once('.').map_or(name, |(stem, _)| stem)
    }
}

/// The unit of the lengths in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LengthUnit {
    /// The file states lengths in metres.
    #[default]
    Metre,
    /// The format has no unit of length.
    None,
}

/// An instance with the facts about its file that checks and the scenario need.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loaded {
    pub instance: Instance,
    pub unit: LengthUnit,
    /// The line of each task, from 1.
    pub task_lines: Vec<usize>,
    /// The line of each robot, from 1. Empty if the format has no records of robots.
    pub robot_lines: Vec<usize>,
    /// The depots: the starts of robots whose number the file or the command line states.
    pub depots: Vec<Depot>,
    /// Contents of the file that the instance cannot express, each as `NAME: reason`.
    pub dropped: Vec<String>,
    /// Conversions of the instance before it is written, one line each.
    pub notes: Vec<String>,
}

/// A depot of a vehicle routing problem.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Depot {
    pub x: f64,
    pub y: f64,
    /// The number of vehicles, if the file states it.
    pub vehicles: Option<usize>,
    /// The load that each of its vehicles can carry.
    pub capacity: Option<f64>,
    /// The time at which all vehicles must be back, s.
    pub closes_s: Option<f64>,
}

impl Loaded {
    /// The turn rate of vehicles without a turn time, degrees per second: the greatest that a scenario accepts.
    const TURN_DEG_S: f64 = 3600.0;

    /// Creates the instance of a format without units: a robot drives one unit of length per second, turns at once, and
    /// does not block other robots.
    #[must_use]
    pub fn without_units() -> Self {
        Self {
            unit: LengthUnit::None,
            instance: Instance {
                speed_m_s: Some(1.0),
                turn_deg_s: Some(Self::TURN_DEG_S),
                robot_penetrability: Some(1.0),
                ..Instance::default()
            },
            ..Self::default()
        }
    }

    /// Returns the line of a task by index, from 1.
    #[must_use]
    pub fn task_line(&self, task: usize) -> usize {
        self.task_lines.get(task).copied().unwrap_or(1)
    }

    /// Returns the line of a robot by index, from 1.
    #[must_use]
    pub fn robot_line(&self, robot: usize) -> usize {
        self.robot_lines.get(robot).copied().unwrap_or(1)
    }
}
