//! A small hand-made run and helpers for the tests.

mod allocation_messages;
mod background;
mod compact;
mod contents;
mod figures;
mod hashes;
mod messages;
mod repeated;
mod round_trips;
mod torn;

use crate::{
    EventRow, HitRow, Input, MemoryLog, MessageRow, MotivationRow, PoseRow, RUN_SECTION,
    RobotFigures, RunLog, SentRow, Table, TickRow,
};
use glam::Vec2;
use proto::mission::SensorReading;
use proto::readings::{Actuation, Pose, Readings};
use proto::team::{Broadcast, BroadcastKind, TaskState};
use proto::telemetry::{
    BehaviorState, BroadcastSummary, Delivery, Motivation, Note, NoteKind, Reason, Reception,
    StateChange,
};
use proto::tick::{Outcome, Report};
use scenario::ids::{BehaviorId, RobotId, TaskId, Tick};
use scenario::mission::{FigureValue, Target};
use scenario::testkit::default_setup;
use scenario::time::SimTime;

use super::*;

const BLUE: RobotId = RobotId(0);
const GOLD: RobotId = RobotId(1);

/// An owned [`TickRecord`].
#[derive(Clone, Debug)]
struct OwnedTick {
    tick: Tick,
    now: SimTime,
    inputs: Vec<Input>,
    robots: Vec<(BodyRecord, Option<(Readings, Report)>)>,
    external: Vec<bool>,
    broadcasts: Vec<Broadcast>,
    allocation_messages: Vec<Broadcast>,
    events: Vec<Event>,
    hits: Vec<FaultHits>,
    mission: Vec<FigureValue>,
    targets: Vec<Target>,
    mission_state: u64,
}

impl OwnedTick {
    fn record(&self, recorder: &mut impl Record) -> Result<(), RecordError> {
        let bodies: Vec<_> = self.robots.iter().map(|(body, _)| *body).collect();
        let mut answers = Answers::new(self.robots.len());
        for (readings, report) in self.robots.iter().filter_map(|(_, answer)| answer.as_ref()) {
            answers.all_mut()[report.robot.index()].mark_readings_changed();
            answers.store(readings, report);
        }
        let counted: Vec<_> = self
            .robots
            .iter()
            .map(|(_, answer)| answer.is_some())
            .collect();
        answers.count(&counted);
        recorder.record(&TickRecord {
            tick: self.tick,
            now: self.now,
            inputs: &self.inputs,
            bodies: &bodies,
            answers: answers.all(),
            external: &self.external,
            broadcasts: &self.broadcasts,
            allocation_messages: &self.allocation_messages,
            events: &self.events,
            hits: &self.hits,
            mission: &self.mission,
            targets: &self.targets,
            mission_state: self.mission_state,
        })
    }

    fn blue(&mut self) -> &mut (Readings, Report) {
        self.robots[0].1.as_mut().unwrap()
    }
}

/// Returns the header line of a table.
fn header(table: Table) -> &'static str {
    let mission_header = "t_ms,left,held,lost,done,last_ms\n";
    table.header().unwrap_or(mission_header)
}

/// Logs a run that ends after these ticks.
fn log(level: LogLevel, ticks: &[OwnedTick]) -> (RunFile, MemoryLog) {
    log_with(level, ticks, Ending::default())
}

fn log_with(level: LogLevel, ticks: &[OwnedTick], ending: Ending) -> (RunFile, MemoryLog) {
    let mut recorder = Recorder::new(&default_setup(7), level, MemoryLog::default()).unwrap();
    for tick in ticks {
        tick.record(&mut recorder).unwrap();
    }
    let run = recorder.finish(Outcome::TimeLimit, ending).unwrap();
    (run, recorder.into_sink())
}

/// Reads a log in memory.
fn read(run: RunFile, memory: MemoryLog) -> RunLog {
    RunLog::from_tables(Path::new(""), run, memory.tables)
}

fn report(robot: RobotId, tick: Tick) -> Report {
    Report {
        robot,
        incarnation: 1,
        tick,
        actuation: Actuation::default(),
        broadcasts: 0,
        broadcast_bytes: 0,
        active: None,
        allocation: Vec::new(),
        motivations: Vec::new(),
        changes: Vec::new(),
        notes: Vec::new(),
        receptions: Vec::new(),
    }
}

