//! HIPC: hybrid information and plan consensus (Johnson, Choi, How 2012; docs/allocators/hipc.md). Robots exchange the
//! costs from which a plan follows (information consensus) beside their bids (plan consensus, as in CBBA). A robot plans
//! for itself and for all teammates whose costs it has, and does not bid for tasks that the plan gives to teammates.
//!
//! - `awareness`: the costs of teammates, and their messages.
//! - `prediction`: the sequential greedy plan for several robots, and the tasks that the robot leaves.
//! - [`cbba`](super::cbba): bundle, score and consensus.

mod awareness;
mod prediction;
#[cfg(test)]
mod tests;

use scenario::time::SimTime;
use scenario::{ParameterDefault, ParameterRange, ParameterSpec};
use serde::Deserialize;

use super::cbba::{Bidder, CbbaConfig, Rules};
use super::consensus::tables::Tables;
use crate::allocator::{Allocator, Decision, Input, SelfState};
use crate::broken::is_broken;
use awareness::Awareness;
use prediction::{LeftTasks, Planner, choices_by_task, predict};

/// The parameters in `[allocators.hipc]`.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HipcConfig {
    /// L_t, the maximum number of tasks in a bundle.
    pub bundle: usize,
    pub refresh_s: f64,
    pub awareness_s: f64,
    pub wait_s: f64,
}

impl Default for HipcConfig {
    fn default() -> Self {
        let CbbaConfig { bundle, refresh_s } = CbbaConfig::default();
        Self {
            bundle,
            refresh_s,
            awareness_s: 2.0,
            wait_s: 0.2,
        }
    }
}

impl HipcConfig {
    fn rules(&self) -> Rules {
        Rules {
            bundle: self.bundle,
            refresh: SimTime::from_secs_f64(self.refresh_s),
        }
    }
}

/// The rule of one robot.
#[derive(Clone, Debug)]
pub struct Hipc {
    me: SelfState,
    bidder: Bidder<Tables>,
    awareness: Awareness,
    left_tasks: LeftTasks,
    config: HipcConfig,
}

impl Allocator for Hipc {
    type Config = HipcConfig;

    fn plans_sequences() -> bool {
        true
    }

    fn parameters() -> Vec<ParameterSpec> {
        let default = HipcConfig::default();
        let mut parameters = super::cbba::Cbba::parameters();
        parameters.push(ParameterSpec {
            key: "awareness_s",
            unit: "s",
            default: ParameterDefault::Number(default.awareness_s),
            about: "largest age of a teammate's costs with which the robot plans for it; 0 plans for no teammate, as cbba (decided here)",
            range: ParameterRange::Within(0.0, 1e9),
        });
        parameters.push(ParameterSpec {
            key: "wait_s",
            unit: "s",
            default: ParameterDefault::Number(default.wait_s),
            about: "time for which a robot leaves a task to a teammate that has not yet claimed it; longer waits cost time after a wrong prediction (decided here)",
            range: ParameterRange::Within(0.0, 1e9),
        });
        parameters
    }

    fn new(me: &SelfState, config: &HipcConfig) -> Self {
        let bidder = Bidder::new(me, config.rules());
        Self {
            awareness: Awareness::new(&bidder.beliefs),
            left_tasks: LeftTasks::new(&bidder.beliefs),
            bidder,
            me: me.clone(),
            config: *config,
        }
    }

    /// Adopts other times, as CBBA does.
    fn adopt(&mut self, config: &HipcConfig) -> bool {
        let is_adopted = self.bidder.adopt(config.rules());
        if is_adopted {
            self.config = *config;
        }
        is_adopted
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let now = input.now;
        let Self {
            me,
            bidder,
            awareness,
            left_tasks,
            config,
        } = self;
        if config.awareness_s <= 0.0 {
            bidder.step_with(input, decision, false, |_, _, _| &[]);
            return;
        }
        let age_max = SimTime::from_secs_f64(config.awareness_s).min(me.ceased_after);
        awareness.receive(me, input, age_max);
        // The tables may need all messages of each step, so that one is reserved for the costs.
        awareness.send_rest(1, bidder, input, &mut decision.say);
        let wait = match is_broken("hipc-leaves-tasks-for-ever") {
            true => SimTime(u64::MAX),
            false => SimTime::from_secs_f64(config.wait_s),
        };
        let has_waited = left_tasks.has_waited(now, wait);
        let has_planned =
            bidder.step_with(input, decision, has_waited, |bundle, worths, beliefs| {
                let mut offers = Vec::new();
                worths.offers(beliefs.tasks(), &mut offers);
                let mut team = vec![Planner::of_self(me.robot, offers, bundle)];
                let seconds = worths.input.seconds;
                let choices = choices_by_task(input, beliefs);
                for (robot, costs) in awareness.teammates() {
                    team.push(Planner::of_teammate(robot, costs, &choices, beliefs));
                }
                let left = predict(team, config.bundle, beliefs, seconds);
                left_tasks.leave(&left, beliefs, now, wait)
            });
        let refresh = config.rules().refresh;
        awareness.send(has_planned, now, refresh, bidder, input, &mut decision.say);
    }
}
