//! The states of the robots' agents.

use proto::control::AgentState;
use proto::view::{RobotView, View};
use ros::messages::{DiagnosticArray, DiagnosticStatus, KeyValue};
use ros::{Byte, Qos};
use scenario::Setup;
use scenario::time::SimTime;

use super::convert::{body_frame, header};
use super::destination::{Destination, Topic};
use crate::export::look::activity;

/// The time between two messages without a change.
const PERIOD: SimTime = SimTime(1000);

/// The topics `/NAME/status` of all robots.
pub struct StatusTopics {
    setup: Setup,
    /// The topics of the robots, by rank.
    robots: Vec<StatusTopic>,
}

struct StatusTopic {
    /// The name in ROS.
    name: String,
    topic: Topic<DiagnosticArray>,
    /// The time and the content of the latest message, without the energy, which changes in each tick.
    latest: Option<(SimTime, DiagnosticStatus)>,
}

impl StatusTopics {
    pub fn new(to: &mut dyn Destination, setup: &Setup, names: &[String]) -> anyhow::Result<Self> {
        let robots = names.iter().map(|name| {
            Ok(StatusTopic {
                name: name.clone(),
                topic: to.topic(format!("/{name}/status"), Qos::Latched)?,
                latest: None,
            })
        });
        Ok(Self {
            robots: robots.collect::<anyhow::Result<_>>()?,
            setup: setup.clone(),
        })
    }

    /// Writes the states that have changed or were written long ago.
    pub fn write(&mut self, to: &mut dyn Destination, view: &View) -> anyhow::Result<()> {
        let specs = &self.setup.scenario.robots;
        for ((robot, shown), spec) in self.robots.iter_mut().zip(&view.robots).zip(specs) {
            let status = status(&self.setup, &spec.name, &robot.name, shown);
            let is_known = robot
                .latest
                .as_ref()
                .is_some_and(|(time, latest)| view.now.since(*time) < PERIOD && *latest == status);
            if is_known {
                continue;
            }
            robot.latest = Some((view.now, status.clone()));
            let mut message = DiagnosticArray {
                header: header(view.now, body_frame(&robot.name)),
                status: vec![status],
            };
            if let Some(energy_j) = shown.energy_j {
                message.status[0].values.push(value("energy_j", energy_j));
            }
            to.write(&robot.topic, view.now, &message)?;
        }
        Ok(())
    }
}

/// Returns the state of a robot's agent: an error without an agent, a warning while it does not answer.
fn status(setup: &Setup, robot: &str, name: &str, shown: &RobotView) -> DiagnosticStatus {
    let level = match shown.state {
        AgentState::Present => DiagnosticStatus::OK,
        AgentState::Coming | AgentState::Silent => DiagnosticStatus::WARN,
        AgentState::Dead => DiagnosticStatus::ERROR,
        AgentState::Absent => DiagnosticStatus::STALE,
    };
    let catalog = &setup.catalog;
    let set = shown.active.map(|set| &catalog.sets[set.index()]);
    let task = set.map_or("", |set| catalog.task_name(set.task));
    let incarnation = shown.incarnation.map(|incarnation| incarnation.to_string());
    DiagnosticStatus {
        level: Byte(level),
        name: format!("{name}: agent"),
        message: activity(setup, shown).to_owned(),
        hardware_id: robot.to_owned(),
        values: vec![
            value("state", shown.state.as_str()),
            value("incarnation", incarnation.unwrap_or_default()),
            value("behavior_set", set.map_or("", |set| &set.name)),
            value("task", task),
            value("carrying", shown.carrying.is_some()),
        ],
    }
}

fn value(key: &str, value: impl ToString) -> KeyValue {
    KeyValue {
        key: key.to_owned(),
        value: value.to_string(),
    }
}
