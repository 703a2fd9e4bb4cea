//! The layout of JSON and YAML files: a list of tasks, or a table with lists of tasks and robots.

use scenario::Obstacle;
use serde::Deserialize;

use super::super::model::{Floor, Instance, Robot, RunResult, Task};
use super::super::source::Loaded;

/// An instance whose records are still text or have places.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Document<T, R> {
    #[serde(default)]
    pub name: String,
    pub limit_s: Option<f64>,
    pub speed_m_s: Option<f64>,
    pub turn_deg_s: Option<f64>,
    pub robot_penetrability: Option<f64>,
    pub reach_m: Option<f64>,
    pub room: Option<Floor>,
    pub tasks: Vec<T>,
    #[serde(default = "Vec::new")]
    pub robots: Vec<R>,
    #[serde(default)]
    pub obstacles: Vec<Obstacle>,
    pub result: Option<RunResult>,
}

impl<T, R> Document<T, R> {
    /// Creates the document of a list of tasks.
    pub fn from_tasks(tasks: Vec<T>) -> Self {
        Self {
            name: String::new(),
            limit_s: None,
            speed_m_s: None,
            turn_deg_s: None,
            robot_penetrability: None,
            reach_m: None,
            room: None,
            tasks,
            robots: Vec::new(),
            obstacles: Vec::new(),
            result: None,
        }
    }

    /// Returns the instance; the functions return a record with its line.
    pub fn load<E>(
        self,
        task: impl Fn(T) -> Result<(Task, usize), E>,
        robot: impl Fn(R) -> Result<(Robot, usize), E>,
    ) -> Result<Loaded, E> {
        let tasks: Vec<(Task, usize)> =
            self.tasks.into_iter().map(task).collect::<Result<_, E>>()?;
        let robots: Vec<(Robot, usize)> = self
            .robots
            .into_iter()
            .map(robot)
            .collect::<Result<_, E>>()?;
        let (tasks, task_lines) = tasks.into_iter().unzip();
        let (robots, robot_lines) = robots.into_iter().unzip();
        let result = self
            .result
            .map(|_| "result: a scenario has none".to_owned());
        Ok(Loaded {
            instance: Instance {
                name: self.name,
                limit_s: self.limit_s,
                speed_m_s: self.speed_m_s,
                turn_deg_s: self.turn_deg_s,
                robot_penetrability: self.robot_penetrability,
                reach_m: self.reach_m,
                room: self.room,
                tasks,
                robots,
                obstacles: self.obstacles,
                result: None,
            },
            task_lines,
            robot_lines,
            dropped: result.into_iter().collect(),
            ..Loaded::default()
        })
    }
}
