//! Invariant: two robots that receive each other's messages do not both continue an exclusive task (docs/BOUNDS.md,
//! "Two robots on an exclusive task").
//!
//! The bound starts at the first tick in which both receive each other and both execute the task:
//!
//! - With arbitration (`team`), the next heartbeat of either robot resolves the conflict in the step of its receipt. It
//!   comes within 1/ρ and arrives one step after it is sent.
//! - Without arbitration, or after one robot has waited for the full limit, ψ resolves the conflict. A robot active for
//!   longer than ψ leaves in the step in which it has received a message of the other within τ.

use std::collections::BTreeMap;

use proto::telemetry::BehaviorState;
use scenario::ids::{BehaviorId, TaskId};
use scenario::time::SimTime;
use scenario::{BehaviorParams, Scenario, Setup};

use super::WorldState;
use super::reception::hear_each_other;

/// Steps for noticing, sending and receiving.
const STEPS: u64 = 4;

#[derive(Clone, Debug)]
pub struct Exclusive {
    setup: Setup,
    /// Ticks for which two robots, by rank, have both executed a task and received each other.
    together: BTreeMap<(usize, usize, TaskId), u64>,
    waits: BTreeMap<(usize, BehaviorId), Wait>,
}

/// The time that a set has waited since it last hibernated.
#[derive(Clone, Copy, Debug, Default)]
struct Wait {
    spent: SimTime,
    since: Option<SimTime>,
}

impl Exclusive {
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        Self {
            setup: setup.clone(),
            together: BTreeMap::new(),
            waits: BTreeMap::new(),
        }
    }

    /// Checks all pairs of robots after a tick. The error describes the violation.
    pub fn check(&mut self, scenario: &Scenario, state: &WorldState) -> Result<(), String> {
        self.note_waits(state);
        let mut together = BTreeMap::new();
        let task_of = |set: BehaviorId| self.setup.catalog.sets[set.index()].task;
        let mut executing: Vec<(usize, BehaviorId)> = (0..state.robots.len())
            .flat_map(|rank| state.robots[rank].active().map(move |set| (rank, set)))
            .filter(|(_, set)| self.setup.catalog.tasks[task_of(*set).index()].max_robots == 1)
            .collect();
        executing.sort_by_key(|(_, set)| task_of(*set));
        for robots in executing.chunk_by(|(_, one), (_, other)| task_of(*one) == task_of(*other)) {
            let pairs = (1..robots.len()).flat_map(|place| (0..place).map(move |one| (one, place)));
            for (one, other) in pairs {
                let ((one, one_set), (other, other_set)) = (robots[one], robots[other]);
                let task = task_of(one_set);
                if !hear_each_other(scenario, state, one, other)
                    || self.uses_learned_times(state, one, one_set)
                    || self.uses_learned_times(state, other, other_set)
                {
                    continue;
                }
                let key = (one, other, task);
                let ticks = 1 + self.together.get(&key).copied().unwrap_or_default();
                let bound = self.bound(&[(one, one_set), (other, other_set)]);
                if ticks > bound {
                    let name = |rank: usize| &scenario.robots[rank].name;
                    return Err(format!(
                        "{} and {} receive each other's messages and have both executed {} for {ticks} ticks; the bound is {bound}",
                        name(one),
                        name(other),
                        self.setup.catalog.task_name(task)
                    ));
                }
                together.insert(key, ticks);
            }
        }
        self.together = together;
        Ok(())
    }

    /// Returns the longest permitted time for two sets, in ticks.
    fn bound(&self, sets: &[(usize, BehaviorId); 2]) -> u64 {
        let step_s = self.setup.scenario.step_ms as f64 / 1000.0;
        let longest_s = |of: fn(&BehaviorParams) -> f64| {
            let of = sets.iter().map(|&(rank, set)| of(self.params(rank, set)));
            of.fold(0.0, f64::max)
        };
        let steps = |time_s: f64| (time_s / step_s).ceil() as u64;
        let heartbeat = steps(longest_s(|set| 1.0 / set.broadcast_rate_hz)) + STEPS;
        let settled_by_claims = self.setup.alliance.switches.arbitration
            && !sets
                .iter()
                .any(|&(rank, set)| self.may_have_waited_out(rank, set));
        if settled_by_claims {
            heartbeat
        } else {
            heartbeat + steps(longest_s(|set| set.before_yielding_s))
        }
    }

    fn params(&self, rank: usize, set: BehaviorId) -> &BehaviorParams {
        let robot = &self.setup.scenario.robots[rank].name;
        &self.setup.alliance.robots[robot].sets[self.setup.catalog.behavior_name(set)]
    }

    fn note_waits(&mut self, state: &WorldState) {
        for (rank, robot) in state.robots.iter().enumerate() {
            for motivation in &robot.motivations {
                let wait = self.waits.entry((rank, motivation.set)).or_default();
                match (motivation.state, wait.since) {
                    (BehaviorState::Hibernating, _) => *wait = Wait::default(),
                    (BehaviorState::Waiting, None) => wait.since = Some(state.now),
                    (BehaviorState::Active, Some(since)) => {
                        wait.spent = wait.spent + state.now.since(since);
                        wait.since = None;
                    }
                    _ => {}
                }
            }
        }
    }

    /// Returns whether a set follows a learned ψ, which the scenario does not state. Robots with motivations but
    /// another allocator learn their values.
    fn uses_learned_times(&self, state: &WorldState, rank: usize, set: BehaviorId) -> bool {
        let scenario = &self.setup.scenario;
        let allocator = scenario.decider_of(&scenario.robots[rank]);
        let learns =
            allocator != Scenario::DEFAULT_ALLOCATOR && !state.robots[rank].motivations.is_empty();
        let wait = self.waits.get(&(rank, set)).copied().unwrap_or_default();
        let is_settled_by_claims =
            self.setup.alliance.switches.arbitration && wait.spent == SimTime::ZERO;
        learns && !is_settled_by_claims
    }

    /// Returns whether the set has waited for ψ + τ, with a tolerance of two steps.
    fn may_have_waited_out(&self, rank: usize, set: BehaviorId) -> bool {
        let params = self.params(rank, set);
        let bound_s = params.before_yielding_s + params.ceased_after_s;
        let step_s = self.setup.scenario.step_ms as f64 / 1000.0;
        let wait = self.waits.get(&(rank, set)).copied().unwrap_or_default();
        wait.spent.as_secs_f64() >= bound_s - 2.0 * step_s
    }
}
