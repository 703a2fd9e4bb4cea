//! The rows of the log's tables as typed messages with all columns.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use anyhow::Context;
use foxglove::Encode;
use foxglove::messages::{Log, log::Level};
use run_log::recorder::{EventKind, FaultEvent};
use run_log::{
    AllocationRow, EventRow, MessageRow, MissionRow, MotivationRow, PoseRow, RunLog, TableRow,
    TargetRow,
};
use scenario::Scenario;
use scenario::mission::columns::Column;
use scenario::time::SimTime;

use super::merge::Stream;
use super::mission;
use super::recording::{Channel, Message, Recording};
use super::well_known::stamp;

/// Event kinds that `/log` records as warnings.
const WARNINGS: [EventKind; 7] = [
    EventKind::AgentLost,
    EventKind::Stalled,
    EventKind::Lost,
    EventKind::EnergyOut,
    EventKind::Fault(FaultEvent::Applied),
    EventKind::Fault(FaultEvent::Hit),
    EventKind::Fault(FaultEvent::Failed),
];

/// Channels by robot and behavior set.
type ByBehavior<M> = BTreeMap<String, BTreeMap<String, Channel<M>>>;

/// The topics of the tables. Plots select topics, so each curve has its own.
pub struct TableTopics {
    motivations: ByBehavior<Motivation>,
    /// Topics of robots with another allocator than ALLIANCE.
    allocation: ByBehavior<Allocation>,
    poses: BTreeMap<String, Channel<Pose>>,
    targets: BTreeMap<String, Channel<Target>>,
    messages: Channel<Reception>,
    events: Channel<Event>,
    mission: u16,
    columns: &'static [Column],
    log: Channel<Log>,
    threshold: Channel<Threshold>,
    theta: f64,
}

#[derive(Encode)]
struct Motivation {
    t_ms: u64,
    robot: String,
    behavior_set: String,
    task: String,
    motivation: f64,
    impatience: f64,
    sensory_feedback: bool,
    activity_suppression: bool,
    impatience_reset: bool,
    acquiescence: bool,
    state: String,
}

#[derive(Encode)]
struct Allocation {
    t_ms: u64,
    robot: String,
    task: String,
    behavior_set: String,
    utility: f64,
    holder: String,
    state: String,
}

#[derive(Encode)]
struct Pose {
    t_ms: u64,
    robot: String,
    x_m: f32,
    y_m: f32,
    heading_rad: f32,
    speed_m_s: f32,
    carrying: bool,
    behavior_set: String,
    energy: Option<f32>,
}

#[derive(Encode)]
struct Target {
    t_ms: u64,
    target: String,
    x_m: f32,
    y_m: f32,
    observers: u32,
}

#[derive(Encode)]
struct Reception {
    t_ms: u64,
    receiver: String,
    sender: String,
    incarnation: u32,
    seq: Option<u64>,
    kind: String,
    state: String,
    since_ms: Option<u64>,
    behavior_set: String,
    task: String,
    progress: Option<u32>,
    sent_ms: u64,
    delivery: String,
}

#[derive(Encode)]
struct Event {
    t_ms: u64,
    kind: String,
    robot: String,
    subject: String,
    reason: String,
    detail: String,
}

#[derive(Encode)]
struct Threshold {
    motivation: f64,
}

