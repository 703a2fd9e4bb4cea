//! The messages of one robot whose controller is a node of ROS: its readings in each tick, before it acts.

use std::sync::Arc;

use missions::external::reading_as_json;
use proto::readings::Readings;
use proto::team::{Broadcast, BroadcastContent};
use ros::Qos;
use ros::messages::{Clock, StringMessage};
use scenario::Setup;
use scenario::ids::RobotId;
use scenario::time::SimTime;
use serde_json::{Value, json};

use super::convert::CLOCK;
pub use super::convert::{body_frame, stamp};
use super::destination::{Destination, Topic};
use super::devices::RobotDevices;

/// The topics of the robot.
pub struct RobotMessages {
    setup: Setup,
    clock: Topic<Clock>,
    devices: RobotDevices,
    /// The readings without a type in ROS, as JSON.
    others: Topic<StringMessage>,
}

impl RobotMessages {
    /// Adds the topics of a robot, which has the name `name` in ROS.
    ///
    /// # Errors
    /// Returns the errors of the destination.
    pub fn new(
        setup: &Setup,
        robot: RobotId,
        name: &str,
        to: &mut dyn Destination,
    ) -> anyhow::Result<Self> {
        let spec = &setup.scenario.robots[robot.index()];
        Ok(Self {
            clock: to.topic(CLOCK, Qos::Stream)?,
            devices: RobotDevices::new(to, setup, spec, name)?,
            others: to.topic(format!("/{name}/devices"), Qos::Stream)?,
            setup: setup.clone(),
        })
    }

    /// Writes the readings of a tick and the received broadcasts, and with `has_clock` the time. The topic `/NAME/devices`
    /// has a message in each tick, which is the last of the tick.
    ///
    /// # Errors
    /// Returns the errors of the destination.
    pub fn write(
        &self,
        to: &mut dyn Destination,
        now: SimTime,
        readings: &Readings,
        received: &[Arc<Broadcast>],
        has_clock: bool,
    ) -> anyhow::Result<()> {
        let clock = stamp(now);
        let (sec, nanosec) = (clock.sec, clock.nanosec);
        if has_clock {
            to.write(&self.clock, now, &Clock { clock })?;
        }
        self.devices.write(to, now, readings)?;
        let mission = self.setup.catalog.mission.name();
        let heartbeats = received
            .iter()
            .filter_map(|message| self.heartbeat(message));
        let content = json!({
            "stamp": { "sec": sec, "nanosec": nanosec },
            "t_ms": now.0,
            "energy_j": readings.energy_j,
            "ground": readings.ground.map(|ground| [ground.here, ground.ahead]),
            "mission": reading_as_json(&readings.mission, mission),
            "heartbeats": heartbeats.collect::<Vec<Value>>(),
        });
        let data = content.to_string();
        to.write(&self.others, now, &StringMessage { data })
    }

    /// Returns the part of a heartbeat that all missions have; `None` for another broadcast.
    fn heartbeat(&self, message: &Broadcast) -> Option<Value> {
        let BroadcastContent::Heartbeat(heartbeat) = &message.body else {
            return None;
        };
        let catalog = &self.setup.catalog;
        Some(json!({
            "robot": self.setup.roster.name(message.sender),
            "state": heartbeat.state.as_str(),
            "set": heartbeat.set.map(|set| catalog.behavior_name(set)),
            "task": heartbeat.task.map(|task| catalog.task_name(task)),
            "progress": heartbeat.progress,
            "position": heartbeat.position.map(|position| position.to_array()),
        }))
    }
}
