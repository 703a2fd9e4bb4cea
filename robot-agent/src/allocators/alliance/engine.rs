//! One step of ALLIANCE in a robot: receive, evaluate, choose, announce.

use std::cmp::Reverse;

use proto::telemetry::{Motivation, Reason, StateChange};
use scenario::Setup;
use scenario::ids::{BehaviorId, RobotId};
use scenario::time::SimTime;
use smallvec::SmallVec;

use super::behavior::{Behavior, NonHibernating, SetState};
use super::heartbeats::{Heartbeats, StepEvents};
use super::history::History;
use super::motivation::{self, Factors};
use super::params::{Config, Parameters, USUAL_BEHAVIORS};
use super::teammates::{Claim, Teammates};
use super::values::LearnedTerms;
use crate::allocator::{AnyConfig, Input, RunningAllocator, StepOutcome};

/// The motivational behaviors of one robot.
///
/// A clone is a full snapshot, used to undo a step that does not count. Its size is O(robots · tasks) for a mission of
/// any length.
#[derive(Clone, Debug)]
pub struct Engine {
    pub(super) config: Config,
    pub(super) behaviors: SmallVec<[Behavior; USUAL_BEHAVIORS]>,
    pub(super) awake: NonHibernating,
    pub(super) history: History,
    pub(super) teammates: Teammates,
    pub(super) heartbeats: Heartbeats,
    progress: Vec<u32>,
    /// True after the first step, because the first step has m(0) = 0.
    started: bool,
    /// The rows of the latest step, valid until `steady_until`.
    pub(super) rows: SmallVec<[Motivation; USUAL_BEHAVIORS]>,
    pub(super) steady_until: SimTime,
    /// The next action of each set at θ in this step; stored to reuse its memory.
    options: Vec<(usize, Next)>,
    /// By set, the terms that a learning rule adds to the equations; empty in ALLIANCE.
    pub(super) learned: Vec<LearnedTerms>,
}

impl Engine {
    /// Creates the engine of a robot at the start of an incarnation: all motivations are 0.
    ///
    /// # Panics
    /// Panics if `setup` is not resolved: it must name the robot and contain values for each of its sets and teammates.
    #[must_use]
    pub fn new(robot: RobotId, setup: &Setup, parameters: &Parameters) -> Self {
        Self::from_config(Config::new(robot, setup, parameters))
    }

    pub(super) fn from_config(config: Config) -> Self {
        let ids = config.sets.iter().map(|set| set.id);
        Self {
            behaviors: ids.map(Behavior::new).collect(),
            awake: NonHibernating::default(),
            history: History::new(config.task_count_of_robot),
            teammates: Teammates::default(),
            heartbeats: Heartbeats::new(config.sets.len()),
            progress: vec![0; config.task_count_of_robot],
            started: false,
            rows: SmallVec::new(),
            steady_until: SimTime::ZERO,
            options: Vec::new(),
            learned: Vec::new(),
            config,
        }
    }

    #[must_use]
    pub fn active(&self) -> Option<BehaviorId> {
        self.awake.active.map(|index| self.behaviors[index].set)
    }

    /// Evaluates (A) and (B) of docs/ALLIANCE.md §2: the active set first, then the others, suppressed if it is still
    /// active. Writes one row per set, with its state before the choice.
    fn evaluate(
        &mut self,
        input: &Input<'_>,
        changes: &mut Vec<StateChange>,
        rows: &mut Vec<Motivation>,
    ) {
        rows.resize(self.behaviors.len(), Motivation::default());
        let before = self.awake.active;
        if let Some(index) = before {
            self.evaluate_behavior(index, false, input, changes, &mut rows[index]);
        }
        self.arbitrate(input.now, changes);
        let suppressed = self.awake.active.is_some();
        for (index, row) in rows.iter_mut().enumerate() {
            if before != Some(index) {
                self.evaluate_behavior(index, suppressed, input, changes, row);
            }
        }
    }

