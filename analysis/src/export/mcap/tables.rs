//! The rows of the log's tables as typed messages with all columns.

use anyhow::Context;
use foxglove::messages::{Log, log::Level};
use foxglove::{Encode, Schema};
use run_log::recorder::{EventKind, FaultEvent};
use run_log::{
    AllocationRow, EventRow, MessageRow, MissionRow, MotivationRow, PoseRow, RunLog, TableRow,
    TargetRow,
};
use scenario::Scenario;
use scenario::time::SimTime;
use std::collections::BTreeMap;

use super::merge::Stream;
use super::proto;
use super::recording::{Channel, Message, Recording};
use super::well_known::stamp;
use crate::columns::{Column, declared, of_mission};

const MESSAGES: &str = "/messages";
const EVENTS: &str = "/events";
const MISSION: &str = "/mission";

/// Event kinds that `/log` records as warnings.
const WARNINGS: [EventKind; 7] = [
    EventKind::Gone,
    EventKind::Stalled,
    EventKind::Lost,
    EventKind::EnergyOut,
    EventKind::Fault(FaultEvent::Applied),
    EventKind::Fault(FaultEvent::Hit),
    EventKind::Fault(FaultEvent::Failed),
];

/// The topics of a table, which share a message type.
struct RowTopics<R> {
    schema: Schema,
    columns: Vec<Column<R>>,
    /// Returns the topic and the time of a row.
    place: fn(&R) -> (String, SimTime),
    /// The channels by topic.
    channels: BTreeMap<String, u16>,
}

impl<R: TableRow> RowTopics<R> {
    /// Creates the topics of messages called `name` with these columns.
    fn new(name: &str, columns: Vec<Column<R>>, place: fn(&R) -> (String, SimTime)) -> Self {
        Self {
            schema: proto::schema(name, &columns),
            columns,
            place,
            channels: BTreeMap::new(),
        }
    }

    fn add(&mut self, recording: &mut Recording<'_>, topic: String) -> anyhow::Result<()> {
        let channel = recording.raw_channel(&topic, &self.schema, "protobuf")?;
        self.channels.insert(topic, channel);
        Ok(())
    }

    /// Returns the messages of all rows of a log.
    fn stream<'s>(&'s self, log: &'s RunLog) -> Stream<'s>
    where
        R: 's,
    {
        Box::new(log.each_row::<R>().map(|row| {
            let row = row?;
            let (topic, at) = (self.place)(&row);
            let channel = self.channels.get(&topic);
            Ok(Message {
                at,
                channel: *channel.with_context(|| format!("the log begins without {topic}"))?,
                bytes: proto::message(&self.columns, &row),
            })
        }))
    }
}

/// The topics of the tables. Plots select topics, so each curve has its own.
pub struct TableTopics {
    motivations: RowTopics<MotivationRow>,
    /// Topics of robots with another allocator than ALLIANCE.
    allocation: RowTopics<AllocationRow>,
    poses: RowTopics<PoseRow>,
    targets: RowTopics<TargetRow>,
    messages: RowTopics<MessageRow>,
    events: RowTopics<EventRow>,
    mission: RowTopics<MissionRow>,
    log: Channel<Log>,
    threshold: Channel<Threshold>,
    theta: f64,
}

#[derive(Encode)]
struct Threshold {
    motivation: f64,
}

impl TableTopics {
    /// Creates the topics for the tables of a log.
    pub fn new(recording: &mut Recording<'_>, log: &RunLog) -> anyhow::Result<Self> {
        let setup = &log.run.setup;
        let catalog = &setup.catalog;
        let mut motivations = RowTopics::new("Motivation", declared(), |row: &MotivationRow| {
            let topic = format!("/motivations/{}/{}", row.robot, row.behavior_set);
            (topic, row.t_ms)
        });
        let mut allocation = RowTopics::new("Allocation", declared(), |row: &AllocationRow| {
            let topic = format!("/allocation/{}/{}", row.robot, row.behavior_set);
            (topic, row.t_ms)
        });
        let mut poses = RowTopics::new("Pose", declared(), |row: &PoseRow| {
            (format!("/poses/{}", row.robot), row.t_ms)
        });
        for robot in &setup.scenario.robots {
            let name = &robot.name;
            for set in catalog.behaviors_of(robot) {
                let set = catalog.behavior_name(set);
                motivations.add(recording, format!("/motivations/{name}/{set}"))?;
            }
            if setup.scenario.decider_of(robot) != Scenario::DEFAULT_ALLOCATOR {
                for set in catalog.behaviors_of(robot) {
                    let set = catalog.behavior_name(set);
                    allocation.add(recording, format!("/allocation/{name}/{set}"))?;
                }
            }
            poses.add(recording, format!("/poses/{name}"))?;
        }
        let mut targets = RowTopics::new("Target", declared(), |row: &TargetRow| {
            (format!("/targets/{}", row.target), row.t_ms)
        });
        // Each tick has one row per target.
        let mut rows = log.each_row::<TargetRow>().peekable();
        let first = rows.peek().and_then(|row| row.as_ref().ok());
        let begin = first.map(|row| row.t_ms);
        for row in rows {
            let row = row?;
            if Some(row.t_ms) != begin {
                break;
            }
            targets.add(recording, format!("/targets/{}", row.target))?;
        }
        let place = |row: &MessageRow| (MESSAGES.to_owned(), row.t_ms);
        let mut messages = RowTopics::new("Reception", declared(), place);
        messages.add(recording, MESSAGES.to_owned())?;
        let place = |row: &EventRow| (EVENTS.to_owned(), row.t_ms);
        let mut events = RowTopics::new("Event", declared(), place);
        events.add(recording, EVENTS.to_owned())?;
        let columns = of_mission(catalog.mission.vocabulary().columns);
        let place = |row: &MissionRow| (MISSION.to_owned(), row.t_ms);
        let mut mission = RowTopics::new("Mission", columns, place);
        mission.add(recording, MISSION.to_owned())?;
        Ok(Self {
            motivations,
            allocation,
            poses,
            targets,
            messages,
            events,
            mission,
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
            self.motivations.stream(log),
            self.allocation.stream(log),
            self.poses.stream(log),
            self.targets.stream(log),
            self.messages.stream(log),
            self.events.stream(log),
            self.mission.stream(log),
            Box::new(log.each_row().map(|row| Ok(self.sentence(&row?)))),
            Box::new(ends.into_iter()),
        ]
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
