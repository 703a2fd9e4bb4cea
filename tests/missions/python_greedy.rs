//! The rule of the example docs/examples/python/greedy.py in Rust: both use the same engine and give the same hashes.
//! The tests of the Python package contain the hashes.

use std::collections::BTreeMap;

use alliance_tests::runs::setup;
use in_process::{Team, joins_of};
use missions::Registry;
use proto::team::{BroadcastContent, TaskState};
use proto::telemetry::{AllocationRow, BehaviorState};
use proto::tick::Outcome;
use robot_agent::allocator::{Allocator, Choice, Decision, Input, NoParameters, SelfState};
use run_log::{LogLevel, MemoryLog};
use scenario::fault::Faults;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;
use serde::Deserialize;

#[derive(Clone, Debug)]
struct Greedy {
    me: SelfState,
    /// The activation time of the active behavior set.
    since: SimTime,
    /// By task and teammate: the start of its claim, and the time of its last received heartbeat.
    claims: BTreeMap<TaskId, BTreeMap<RobotId, (SimTime, SimTime)>>,
}

impl Greedy {
    /// Returns the teammates with a fresh claim on the task, with the start of the claim.
    fn rivals(&self, task: TaskId, now: SimTime) -> Vec<(SimTime, RobotId)> {
        let claims = self.claims.get(&task).into_iter().flatten();
        let is_fresh = |at: SimTime| {
            let age_s = now.as_secs_f64() - at.as_secs_f64();
            age_s < self.me.ceased_after.as_secs_f64()
        };
        let fresh = claims.filter(|(_, (_, at))| is_fresh(*at));
        fresh.map(|(rank, (since, _))| (*since, *rank)).collect()
    }

    fn chosen<'i>(&self, input: &'i Input<'_>, decision: &Decision) -> Option<&'i Choice> {
        let mut choices = input.choices.iter();
        let mine = choices.find(|choice| Some(choice.behavior) == decision.active);
        if let Some(mine) = mine.filter(|choice| choice.applicable) {
            let mut rivals = self.rivals(mine.task, input.now);
            rivals.retain(|rival| *rival < (self.since, self.me.robot));
            if rivals.len() < mine.max_robots {
                return Some(mine);
            }
        }
        let is_free = |choice: &&Choice| {
            choice.applicable && self.rivals(choice.task, input.now).len() < choice.max_robots
        };
        let order = |a: &&Choice, b: &&Choice| {
            let cost = |choice: &Choice| choice.cost_s.unwrap_or(f64::INFINITY);
            let by_cost = cost(a).total_cmp(&cost(b));
            let by_rank = by_cost.then(a.behavior.cmp(&b.behavior));
            b.priority.cmp(&a.priority).then(by_rank)
        };
        input.choices.iter().filter(is_free).min_by(order)
    }
}

impl Allocator for Greedy {
    type Config = NoParameters;

    fn new(me: &SelfState, _: &NoParameters) -> Self {
        Self {
            me: me.clone(),
            since: SimTime::ZERO,
            claims: BTreeMap::new(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        for broadcast in input.received {
            let BroadcastContent::Heartbeat(heartbeat) = &broadcast.body else {
                continue;
            };
            for claims in self.claims.values_mut() {
                claims.remove(&broadcast.sender);
            }
            if let (TaskState::Executing, Some(task)) = (heartbeat.state, heartbeat.task) {
                let claims = self.claims.entry(task).or_default();
                claims.insert(broadcast.sender, (heartbeat.since, input.now));
            }
        }
        let chosen = self.chosen(input, decision).map(|choice| choice.behavior);
        if chosen != decision.active {
            self.since = input.now;
        }
        decision.active = chosen;
        decision.rows.extend(input.choices.iter().map(|choice| {
            let is_active = chosen == Some(choice.behavior);
            let (utility, state) = match is_active {
                true => (1.0, BehaviorState::Active),
                false => (0.0, BehaviorState::Hibernating),
            };
            AllocationRow {
                task: choice.task,
                behavior: choice.behavior,
                utility,
                holder: is_active.then_some(self.me.robot),
                state,
            }
        }));
    }
}

/// The settings of both runs, and the hashes by `MISSION SEED`.
#[derive(Deserialize)]
struct Expected {
    faults: Vec<serde_json::Value>,
    limit_s: f64,
    robots: usize,
    size: usize,
    hashes: BTreeMap<String, String>,
}

#[test]
fn greedy_in_rust_has_the_hashes_of_greedy_in_python() {
    let text = include_str!("../../python/python/tests/greedy.json");
    let expected: Expected = serde_json::from_str(text).unwrap();
    assert!(expected.hashes.len() >= 4);
    let registry =
        Registry::built_in().with_allocator::<Greedy>("greedy", "the cheapest free task");
    let vocabulary = registry.vocabulary();
    for (run, hash) in &expected.hashes {
        let (mission, seed) = run.split_once(' ').unwrap();
        let mut missions = vocabulary.missions.iter();
        let mission = missions.find(|known| known.name() == mission).unwrap();
        let mut scenario = mission.family(expected.robots, expected.size).unwrap();
        scenario.limit_s = expected.limit_s;
        scenario.allocator = Some("greedy".to_owned());
        let timeline = serde_json::json!({ "timeline": expected.faults });
        scenario.faults = serde_json::from_value::<Faults>(timeline).unwrap();
        let setup = setup(scenario, seed.parse().unwrap());
        let joins = joins_of(&setup);
        let level = LogLevel::Off;
        let mut team =
            Team::with_registry(&registry, setup, joins, level, MemoryLog::default()).unwrap();
        let outcome = team.continue_for(u64::MAX, Outcome::TimeLimit, |_| {});
        let (ended, _) = team.end(outcome.unwrap()).unwrap();
        assert!(ended.faults.iter().all(|fault| fault.hits > 0), "{run}");
        assert_eq!(ended.hash.as_ref(), Some(hash), "{run}");
    }
}