impl TableTopics {
    /// Creates the topics for the tables of a log.
    pub fn new<W: Write + Seek>(
        recording: &mut Recording<W>,
        log: &RunLog,
    ) -> anyhow::Result<Self> {
        let setup = &log.run.setup;
        let catalog = &setup.catalog;
        let columns = catalog.mission.vocabulary().columns;
        let mut motivations = BTreeMap::new();
        let mut allocation = BTreeMap::new();
        let mut poses = BTreeMap::new();
        for robot in &setup.scenario.robots {
            let name = &robot.name;
            let sets = catalog.behaviors_of(robot);
            let sets: Vec<&str> = sets.map(|set| catalog.behavior_name(set)).collect();
            let topics = by_behavior(recording, "motivations", name, &sets)?;
            motivations.insert(name.clone(), topics);
            if setup.scenario.decider_of(robot) != Scenario::DEFAULT_ALLOCATOR {
                let topics = by_behavior(recording, "allocation", name, &sets)?;
                allocation.insert(name.clone(), topics);
            }
            poses.insert(name.clone(), recording.channel(&format!("/poses/{name}"))?);
        }
        let mut targets = BTreeMap::new();
        // Each tick has one row per target.
        let mut rows = log.each_row::<TargetRow>().peekable();
        let first = rows.peek().and_then(|row| row.as_ref().ok());
        let begin = first.map(|row| row.t_ms);
        for row in rows {
            let row = row?;
            if Some(row.t_ms) != begin {
                break;
            }
            let topic = format!("/targets/{}", row.target);
            targets.insert(row.target, recording.channel(&topic)?);
        }
        Ok(Self {
            motivations,
            allocation,
            poses,
            targets,
            messages: recording.channel("/messages")?,
            events: recording.channel("/events")?,
            mission: recording.raw_channel("/mission", &mission::schema(columns), "protobuf")?,
            columns,
            log: recording.channel("/log")?,
            threshold: recording.channel("/threshold")?,
            theta: setup.alliance.threshold,
        })
    }

    /// Returns all messages from the tables of a full log.
    pub fn streams<'s>(&'s self, log: &'s RunLog) -> [Stream<'s>; 9] {
        let end = log.run.result.sim_time_ms;
        let threshold = Threshold {
            motivation: self.theta,
        };
        let ends = [SimTime::ZERO, end].map(|at| Ok(self.threshold.message(at, &threshold)));
        [
            stream(log, |row| self.motivation(row)),
            stream(log, |row| self.allocation(row)),
            stream(log, |row| self.pose(row)),
            stream(log, |row| self.target(row)),
            stream(log, |row| Ok(self.reception(row))),
            stream(log, |row| Ok(self.event(row))),
            stream(log, |row| Ok(self.mission(&row))),
            stream(log, |row| Ok(self.sentence(&row))),
            Box::new(ends.into_iter()),
        ]
    }

    fn motivation(&self, row: MotivationRow) -> anyhow::Result<Message> {
        let channel = channel(&self.motivations, &row.robot, &row.behavior_set)?;
        let message = Motivation {
            t_ms: row.t_ms.0,
            robot: row.robot,
            behavior_set: row.behavior_set,
            task: row.task,
            motivation: row.motivation,
            impatience: row.impatience,
            sensory_feedback: row.sensory_feedback,
            activity_suppression: row.activity_suppression,
            impatience_reset: row.impatience_reset,
            acquiescence: row.acquiescence,
            state: row.state,
        };
        Ok(channel.message(row.t_ms, &message))
    }

    fn allocation(&self, row: AllocationRow) -> anyhow::Result<Message> {
        let channel = channel(&self.allocation, &row.robot, &row.behavior_set)?;
        let message = Allocation {
            t_ms: row.t_ms.0,
            robot: row.robot,
            task: row.task,
            behavior_set: row.behavior_set,
            utility: row.utility,
            holder: row.holder,
            state: row.state,
        };
        Ok(channel.message(row.t_ms, &message))
    }

    fn pose(&self, row: PoseRow) -> anyhow::Result<Message> {
        let channel = self
            .poses
            .get(&row.robot)
            .with_context(|| format!("run.json has no robot {}", row.robot))?;
        let message = Pose {
            t_ms: row.t_ms.0,
            robot: row.robot,
            x_m: row.x_m,
            y_m: row.y_m,
            heading_rad: row.heading_rad,
            speed_m_s: row.speed_m_s,
            carrying: row.carrying,
            behavior_set: row.behavior_set,
            energy: row.energy,
        };
        Ok(channel.message(row.t_ms, &message))
    }

    fn target(&self, row: TargetRow) -> anyhow::Result<Message> {
        let channel = self
            .targets
            .get(&row.target)
            .with_context(|| format!("the log begins without target {}", row.target))?;
        let message = Target {
            t_ms: row.t_ms.0,
            target: row.target,
            x_m: row.x_m,
            y_m: row.y_m,
            observers: row.observers,
        };
        Ok(channel.message(row.t_ms, &message))
    }

    fn reception(&self, row: MessageRow) -> Message {
        let message = Reception {
            t_ms: row.t_ms.0,
            receiver: row.receiver,
            sender: row.sender,
            incarnation: row.incarnation,
            seq: row.seq,
            kind: row.kind,
            state: row.state,
            since_ms: row.since_ms.map(|time| time.0),
            behavior_set: row.behavior_set,
            task: row.task,
            progress: row.progress,
            sent_ms: row.sent_ms.0,
            delivery: row.delivery,
        };
        self.messages.message(row.t_ms, &message)
    }

    fn event(&self, row: EventRow) -> Message {
        let message = Event {
            t_ms: row.t_ms.0,
            kind: row.kind,
            robot: row.robot,
            subject: row.subject,
            reason: row.reason,
            detail: row.detail,
        };
        self.events.message(row.t_ms, &message)
    }

    fn mission(&self, row: &MissionRow) -> Message {
        Message {
            at: row.t_ms,
            channel: self.mission,
            bytes: mission::message(self.columns, row),
        }
    }

    /// Returns an event as a sentence for `/log`.
    fn sentence(&self, row: &EventRow) -> Message {
        let message = Log {
            timestamp: Some(stamp(row.t_ms)),
            level: level(&row.kind).into(),
            message: text(row),
            name: match &*row.robot {
                "" => "world",
                robot => robot,
            }
            .to_owned(),
            file: String::new(),
            line: 0,
        };
        self.log.message(row.t_ms, &message)
    }
}

