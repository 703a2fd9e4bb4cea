//! `first-come`: a robot keeps what it has until a unit of it is done; else it takes the best task with a place left that no
//! heartbeat within τ claims. Where more are heard on a task than may be, the larger claims stay: those begun earlier, of the same
//! time those of the lower rank.

use std::collections::BTreeMap;

use alliance_proto::ids::{Incarnation, RobotId, TaskId};
use alliance_proto::team::{Content, TaskState};
use alliance_proto::telemetry::Reason;
use alliance_proto::time::SimTime;

use crate::allocator::utility::{UnderWay, best};
use crate::allocator::{Allocator, Decision, Input, Me, NoParameters};

/// One robot's choice.
#[derive(Clone, Debug)]
pub struct FirstCome {
    me: Me,
    under_way: UnderWay,
    /// Since when it has had its task.
    since: SimTime,
    /// The latest word of each teammate.
    claims: BTreeMap<RobotId, Claim>,
}

/// What a teammate said last.
#[derive(Clone, Copy, Debug)]
struct Claim {
    word: (Incarnation, u64),
    heard: SimTime,
    since: SimTime,
    task: Option<TaskId>,
}

impl FirstCome {
    fn hear(&mut self, input: &Input<'_>) {
        for broadcast in input.heard {
            let (sender, word) = (broadcast.sender, (broadcast.incarnation, broadcast.seq));
            if sender == self.me.robot || sender.index() >= self.me.team {
                continue;
            }
            let Content::Heartbeat(heartbeat) = &broadcast.body else {
                continue;
            };
            if self
                .claims
                .get(&sender)
                .is_some_and(|known| known.word >= word)
            {
                continue;
            }
            let executes = heartbeat.state == TaskState::Executing;
            let claim = Claim {
                word,
                heard: input.now,
                since: heartbeat.since,
                task: heartbeat.task.filter(|_| executes),
            };
            self.claims.insert(sender, claim);
        }
    }

    /// Who is heard within τ to execute the task: since when, and who.
    fn executing(&self, task: TaskId, now: SimTime) -> impl Iterator<Item = (SimTime, RobotId)> {
        let within = self.claims.iter().filter(move |(_, claim)| {
            claim.task == Some(task) && now.since(claim.heard) < self.me.ceased_after
        });
        within.map(|(&robot, claim)| (claim.since, robot))
    }
}

impl Allocator for FirstCome {
    type Config = NoParameters;

    fn new(me: &Me, _: &NoParameters) -> Self {
        Self {
            me: me.clone(),
            under_way: UnderWay::default(),
            since: SimTime::ZERO,
            claims: BTreeMap::new(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.under_way.note_progress(&self.me, input);
        self.hear(input);
        let now = input.now;
        let held = decision.active.and_then(|active| {
            let mut choices = input.choices.iter();
            choices.find(|choice| choice.behavior == active && choice.applicable)
        });
        let done = held.is_some_and(|held| input.progressed.contains(&held.task));
        let beaten = held.is_some_and(|held| {
            let mine = (self.since, self.me.robot);
            let earlier = self.executing(held.task, now).filter(|&claim| claim < mine);
            earlier.count() >= held.max_robots
        });
        if held.is_none() || done || beaten {
            let free = |task: TaskId, places: usize| self.executing(task, now).count() < places;
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
        self.under_way.note_active(decision.active, now);
    }
}