fn motivation(set: u32, motivation: f64) -> Motivation {
    Motivation {
        set: BehaviorId(set),
        motivation,
        impatience: 0.1,
        sensory_feedback: true,
        activity_suppression: true,
        impatience_reset: true,
        acquiescence: true,
        state: BehaviorState::Hibernating,
    }
}

fn body(x: f32, y: f32) -> BodyRecord {
    BodyRecord {
        present: true,
        pose: Pose {
            position: Vec2::new(x, y),
            heading_rad: -2.5,
        },
        ..BodyRecord::default()
    }
}

fn row(counts: [u32; 4], last_ms: Option<u64>) -> Vec<FigureValue> {
    let counts = counts.into_iter().map(FigureValue::from);
    counts.chain([last_ms.into()]).collect()
}

/// Returns three ticks. Tick 0: all robots join. Tick 1: blue activates a behavior set, receives gold's first broadcast, misses
/// the second, and completes a task; green is out of the barrier. Tick 2: no change.
fn sample() -> Vec<OwnedTick> {
    let tick = |tick: Tick| OwnedTick {
        tick,
        now: SimTime(tick * 50),
        inputs: Vec::new(),
        robots: vec![
            (
                body(0.3, 4.5),
                Some((Readings::default(), report(BLUE, tick))),
            ),
            (
                body(0.3, 4.0),
                Some((Readings::default(), report(GOLD, tick))),
            ),
            (body(0.3, 3.5), None),
        ],
        external: Vec::new(),
        broadcasts: Vec::new(),
        allocation_messages: Vec::new(),
        events: Vec::new(),
        hits: Vec::new(),
        mission: row([23, 1, 0, 0], None),
        targets: Vec::new(),
        mission_state: 0,
    };
    let mut ticks = [0, 1, 2].map(tick);

    let join = |robot: &str| Input::Join {
        robot: robot.to_owned(),
        incarnation: 1,
        moment: None,
        scripted: false,
    };
    ticks[0].inputs = ["blue", "gold", "green"].map(join).to_vec();

    let second = &mut ticks[1];
    second.inputs = vec![Input::StallBegin {
        robot: "green".to_owned(),
        scripted: false,
    }];
    second.robots[0].0 = BodyRecord {
        speed_m_s: 0.5,
        carrying: true,
        energy_j: Some(49_999.75),
        active: Some(BehaviorId(0)),
        ..body(0.325, 4.5)
    };
    let (_, gold) = second.robots[1].1.as_mut().unwrap();
    gold.broadcasts = 2;
    gold.broadcast_bytes = 250;
    let (readings, blue) = second.blue();
    readings.mission = SensorReading::new(Vec2::new(0.5, -0.25));
    blue.actuation.speed_m_s = 0.5;
    blue.motivations = vec![
        Motivation {
            state: BehaviorState::Active,
            ..motivation(0, 100.0)
        },
        Motivation {
            activity_suppression: false,
            ..motivation(1, 0.0)
        },
    ];
    blue.changes = vec![
        StateChange {
            set: BehaviorId(2),
            from: BehaviorState::Active,
            to: BehaviorState::Hibernating,
            reason: Reason::ResetBy(GOLD),
        },
        StateChange {
            set: BehaviorId(0),
            from: BehaviorState::Hibernating,
            to: BehaviorState::Active,
            reason: Reason::Threshold,
        },
    ];
    blue.notes = vec![Note {
        kind: NoteKind::Detour,
        detail: "left, \"0.4 m\"".to_owned(),
    }];
    let received = Reception {
        at: SimTime(50),
        sender: GOLD,
        incarnation: 1,
        sent: SimTime(0),
        delivery: Delivery::Received,
        content: Some(BroadcastSummary {
            seq: 0,
            kind: BroadcastKind::Heartbeat,
            state: Some(TaskState::Executing),
            since: Some(SimTime(0)),
            set: Some(BehaviorId(3)),
            task: Some(TaskId(2)),
            progress: Some(4),
        }),
    };
    blue.receptions = vec![
        received,
        Reception {
            delivery: Delivery::Lost,
            content: None,
            ..received
        },
    ];
    second.events = vec![
        Event {
            subject: "task-3".to_owned(),
            ..Event::new(EventKind::Mission("done"), Some(BLUE))
        },
        Event::new(EventKind::Mission("told"), Some(GOLD)),
    ];
    second.mission = row([23, 0, 0, 1], Some(50));
    second.mission_state = 1;
    ticks[2].mission = ticks[1].mission.clone();
    ticks[2].mission_state = 1;
    ticks.to_vec()
}