/// Creates a topic for each behavior set of a robot.
fn by_behavior<W: Write + Seek, M: Encode>(
    recording: &mut Recording<W>,
    table: &str,
    robot: &str,
    sets: &[&str],
) -> anyhow::Result<BTreeMap<String, Channel<M>>> {
    let topics = sets.iter().map(|set| {
        let topic = format!("/{table}/{robot}/{set}");
        Ok(((*set).to_owned(), recording.channel(&topic)?))
    });
    topics.collect()
}

fn channel<'c, M>(
    channels: &'c ByBehavior<M>,
    robot: &str,
    set: &str,
) -> anyhow::Result<&'c Channel<M>> {
    let of_robot = channels.get(robot);
    of_robot
        .and_then(|sets| sets.get(set))
        .with_context(|| format!("{robot} has no {set}"))
}

fn stream<'s, R: TableRow + 's>(
    log: &'s RunLog,
    message: impl Fn(R) -> anyhow::Result<Message> + 's,
) -> Stream<'s> {
    Box::new(log.each_row::<R>().map(move |row| message(row?)))
}

fn level(kind: &str) -> Level {
    match WARNINGS.iter().any(|warning| warning.to_string() == kind) {
        true => Level::Warning,
        false => Level::Info,
    }
}

/// Describes an event, for example `activated push(left): threshold, push(left)`.
fn text(row: &EventRow) -> String {
    let what = [&*row.kind, &*row.subject].join(" ");
    let why: Vec<&str> = [&*row.reason, &*row.detail]
        .into_iter()
        .filter(|part| !part.is_empty())
        .collect();
    match why.as_slice() {
        [] => what.trim_end().to_owned(),
        why => format!("{}: {}", what.trim_end(), why.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(fields: [&str; 5], expected: (Level, &str)) {
        let [kind, robot, subject, reason, detail] = fields.map(ToOwned::to_owned);
        let row = EventRow {
            t_ms: SimTime::ZERO,
            kind,
            robot,
            subject,
            reason,
            detail,
        };
        assert_eq!((level(&row.kind), &*text(&row)), expected);
    }

    #[test]
    fn events_in_words() {
        check(
            ["activated", "blue", "move-spill(top)", "threshold", ""],
            (Level::Info, "activated move-spill(top): threshold"),
        );
        check(["reported", "blue", "", "", ""], (Level::Info, "reported"));
        check(
            ["gone", "gold", "", "", "incarnation 1"],
            (Level::Warning, "gone: incarnation 1"),
        );
        check(
            ["hit", "", "f1", "", "kill gold"],
            (Level::Warning, "hit f1: kill gold"),
        );
        check(
            ["healed", "", "f1", "over", "kill gold"],
            (Level::Info, "healed f1: over, kill gold"),
        );
    }
}
