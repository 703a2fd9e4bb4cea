//! The `learned` allocator: a network scores each applicable choice, and the robot executes the one with the highest score. A
//! robot with a load keeps its task. The weights are trained outside the program (docs/allocators/learned.md).
//!
//! - `network`: the network and its exact arithmetic. `safetensors`: the format of the weights.

mod network;
mod safetensors;
#[cfg(test)]
mod tests;

use std::cmp::Ordering;
use std::sync::Arc;

use scenario::ids::{BehaviorId, RobotId};
use scenario::time::SimTime;
use scenario::{ParameterDefault, ParameterRange, ParameterSpec, Weights};
use serde::Deserialize;

use super::claims::Claims;
use crate::allocator::utility::log_choices;
use crate::allocator::{Allocator, Choice, Decision, Input, SelfState};

pub use network::Network;

/// The number of features of a choice.
pub const FEATURES: usize = 9;

/// The time that maps to ½ in a feature of time, s. Longer times approach 1.
const HALF_S: f64 = 30.0;

/// The weights of a program without a file, see docs/allocators/learned.md for their training.
const SHIPPED: &[u8] = include_bytes!("service.safetensors");

#[derive(Clone, Debug)]
pub struct Learned {
    me: SelfState,
    network: Arc<Network>,
    claims: Claims,
    /// The time since which the active behavior is active.
    since: SimTime,
}

/// The parameters in `[allocators.learned]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(try_from = "StatedConfig")]
pub struct Config {
    network: Arc<Network>,
}

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct StatedConfig {
    weights: Option<Weights>,
}

impl Config {
    /// Creates the parameters from a file of weights.
    ///
    /// # Errors
    /// Describes the first tensor or layer that does not fit.
    pub fn from_file(bytes: &[u8]) -> Result<Self, String> {
        let network = Network::new(safetensors::tensors(bytes)?)?;
        Ok(Self {
            network: Arc::new(network),
        })
    }
}

impl TryFrom<StatedConfig> for Config {
    type Error = String;

    fn try_from(stated: StatedConfig) -> Result<Self, String> {
        match stated.weights {
            None => Self::from_file(SHIPPED),
            Some(weights) => Self::from_file(&weights.0).map_err(|why| format!("weights: {why}")),
        }
    }
}

impl Allocator for Learned {
    type Config = Config;

    fn parameters() -> Vec<ParameterSpec> {
        vec![ParameterSpec::new(
            Weights::KEY,
            "",
            ParameterDefault::Words("weights for the mission service"),
            "file of the network's weights",
            ParameterRange::Other("a file in the format safetensors"),
        )]
    }

    fn new(me: &SelfState, config: &Config) -> Self {
        Self {
            me: me.clone(),
            network: Arc::clone(&config.network),
            claims: Claims::default(),
            since: SimTime::ZERO,
        }
    }

    fn adopt(&mut self, config: &Config) -> bool {
        self.network = Arc::clone(&config.network);
        true
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        self.claims.receive(&self.me, input);
        let active = decision.active;
        let applicable = || input.choices.iter().filter(|choice| choice.applicable);
        let least_s = applicable().map(cost_s).min_by(f64::total_cmp);
        let least_s = least_s.unwrap_or(0.0);
        let score = |choice: &Choice| {
            self.network
                .score(&self.features(choice, active, least_s, input))
        };
        let keeps = |choice: &&Choice| input.is_laden && active == Some(choice.behavior);
        let kept = applicable().find(keeps);
        let best = || {
            let scored = applicable().map(|choice| (choice, score(choice)));
            scored.max_by(order).map(|(choice, _)| choice)
        };
        decision.active = kept.or_else(best).map(|choice| choice.behavior);
        let holder = |task| {
            let claims = self.claims.of_task(&self.me, task, input.now);
            let first = claims.map(|(robot, claim)| (claim.since, robot)).min();
            first.map(|(_, robot)| robot)
        };
        log_choices(&self.me, input, decision, score, holder);
        if decision.active != active {
            self.since = input.now;
        }
    }
}

/// Compares choices by priority and score. Among equal ones the first is the best.
fn order((a, a_score): &(&Choice, f64), (b, b_score): &(&Choice, f64)) -> Ordering {
    let by_score = a.priority.cmp(&b.priority).then(a_score.total_cmp(b_score));
    by_score.then(b.behavior.cmp(&a.behavior))
}

impl Learned {
    /// Returns the features of an applicable choice, each from 0 to 2:
    ///
    /// 0. cost; 1. cost beyond that of the cheapest applicable choice; 2. 1 if it is active; 3. time since it became
    ///    active, else 0;
    /// 4. claims of teammates per robot that the task admits; 5. those of them that precede the robot's own claim, all if
    ///    it has none;
    /// 6. time since the latest of these claims was received, 0 without claims;
    /// 7. time until the work can begin; 8. time since the task became due.
    fn features(
        &self,
        choice: &Choice,
        active: Option<BehaviorId>,
        least_s: f64,
        input: &Input<'_>,
    ) -> [f64; FEATURES] {
        let is_active = active == Some(choice.behavior);
        let own: (SimTime, RobotId) = (self.since, self.me.robot);
        let (mut all, mut earlier, mut silent) = (0, 0, None::<SimTime>);
        for (robot, claim) in self.claims.of_task(&self.me, choice.task, input.now) {
            all += 1;
            earlier += usize::from(!is_active || (claim.since, robot) < own);
            let since = input.now.since(claim.received);
            silent = Some(silent.map_or(since, |other| other.min(since)));
        }
        let places = choice.max_robots as f64;
        let share = |count: usize| (count as f64 / places).min(2.0);
        let span = |time: SimTime| squash(time.as_secs_f64());
        let cost_s = cost_s(choice);
        [
            squash(cost_s),
            squash(cost_s - least_s),
            f64::from(u8::from(is_active)),
            if is_active {
                span(input.now.since(self.since))
            } else {
                0.0
            },
            share(all),
            share(earlier),
            silent.map_or(0.0, span),
            squash(choice.opens_in_s),
            span(input.now.since(choice.round)),
        ]
    }
}

/// The cost of a choice without an estimate, s.
const UNKNOWN_S: f64 = 1e6;

fn cost_s(choice: &Choice) -> f64 {
    choice.cost_s.unwrap_or(UNKNOWN_S)
}

/// Maps seconds to a number from 0 to 1.
fn squash(seconds: f64) -> f64 {
    seconds / (seconds + HALF_S)
}
