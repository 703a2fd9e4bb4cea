//! The `first-come` allocator. A robot keeps its task for one unit. It then takes the best task with a free place,
//! given the claims received within τ. Of too many claims the earlier ones win; ties go to the lower rank.

use proto::telemetry::Reason;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use super::claims::Claims;
use crate::allocator::utility::{WorkInProgress, best};
use crate::allocator::{Allocator, Decision, Input, NoParameters, SelfState};
use crate::broken::is_broken;

#[derive(Clone, Debug)]
pub struct FirstCome {
    me: SelfState,
    under_way: WorkInProgress,
    /// The time at which the robot claimed its task.
    since: SimTime,
    claims: Claims,
}

impl FirstCome {
    /// Returns the claim time and the id of each teammate whose claim to the task was received within τ.
    fn executing(&self, task: TaskId, now: SimTime) -> impl Iterator<Item = (SimTime, RobotId)> {
        let claims = self.claims.of_task(&self.me, task, now);
        claims.map(|(robot, claim)| (claim.since, robot))
    }
}

impl Allocator for FirstCome {
    type Config = NoParameters;

    fn new(me: &SelfState, _: &NoParameters) -> Self {
        Self {
            me: me.clone(),
            under_way: WorkInProgress::default(),
            since: SimTime::ZERO,
            claims: Claims::default(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.under_way.record_progress(&self.me, input);
        self.claims.receive(&self.me, input);
        let now = input.now;
        let held = decision.active.and_then(|active| {
            let mut choices = input.choices.iter();
            choices.find(|choice| choice.behavior == active && choice.applicable)
        });
        let done = held.is_some_and(|held| input.progressed.contains(&held.task));
        let beaten = held.is_some_and(|held| {
            let mine = (self.since, self.me.robot);
            let is_before = |claim| match is_broken("first-come-later-robot-stays") {
                true => claim > mine,
                false => claim < mine,
            };
            let earlier = self.executing(held.task, now);
            earlier.filter(|&claim| is_before(claim)).count() >= held.max_robots
        });
        if held.is_none() || done || beaten {
            let waits = self.claims.is_empty() && is_broken("first-come-waits-for-a-message");
            let free =
                |task: TaskId, places: usize| !waits && self.executing(task, now).count() < places;
            let chosen = best(&self.under_way, self.me.robot, input, |choice| {
                free(choice.task, choice.max_robots)
            });
            let chosen = chosen.map(|(choice, _)| choice.behavior);
            if chosen != decision.active {
                self.since = now;
                decision.reason = Some(if beaten {
                    Reason::Outbid
                } else {
                    Reason::Claimed
                });
            }
            decision.active = chosen;
        }
        let holder = |task| self.executing(task, now).min().map(|(_, robot)| robot);
        self.under_way.log(&self.me, input, decision, holder);
        self.under_way.record_active(decision.active, now);
    }
}
