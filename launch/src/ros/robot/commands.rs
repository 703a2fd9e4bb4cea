//! The commands of a node for one robot, and the selection of the command that counts in a tick.
//!
//! - In lockstep, it is the first command with the stamp of the tick. The agent waits for it while the node is present: a
//!   tick without an answer ends the presence, and any later answer starts it again.
//! - Otherwise it is the latest command, for 0.5 s of simulated time.
//!
//! Without a command the robot stands and does nothing.

use std::cmp::Ordering;
use std::collections::VecDeque;

use analysis::ros_messages::{body_frame, stamp_of};
use missions::external::MissionAction;
use ros::messages::{StringMessage, Time, Twist, TwistStamped, Vector3};
use ros::rmw_zenoh::publisher_of;
use ros::{Message, decode};
use scenario::time::SimTime;
use serde::Deserialize;
use serde_json::Value;

use crate::ros::dropped::Dropped;

/// The time for which a command counts without lockstep.
const IN_FORCE: SimTime = SimTime(500);

/// The number of ticks whose commands are stored. An agent repeats at most 32 steps, if the latest one did not count.
const STORED_TICKS: usize = 64;

/// The largest message, bytes.
const MAX_BYTES: usize = 65_536;

/// The topics on which a node sends commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandTopic {
    Twist,
    TwistStamped,
    Action,
}

/// A command for one tick. The default stands still.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Command {
    pub motion: Motion,
    pub activity: Activity,
}

/// The motion of a body: finite numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    pub speed_m_s: f32,
    pub turn_rad_s: f32,
}

/// The content of the topic `/NAME/action`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Activity {
    /// The behavior set that the robot executes, for its heartbeats.
    pub doing: Option<String>,
    /// True if the set has just had an effect.
    pub progress: bool,
    /// The action besides driving.
    pub action: MissionAction,
}

/// The commands of a node for one robot.
#[derive(Debug)]
pub struct Commands {
    is_lockstep: bool,
    /// The frames of the robot's body.
    frames: [String; 3],
    /// The names of the robot's behavior sets.
    sets: Vec<String>,
    /// The tick that is next or in progress.
    now: SimTime,
    is_in_tick: bool,
    /// `true` while a tick waits for the node.
    is_present: bool,
    activity: Activity,
    /// The latest motion with the tick of its arrival, without lockstep.
    latest: Option<(SimTime, Motion)>,
    /// The answer to the tick in progress, in lockstep.
    answer: Option<Command>,
    stored: VecDeque<(SimTime, Command)>,
}

impl Commands {
    /// Creates the commands of a robot with this ROS name and these behavior sets. A lockstep begins with a node that is
    /// present.
    pub fn new(name: &str, sets: Vec<String>, is_lockstep: bool) -> Self {
        Self {
            is_lockstep,
            frames: [String::new(), "base_link".to_owned(), body_frame(name)],
            sets,
            now: SimTime::ZERO,
            is_in_tick: false,
            is_present: is_lockstep,
            activity: Activity::default(),
            latest: None,
            answer: None,
            stored: VecDeque::new(),
        }
    }

    /// Returns the command of an earlier tick, which an agent repeats.
    pub fn stored(&self, tick: SimTime) -> Option<&Command> {
        let mut stored = self.stored.iter();
        stored
            .find(|(time, _)| *time == tick)
            .map(|(_, command)| command)
    }

    /// Begins the tick at the time `now`.
    pub fn begin(&mut self, now: SimTime) {
        self.now = now;
        self.is_in_tick = true;
        self.answer = None;
    }

    /// Returns whether the tick waits for a command.
    pub fn is_waiting(&self) -> bool {
        self.is_lockstep && self.is_present && self.answer.is_none()
    }

    /// Ends a tick with the command that counts. Returns `None` instead if the tick has waited in vain.
    pub fn end(&mut self) -> Option<Command> {
        let has_waited_in_vain = self.is_waiting();
        self.is_in_tick = false;
        let command = if self.is_lockstep {
            self.is_present = self.answer.is_some();
            self.answer.take()
        } else {
            let latest = self.latest.filter(|(at, _)| self.now.since(*at) < IN_FORCE);
            latest.map(|(_, motion)| self.with_activity(motion))
        };
        if self.stored.len() == STORED_TICKS {
            self.stored.pop_front();
        }
        let command = command.unwrap_or_default();
        self.stored.push_back((self.now, command.clone()));
        (!has_waited_in_vain).then_some(command)
    }

