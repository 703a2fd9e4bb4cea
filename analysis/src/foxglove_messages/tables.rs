//! The rows of the log's tables as typed messages with all columns.

use anyhow::Context;
use foxglove::messages::{Log, log::Level};
use foxglove::{Encode, Schema};
use missions::Registry;
use run_log::recorder::{EventKind, FaultEvent};
use run_log::{
    AllocationRow, EventRow, MessageRow, MissionRow, MotivationRow, PoseRow, TableRow, TargetRow,
};
use scenario::time::SimTime;
use scenario::{Scenario, Setup};
use std::collections::BTreeMap;
use world_server::world::World;

use super::merge::Stream;
use super::proto;
use super::topics::{Channel, Message, Topics};
use super::well_known::stamp;
use crate::columns::{Column, declared, of_mission};
use crate::live::RowSource;

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

    fn add(&mut self, to: &mut dyn Topics, topic: String) -> anyhow::Result<()> {
        let channel = to.add(&topic, &self.schema, "protobuf")?;
        self.channels.insert(topic, channel);
        Ok(())
    }

    /// Returns the messages of all rows.
    fn stream<'s>(&'s self, rows: &'s impl RowSource) -> Stream<'s>
    where
        R: 's,
    {
        Box::new(rows.each_row::<R>().map(|row| {
            let row = row?;
            let (topic, at) = (self.place)(&row);
            let channel = self.channels.get(&topic);
            Ok(Message {
                at,
                channel: *channel.with_context(|| format!("the topic {topic} is missing"))?,
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
    /// Adds the topics for the tables of a run.
    pub fn new(to: &mut dyn Topics, setup: &Setup) -> anyhow::Result<Self> {
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
                motivations.add(to, format!("/motivations/{name}/{set}"))?;
            }
            if setup.scenario.decider_of(robot) != Scenario::DEFAULT_ALLOCATOR {
                for set in catalog.behaviors_of(robot) {
                    let set = catalog.behavior_name(set);
                    allocation.add(to, format!("/allocation/{name}/{set}"))?;
                }
            }
            poses.add(to, format!("/poses/{name}"))?;
        }
        let mut targets = RowTopics::new("Target", declared(), |row: &TargetRow| {
            (format!("/targets/{}", row.target), row.t_ms)
        });
        for number in 0..count_targets(setup)? {
            targets.add(to, format!("/targets/t{number}"))?;
        }
        let place = |row: &MessageRow| (MESSAGES.to_owned(), row.t_ms);
        let mut messages = RowTopics::new("Reception", declared(), place);
        messages.add(to, MESSAGES.to_owned())?;
        let place = |row: &EventRow| (EVENTS.to_owned(), row.t_ms);
        let mut events = RowTopics::new("Event", declared(), place);
        events.add(to, EVENTS.to_owned())?;
        let columns = of_mission(catalog.mission.vocabulary().columns);
        let place = |row: &MissionRow| (MISSION.to_owned(), row.t_ms);
        let mut mission = RowTopics::new("Mission", columns, place);
        mission.add(to, MISSION.to_owned())?;
        Ok(Self {
            motivations,
            allocation,
            poses,
            targets,
            messages,
            events,
            mission,
            log: to.channel("/log")?,
            threshold: to.channel("/threshold")?,
            theta: setup.alliance.threshold,
        })
    }

    /// Returns the messages of all rows, one stream for each table and one for `/log`.
    pub fn streams<'s>(&'s self, rows: &'s impl RowSource) -> [Stream<'s>; 8] {
        [
            self.motivations.stream(rows),
            self.allocation.stream(rows),
            self.poses.stream(rows),
            self.targets.stream(rows),
            self.messages.stream(rows),
            self.events.stream(rows),
            self.mission.stream(rows),
            Box::new(rows.each_row().map(|row| Ok(self.sentence(&row?)))),
        ]
    }

    /// Returns the message of `/threshold`.
    pub fn threshold(&self, at: SimTime) -> Message {
        let motivation = self.theta;
        self.threshold.message(at, &Threshold { motivation })
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

/// Returns the number of targets, which is constant. The log names them t0, t1 and so on.
fn count_targets(setup: &Setup) -> anyhow::Result<usize> {
    let kind = Registry::current().worlds().find(&setup.scenario)?;
    let mut targets = Vec::new();
    World::new(setup, kind).mission().targets(&mut targets);
    Ok(targets.len())
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