    fn evaluate_behavior(
        &mut self,
        index: usize,
        suppressed: bool,
        input: &Input<'_>,
        changes: &mut Vec<StateChange>,
        row: &mut Motivation,
    ) {
        let learned = self.learned_of(index);
        let config = &self.config;
        let now = input.now;
        let set = &config.sets[index];
        let behavior = &mut self.behaviors[index];
        let records = self.history.records_of(set.task_index);

        let active_since = match behavior.stance {
            SetState::Active { since, .. } => Some(since.max(learned.trial)),
            _ => None,
        };
        let may_be_reset = active_since.is_none() || config.switches.reset_stops_active;
        let factors = Factors {
            sensory_feedback: input.applicable[index],
            activity_suppression: !suppressed,
            reset_by: motivation::impatience_reset(records, now).filter(|_| may_be_reset),
            acquiescence: active_since
                .and_then(|since| motivation::acquiescence(&set.params, since, records, now)),
        };
        let impatience = motivation::impatience(&set.params, records, now);
        let gain = if self.started {
            impatience * config.step_s
        } else {
            0.0
        };
        let level = if learned.is_withheld && behavior.stance == SetState::Hibernating {
            0.0
        } else {
            motivation::motivation(behavior.motivation, gain, &factors, config.threshold)
        };
        behavior.set_motivation(level, config.threshold, now);
        // Assigned field by field: writing small fields and then copying the struct would cause a store-forwarding
        // stall.
        row.set = behavior.set;
        row.motivation = behavior.motivation;
        row.impatience = impatience;
        row.sensory_feedback = factors.sensory_feedback;
        row.activity_suppression = factors.activity_suppression;
        row.impatience_reset = factors.reset_by.is_none();
        row.acquiescence = factors.acquiescence.is_none();
        row.state = behavior.stance.state();

        // An active or waiting set is at θ, so only a zero factor can lower its motivation.
        if behavior.stance != SetState::Hibernating
            && let Some(reason) = factors.zero()
        {
            self.enter(index, SetState::Hibernating, reason, changes);
        }
    }

    fn enter(
        &mut self,
        index: usize,
        stance: SetState,
        reason: Reason,
        changes: &mut Vec<StateChange>,
    ) {
        let behavior = &mut self.behaviors[index];
        self.awake.note(index, behavior.stance, stance);
        changes.push(behavior.enter(stance, reason));
    }

    /// Makes the active set wait, at θ, if as many teammates as the task allows have better claims.
    fn arbitrate(&mut self, now: SimTime, changes: &mut Vec<StateChange>) {
        let config = &self.config;
        let Some(index) = self.awake.active.filter(|_| config.switches.arbitration) else {
            return;
        };
        let behavior = &mut self.behaviors[index];
        let SetState::Active { since, waited_out } = behavior.stance else {
            return;
        };
        let set = &config.sets[index];
        let waited = behavior.waited.as_deref();
        let waited_on = |rank| waited.is_some_and(|waited| waited.teammates.contains(&rank));
        let beats =
            |&claim: &Claim| claim < (since, config.robot) && !(waited_out && waited_on(claim.1));
        let claims = self.teammates.executing(set.task, set.params.tau, now);
        if claims.filter(beats).count() >= set.max_robots {
            if waited_out && let Some(waited) = &mut behavior.waited {
                // The set yields to a teammate for which it has not waited yet.
                waited.total = SimTime::ZERO;
            }
            let stance = SetState::Waiting { since: now };
            self.enter(index, stance, Reason::Arbitration, changes);
        }
    }

    /// Applies (C) of docs/ALLIANCE.md §2: sets at θ on occupied tasks wait, and at most one of the rest activates.
    fn choose(&mut self, now: SimTime, changes: &mut Vec<StateChange>) {
        let mut options = std::mem::take(&mut self.options);
        options.clear();
        let sets = 0..self.behaviors.len();
        options.extend(sets.filter_map(|index| Some((index, self.next(index, now)?))));
        // The order is the highest priority, then the longest time at θ, then the catalog.
        let chosen = options
            .iter()
            .filter_map(|&(index, next)| match next {
                Next::Activate(reason) => Some((index, reason)),
                Next::Wait => None,
            })
            .min_by_key(|&(index, _)| {
                let longest = self.behaviors[index].at_threshold_since;
                (Reverse(self.config.sets[index].priority), longest)
            });

        if chosen.is_none() || self.config.switches.wish_when_suppressed {
            for &(index, next) in &options {
                if next == Next::Wait {
                    let stance = SetState::Waiting { since: now };
                    self.enter(index, stance, Reason::Threshold, changes);
                }
            }
        }
        if let Some((index, reason)) = chosen {
            let stance = SetState::Active {
                since: now,
                waited_out: reason == Reason::WaitBound,
            };
            self.enter(index, stance, reason, changes);
        }
        self.note_awaited_teammates(now);
        self.options = options;
    }