    /// Receives a message of a topic.
    ///
    /// # Errors
    /// Returns the reason if the message has no effect on the robot.
    pub fn receive(
        &mut self,
        topic: CommandTopic,
        attachment: &[u8],
        message: &[u8],
    ) -> Result<(), Dropped> {
        if publisher_of(attachment).is_none() {
            let why = "it has no attachment of rmw_zenoh, with sequence number, time and publisher";
            return Err(Dropped::new("attachment", why));
        }
        if message.len() > MAX_BYTES {
            let why = format!("{} bytes exceed {MAX_BYTES}", message.len());
            return Err(Dropped::new("size", why));
        }
        match topic {
            CommandTopic::Action => {
                let text: StringMessage = decoded(message)?;
                self.activity = self.activity_of(&text.data)?;
            }
            CommandTopic::Twist => {
                let motion = motion(&decoded(message)?)?;
                self.latest = Some((self.now, motion));
            }
            CommandTopic::TwistStamped => {
                let command: TwistStamped = decoded(message)?;
                let motion = motion(&command.twist)?;
                let frame = &command.header.frame_id;
                if !self.frames.contains(frame) {
                    let [_, short, full] = &self.frames;
                    let why = format!("the frame is '{frame}'; use '{short}' or '{full}'");
                    return Err(Dropped::new("frame", why));
                }
                if self.is_lockstep {
                    return self.take_answer(&command.header.stamp, motion);
                }
                self.latest = Some((self.now, motion));
            }
        }
        Ok(())
    }

    fn take_answer(&mut self, at: &Time, motion: Motion) -> Result<(), Dropped> {
        let tick = stamp_of(self.now);
        let order = (at.sec, at.nanosec).cmp(&(tick.sec, tick.nanosec));
        if order != Ordering::Greater {
            self.is_present = true;
        }
        if order == Ordering::Equal && self.is_in_tick && self.answer.is_none() {
            self.answer = Some(self.with_activity(motion));
            return Ok(());
        }
        let Time { sec, nanosec } = at;
        let why = format!(
            "the stamp is {sec} s {nanosec} ns, and the tick is {} s {} ns",
            tick.sec, tick.nanosec
        );
        let kind = match order {
            Ordering::Less => "late",
            Ordering::Equal if self.answer.is_some() => "repeated",
            Ordering::Equal => "late",
            Ordering::Greater => "early",
        };
        Err(Dropped::new(kind, why))
    }

    fn with_activity(&self, motion: Motion) -> Command {
        Command {
            motion,
            activity: self.activity.clone(),
        }
    }

    fn activity_of(&self, text: &str) -> Result<Activity, Dropped> {
        let wrong = |why: String| Dropped::new("action", why);
        let value: Value = serde_json::from_str(text).map_err(|error| wrong(error.to_string()))?;
        // A list of values would also be read as the members in their order.
        if !value.is_object()
            || value
                .get("action")
                .is_some_and(|action| !action.is_object())
        {
            return Err(wrong("use an object, with an object as action".to_owned()));
        }
        let activity: Activity =
            serde_json::from_value(value).map_err(|error| wrong(error.to_string()))?;
        match &activity.doing {
            Some(set) if !self.sets.contains(set) => {
                let sets = self.sets.join(", ");
                Err(wrong(format!(
                    "doing '{set}' is not one of the robot's sets; the sets are {sets}"
                )))
            }
            None if activity.progress => Err(wrong("progress needs a set; state doing".to_owned())),
            _ => Ok(activity),
        }
    }
}

fn decoded<M: Message>(message: &[u8]) -> Result<M, Dropped> {
    decode(message).map_err(|error| Dropped::new("encoding", error))
}

/// Returns the motion of a body that drives ahead and turns.
fn motion(twist: &Twist) -> Result<Motion, Dropped> {
    let Twist { linear, angular } = twist;
    let [speed_m_s, turn_rad_s] = [linear.x, angular.z].map(|number| number as f32);
    let all = |vector: &Vector3| [vector.x, vector.y, vector.z].map(|number| number as f32);
    let mut numbers = [all(linear), all(angular)].concat().into_iter();
    if numbers.all(f32::is_finite) {
        Ok(Motion {
            speed_m_s,
            turn_rad_s,
        })
    } else {
        let why = format!("a number is not finite: {linear:?}, {angular:?}");
        Err(Dropped::new("number", why))
    }
}

#[cfg(test)]
mod tests;
