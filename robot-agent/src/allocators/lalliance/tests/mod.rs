//! Tests of L-ALLIANCE: its measurements, and the properties of docs/ALLOCATORS.md, "The laws".

mod laws;
mod learning;
mod trials;

use std::sync::Arc;

use glam::Vec2;
use proto::mission::SharedKnowledge;
use proto::team::{Broadcast, BroadcastContent, Heartbeat, TaskState};
use scenario::ids::{BehaviorId, Incarnation, RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Preset, Switches};

use super::{Config, Learner, Ordering, Strategy};
use crate::allocator::{
    Input, OwnBehavior, RandomDraws, RunningAllocator, SelfState, StepOutcome, TaskBrief,
};

const THRESHOLD: f64 = 100.0;
const STEP: SimTime = SimTime(100);
const TAU: SimTime = SimTime(5000);
const STRATEGIES: [Strategy; 4] = [Strategy::I, Strategy::II, Strategy::III, Strategy::IV];
const ORDERINGS: [Ordering; 3] = [
    Ordering::LongestFirst,
    Ordering::ShortestFirst,
    Ordering::Random,
];

/// Creates a robot of a team in which all robots can do all tasks; `unit_s` contains the work of each task.
fn me(rank: u16, team: usize, unit_s: &[f64]) -> SelfState {
    let brief = |unit_s: &f64| TaskBrief {
        max_robots: 1,
        priority: 0,
        unit_s: *unit_s,
        robots: (0..team as u16).map(RobotId).collect(),
    };
    let behaviors = (0..unit_s.len() as u16).map(|task| OwnBehavior {
        id: BehaviorId(task),
        task: TaskId(task),
        max_robots: 1,
        priority: 0,
    });
    SelfState {
        robot: RobotId(rank),
        incarnation: 1,
        team,
        tasks: unit_s.len(),
        briefs: unit_s.iter().map(brief).collect(),
        behaviors: behaviors.collect(),
        step_s: STEP.as_secs_f64(),
        heartbeat_period: SimTime(1000),
        ceased_after: TAU,
        assigned: [].into(),
    }
}

/// Creates a teammate's heartbeat about a task.
fn heartbeat(
    sender: u16,
    stamp: (Incarnation, u64),
    sent: SimTime,
    report: Report,
) -> Arc<Broadcast> {
    let (state, task, progress) = report;
    Arc::new(Broadcast {
        sender: RobotId(sender),
        incarnation: stamp.0,
        tick: 0,
        index: 0,
        seq: stamp.1,
        sent,
        body: BroadcastContent::Heartbeat(Heartbeat {
            state,
            since: sent,
            set: task.map(BehaviorId),
            task: task.map(TaskId),
            progress,
            position: Some(Vec2::ONE),
            carrying: false,
            shared_knowledge: SharedKnowledge::default(),
        }),
    })
}

/// The state, task and progress of a heartbeat.
type Report = (TaskState, Option<u16>, u32);

/// A robot with scripted teammates.
struct Solo {
    learner: Learner,
    now: SimTime,
    seq: u64,
    outcome: StepOutcome,
}

impl Solo {
    fn new(me: &SelfState, config: &Config, switches: Switches) -> Self {
        Self {
            learner: Learner::new(me, config, THRESHOLD, switches),
            now: SimTime::ZERO,
            seq: 0,
            outcome: StepOutcome::default(),
        }
    }

    fn report(&mut self, sender: u16, report: Report) -> Arc<Broadcast> {
        self.seq += 1;
        heartbeat(sender, (1, self.seq), self.now, report)
    }

    /// Makes one step at `now` and advances the time.
    fn step(&mut self, applicable: &[bool], received: &[Arc<Broadcast>], progressed: &[u16]) {
        let progressed: Vec<TaskId> = progressed.iter().copied().map(TaskId).collect();
        let input = Input {
            now: self.now,
            step_s: STEP.as_secs_f64(),
            position: None,
            is_laden: false,
            applicable,
            choices: &[],
            progressed: &progressed,
            received,
            seconds: &|_, _| None,
            ground_truth: &[],
            draws: RandomDraws::new(7, RobotId(0), self.now.0 / STEP.0),
        };
        self.learner.step(&input, &mut self.outcome);
        self.now = self.now + STEP;
    }

    fn active(&self) -> Option<u16> {
        self.outcome.active.map(|behavior| behavior.0)
    }
}

/// G1 to G4, for each strategy, ordering and preset, with and without active learning.
#[test]
fn l_alliance_keeps_the_properties_of_all_allocators() {
    for (strategy, ordering, learning_trials, preset) in [
        (Strategy::I, Ordering::LongestFirst, 0, Preset::Par98),
        (Strategy::II, Ordering::ShortestFirst, 3, Preset::Thesis),
        (Strategy::III, Ordering::Random, 0, Preset::Team),
        (Strategy::IV, Ordering::LongestFirst, 0, Preset::Team),
        (Strategy::IV, Ordering::LongestFirst, 1, Preset::Team),
    ] {
        let config = Config {
            strategy,
            ordering,
            learning_trials,
            learning_limit_s: 10.0,
            ..Config::default()
        };
        let switches = preset.switches();
        crate::testkit::check_running_allocator(|me| {
            Box::new(Learner::new(&me, &config, THRESHOLD, switches))
        });
    }
}
