//! Tests of L-ALLIANCE: its measurements, and the properties of docs/ALLOCATORS.md, "The laws".

mod laws;
mod learning;
mod trials;

use std::sync::Arc;

use proto::team::{Broadcast, TaskState};
use scenario::ids::{BehaviorId, Incarnation, RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Preset, Switches};

use super::{Config, Learner, Ordering, Strategy};
use crate::allocator::{
    Announcement, Input, RandomDraws, RunningAllocator, SelfState, StepOutcome,
};
use crate::fixtures::{self, TAU};

const THRESHOLD: f64 = 100.0;
const STEP: SimTime = SimTime(100);
const STRATEGIES: [Strategy; 4] = [Strategy::I, Strategy::II, Strategy::III, Strategy::IV];
const ORDERINGS: [Ordering; 3] = [
    Ordering::LongestFirst,
    Ordering::ShortestFirst,
    Ordering::Random,
];

/// Creates a robot of a team in which all robots can do all tasks; `unit_s` contains the work of each task.
fn me(rank: u32, team: usize, unit_s: &[f64]) -> SelfState {
    let briefs = unit_s.iter().map(|&unit_s| fixtures::brief(team, unit_s));
    SelfState {
        step_s: STEP.as_secs_f64(),
        ..fixtures::self_state(RobotId(rank), team, briefs.collect())
    }
}

/// Creates a teammate's heartbeat about a task.
fn heartbeat(
    sender: u32,
    stamp: (Incarnation, u64),
    sent: SimTime,
    report: Report,
) -> Arc<Broadcast> {
    let (state, task, progress) = report;
    let body = fixtures::heartbeat(&Announcement {
        state,
        since: sent,
        behavior: task.map(BehaviorId),
        task: task.map(TaskId),
        progress,
    });
    Arc::new(fixtures::broadcast(RobotId(sender), stamp, sent, body))
}

/// The state, task and progress of a heartbeat.
type Report = (TaskState, Option<u32>, u32);

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

    fn report(&mut self, sender: u32, report: Report) -> Arc<Broadcast> {
        self.seq += 1;
        heartbeat(sender, (1, self.seq), self.now, report)
    }

    /// Makes one step at `now` and advances the time.
    fn step(&mut self, applicable: &[bool], received: &[Arc<Broadcast>], progressed: &[u32]) {
        let progressed: Vec<TaskId> = progressed.iter().copied().map(TaskId).collect();
        let input = Input {
            step_s: STEP.as_secs_f64(),
            applicable,
            progressed: &progressed,
            received,
            draws: RandomDraws::new(7, RobotId(0), self.now.0 / STEP.0),
            ..fixtures::input(self.now, RobotId(0))
        };
        self.learner.step(&input, &mut self.outcome);
        self.now = self.now + STEP;
    }

    fn active(&self) -> Option<u32> {
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