    fn note_awaited_teammates(&mut self, now: SimTime) {
        if self.awake.waiting == 0 {
            return;
        }
        for (behavior, set) in self.behaviors.iter_mut().zip(&self.config.sets) {
            if let SetState::Waiting { .. } = behavior.stance {
                let executing = self.teammates.executing(set.task, set.params.tau, now);
                let waited = behavior.waited.get_or_insert_default();
                waited.teammates.extend(executing.map(|(_, rank)| rank));
            }
        }
    }

    fn next(&self, index: usize, now: SimTime) -> Option<Next> {
        let behavior = &self.behaviors[index];
        behavior.at_threshold_since?;
        let set = &self.config.sets[index];
        let (task, tau) = (set.task, set.params.tau);
        let max_robots = set.max_robots;
        match behavior.stance {
            SetState::Active { .. } => None,
            SetState::Hibernating => {
                let occupied = self.teammates.is_occupied(task, max_robots, tau, now);
                Some(if occupied && self.config.switches.waiting {
                    Next::Wait
                } else {
                    Next::Activate(Reason::Threshold)
                })
            }
            SetState::Waiting { since } => {
                let wish = (since, self.config.robot);
                if self
                    .teammates
                    .has_place_for(wish, task, max_robots, tau, now)
                {
                    Some(Next::Activate(Reason::WaitOver))
                } else if behavior.spent_waiting() + now.since(since) > set.params.waiting_bound() {
                    Some(Next::Activate(Reason::WaitBound))
                } else {
                    None
                }
            }
        }
    }
}

/// The action of a set at θ in (C).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Next {
    Wait,
    Activate(Reason),
}

/// A step adds one step length of impatience, independent of the time since the previous step. A stopped robot therefore
/// does not return with a higher motivation.
impl RunningAllocator for Engine {
    fn checkpoint(&self) -> Box<dyn RunningAllocator> {
        Box::new(self.clone())
    }

    fn weighs_costs(&self) -> bool {
        false
    }

    fn adopt(&mut self, setup: &Setup, _: Option<&AnyConfig>) -> bool {
        let robot = self.config.robot;
        let own = setup.for_robot(setup.roster.name(robot));
        self.config = Config::new(robot, setup, &Parameters::from_setup(&own));
        self.weigh_anew();
        true
    }

    fn step(&mut self, input: &Input<'_>, output: &mut StepOutcome) {
        let now = input.now;
        let own_task = |task| self.config.own_task(task);
        let mut is_news = false;
        for broadcast in input.received {
            if self.config.accepts(broadcast) {
                let switches = &self.config.switches;
                is_news |= self.history.receive(now, broadcast, switches, own_task);
                let claims = self
                    .teammates
                    .receive(now, broadcast, |task| own_task(task).is_some());
                // The end of a claim matters only to waiting sets.
                is_news |= claims && self.awake.waiting > 0;
            }
        }
        for &task in input.progressed {
            if let Some(index) = self.config.own_task(task) {
                self.progress[index] += 1;
            }
        }

        let StepOutcome {
            motivations,
            rows,
            changes,
            announcements,
            say,
            active,
        } = output;
        rows.clear();
        say.clear();
        changes.clear();
        announcements.clear();
        if !is_news && self.is_steady(input) {
            motivations.clear();
            motivations.extend_from_slice(&self.rows);
            *active = self.active();
            return;
        }
        self.evaluate(input, changes, motivations);
        self.choose(now, changes);
        *active = self.active();
        for change in changes.iter() {
            // The last change of a set determines its logged state.
            let changed = motivations.iter_mut().find(|row| row.set == change.set);
            changed.into_iter().for_each(|row| row.state = change.to);
        }
        self.started = true;

        let happened = StepEvents {
            changes,
            progressed: input.progressed,
            progress: &self.progress,
        };
        self.heartbeats.announce(
            now,
            &self.config,
            &self.behaviors,
            self.awake,
            &happened,
            announcements,
        );
        self.steady_until = SimTime::ZERO;
        // A reset lasts for one step only.
        let is_reset = motivations.iter().any(|row| !row.impatience_reset);
        if changes.is_empty() && !is_reset {
            self.rows.clear();
            self.rows.extend_from_slice(motivations);
            self.steady_until = self.next_turn(now).unwrap_or_default();
        }
    }
}
