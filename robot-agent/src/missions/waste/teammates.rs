//! What the robot last heard of each teammate.

use std::collections::BTreeMap;

use alliance_proto::ids::{Incarnation, RobotId, TaskId};
use alliance_proto::team::{Broadcast, Heartbeat, TaskState};
use alliance_proto::time::SimTime;
use glam::Vec2;

use crate::body::Teammate;
use crate::body::goal::length;

/// After this a teammate's position says nothing about what is in the way now.
const POSITION_EXPIRES: SimTime = SimTime(3_000);

/// What a teammate last said.
#[derive(Clone, Debug, PartialEq)]
struct Last {
    incarnation: Incarnation,
    heard: SimTime,
    position: Option<Vec2>,
    carrying: bool,
    executes: Option<TaskId>,
}

/// What the robot last heard of each teammate.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Teammates {
    last: BTreeMap<RobotId, Last>,
}

impl Teammates {
    /// Notes a heartbeat. Returns where the sender lost its load, if this is a new life of one that was carrying.
    pub fn hear(&mut self, broadcast: &Broadcast, heartbeat: &Heartbeat) -> Option<Vec2> {
        let executing = heartbeat.state == TaskState::Executing;
        let before = self.last.insert(
            broadcast.sender,
            Last {
                incarnation: broadcast.incarnation,
                heard: broadcast.sent,
                position: heartbeat.position,
                carrying: heartbeat.carrying,
                executes: heartbeat.task.filter(|_| executing),
            },
        )?;
        if before.carrying && before.incarnation != broadcast.incarnation {
            before.position
        } else {
            None
        }
    }

    /// The last places of teammates that carried something and have been silent for longer than `silence`, each once.
    pub fn fallen_silent(&mut self, now: SimTime, silence: SimTime) -> Vec<Vec2> {
        let carriers = self.last.values_mut().filter(|last| last.carrying);
        carriers
            .filter(|last| now.since(last.heard) > silence)
            .filter_map(|last| {
                last.carrying = false;
                last.position
            })
            .collect()
    }

    /// The teammates that `robot` gives way to: those of lower rank that are at work.
    pub fn right_of_way(&self, robot: RobotId, now: SimTime) -> Vec<Teammate> {
        let lower = self.last.range(..robot);
        lower.filter_map(|(_, last)| last.at_work(now)).collect()
    }

    /// Where the nearest teammate at work was when it last said so.
    pub fn nearest_at_work(&self, position: Vec2, now: SimTime) -> Option<Vec2> {
        let distance = |place: &Vec2| length(*place - position);
        let at_work = self.last.values().filter_map(|last| last.at_work(now));
        at_work
            .map(|teammate| teammate.position)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

impl Last {
    fn at_work(&self, now: SimTime) -> Option<Teammate> {
        let fresh = now.since(self.heard) < POSITION_EXPIRES;
        self.executes.filter(|_| fresh)?;
        Some(Teammate {
            position: self.position?,
            heard: self.heard,
        })
    }
}
