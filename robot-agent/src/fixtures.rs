//! Values for tests: inputs, broadcasts and the state of a robot, with the usual times.

use std::sync::Arc;

use proto::team::{Broadcast, BroadcastContent};
use scenario::ids::{BehaviorId, Incarnation, RobotId, TaskId};
use scenario::time::SimTime;

use crate::allocator::{
    Announcement, Choice, Input, OwnBehavior, RandomDraws, SelfState, TaskBrief,
};

pub const STEP: SimTime = SimTime(50);
/// The interval 1/ρ between two heartbeats.
pub const PERIOD: SimTime = SimTime(1000);
pub const TAU: SimTime = SimTime(5000);

/// Returns an exclusive task for all robots of a team, with `unit_s` seconds of work.
pub fn brief(team: usize, unit_s: f64) -> TaskBrief {
    TaskBrief {
        max_robots: 1,
        priority: 0,
        unit_s,
        robots: (0..team as u32).map(RobotId).collect(),
        coalition: None,
    }
}

/// Returns a robot with one behavior for each of these tasks. The ids of behaviors and tasks are equal.
pub fn self_state(robot: RobotId, team: usize, briefs: Arc<[TaskBrief]>) -> SelfState {
    let behaviors = briefs.iter().zip(0..).map(|(brief, id)| OwnBehavior {
        id: BehaviorId(id),
        task: TaskId(id),
        max_robots: brief.max_robots,
        priority: brief.priority,
    });
    SelfState {
        robot,
        incarnation: 1,
        team,
        tasks: briefs.len(),
        behaviors: behaviors.collect(),
        briefs,
        step_s: STEP.as_secs_f64(),
        heartbeat_period: PERIOD,
        ceased_after: TAU,
        assigned: [].into(),
    }
}

/// Returns an applicable choice of an exclusive task.
pub fn choice(task: u32, cost_s: f64) -> Choice {
    Choice {
        behavior: BehaviorId(task),
        task: TaskId(task),
        round: SimTime::ZERO,
        applicable: true,
        cost_s: Some(cost_s),
        opens_in_s: 0.0,
        reward: 1.0,
        priority: 0,
        max_robots: 1,
    }
}

/// Returns the inputs of a robot in the tick at `now`, without choices, broadcasts and progress.
pub fn input<'a>(now: SimTime, robot: RobotId) -> Input<'a> {
    Input {
        now,
        step_s: STEP.as_secs_f64(),
        position: None,
        heading_rad: None,
        energy_j: None,
        is_laden: false,
        applicable: &[],
        choices: &[],
        progressed: &[],
        received: &[],
        seconds: &|_, _| None,
        place: &|_| None,
        travel_s: &|_| None,
        ground_truth: &[],
        draws: RandomDraws::new(7, robot, now.0 / STEP.0),
    }
}

pub fn broadcast(
    sender: RobotId,
    (incarnation, seq): (Incarnation, u64),
    sent: SimTime,
    body: BroadcastContent,
) -> Broadcast {
    Broadcast {
        sender,
        incarnation,
        tick: sent.0 / STEP.0,
        index: 0,
        seq,
        sent,
        body,
    }
}

/// Returns a heartbeat of a robot without a position and without shared knowledge.
pub fn heartbeat(announcement: &Announcement) -> BroadcastContent {
    BroadcastContent::Heartbeat(announcement.heartbeat(None, false, Default::default()))
}
