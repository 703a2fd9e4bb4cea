//! Response thresholds (Theraulaz, Bonabeau, Deneubourg 1998; docs/allocators/threshold.md). The probability that a robot
//! takes a task rises with the task's stimulus and falls with the robot's threshold. The threshold falls while the
//! robot performs the task and rises otherwise, so that robots specialize.

#[cfg(test)]
mod tests;

use proto::telemetry::Reason;
use rand::RngExt;
use scenario::ParameterRange::{Above, Within};
use scenario::ParameterSpec;
use scenario::ids::{BehaviorId, TaskId};
use scenario::time::SimTime;

use crate::allocator::utility::log_choices;
use crate::allocator::{Allocator, Choice, Decision, Input, SelfState, parameters};

#[derive(Clone, Debug)]
pub struct Threshold {
    me: SelfState,
    config: Config,
    tasks: Vec<Response>,
}

parameters! {
    /// The parameters in `[allocators.threshold]`.
    pub struct Config {
        delta: f64 = 1.0, "1/s", Above(0.0, 1e9),
            "growth of a stimulus while its task is due (Theraulaz et al. 1998)";
        alpha: f64 = 3.0, "", Within(0.0, 1e9),
            "fall of a stimulus at progress on its task (Theraulaz et al. 1998)";
        xi: f64 = 10.0, "1/s", Within(0.0, 1e9),
            "fall of the threshold of the performed task (Theraulaz et al. 1998)";
        phi: f64 = 1.0, "1/s", Within(0.0, 1e9),
            "rise of the thresholds of all other tasks (Theraulaz et al. 1998)";
        theta_min: f64 = 1.0, "", Above(0.0, 1e9),
            "smallest threshold (Theraulaz et al. 1998)";
        theta_max: f64 = 1000.0, "", Above(0.0, 1e9),
            "largest threshold; at least theta_min (Theraulaz et al. 1998)";
        theta_start: f64 = 500.0, "", Above(0.0, 1e9),
            "threshold at the start (Theraulaz et al. 1998)";
        leave: f64 = 0.2, "1/s", Within(0.0, 1.0),
            "probability to leave a task within a second (Theraulaz et al. 1998)";
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Response {
    task: TaskId,
    /// The stimulus s, at least 0.
    stimulus: f64,
    /// The threshold θ, in units of the stimulus.
    threshold: f64,
    round: SimTime,
}

impl Response {
    /// Computes P = s²/(s² + θ²), the probability that a free robot takes the task within a second.
    fn probability(&self) -> f64 {
        let (s, theta) = (self.stimulus, self.threshold);
        s * s / (s * s + theta * theta)
    }

    /// Computes the rate per s with this probability within a second: -ln(1 - P).
    fn rate(&self) -> f64 {
        let ratio = self.stimulus / self.threshold;
        libm::log1p(ratio * ratio)
    }

    /// Raises the stimulus while the task is due, and lowers it at progress of this robot or at a newer round.
    fn note(&mut self, config: &Config, input: &Input<'_>) {
        let mut choices = input.choices.iter();
        let round = choices
            .find(|choice| choice.task == self.task)
            .map(|choice| choice.round);
        let is_newer = round.is_some_and(|round| round > self.round);
        self.round = round.unwrap_or(self.round);
        let progressed = input.progressed.iter().filter(|task| **task == self.task);
        let progress = progressed.count().max(usize::from(is_newer));
        if self.offer(input).is_some() {
            self.stimulus += config.delta * input.step_s;
        }
        self.stimulus = (self.stimulus - config.alpha * progress as f64).max(0.0);
    }

    /// Returns the cheapest applicable behavior for the task; the first of equal ones.
    fn offer<'a>(&self, input: &Input<'a>) -> Option<&'a Choice> {
        let due = |choice: &&Choice| choice.task == self.task && choice.applicable;
        let cost_s = |choice: &Choice| choice.cost_s.unwrap_or(f64::INFINITY);
        let due = input.choices.iter().filter(due);
        due.min_by(|a, b| cost_s(a).total_cmp(&cost_s(b)))
    }

    fn within(config: &Config, threshold: f64) -> f64 {
        threshold.min(config.theta_max).max(config.theta_min)
    }

    /// Lowers the threshold of the performed task and raises the others.
    fn learn(&mut self, config: &Config, performs: bool, step_s: f64) {
        let change = if performs { -config.xi } else { config.phi };
        self.threshold = Self::within(config, self.threshold + change * step_s);
    }
}

impl Threshold {
    /// Draws the task that a free robot takes in this step, if any. Each due task triggers at its own rate; the first
    /// trigger decides.
    fn take(&self, input: &Input<'_>) -> Option<BehaviorId> {
        let offers = || {
            let due =
                |response: &Response| Some((response.offer(input)?.behavior, response.rate()));
            self.tasks.iter().filter_map(due)
        };
        let total: f64 = offers().map(|(_, rate)| rate).sum();
        let mut draws = input.draws.stream();
        let (draw, mut remaining): (f64, f64) = (draws.random(), draws.random());
        if draw >= -libm::expm1(-total * input.step_s) {
            return None;
        }
        remaining *= total;
        let chosen = offers().find(|(_, rate)| {
            remaining -= rate;
            remaining < 0.0
        });
        // Rounding can make the sum of rates larger than the last partial sum.
        let chosen = chosen.or_else(|| offers().next_back());
        chosen.map(|(behavior, _)| behavior)
    }

    fn leaves(&self, input: &Input<'_>) -> bool {
        let stays = libm::pow(1.0 - self.config.leave, input.step_s);
        !input.is_laden && input.draws.stream().random::<f64>() >= stays
    }
}

impl Allocator for Threshold {
    type Config = Config;

    fn parameters() -> Vec<ParameterSpec> {
        Config::parameters()
    }

    fn new(me: &SelfState, config: &Config) -> Self {
        let response = |task| Response {
            task,
            stimulus: 0.0,
            threshold: Response::within(config, config.theta_start),
            round: SimTime::ZERO,
        };
        Self {
            me: me.clone(),
            config: *config,
            tasks: me.own_tasks().into_iter().map(response).collect(),
        }
    }

    fn adopt(&mut self, config: &Config) -> bool {
        self.config = *config;
        true
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        for response in &mut self.tasks {
            response.note(&self.config, input);
        }
        let mut choices = input.choices.iter();
        let held = decision.active.and_then(|active| {
            choices.find(|choice| choice.behavior == active && choice.applicable)
        });
        decision.active = match held {
            Some(_) if self.leaves(input) => None,
            Some(held) => Some(held.behavior),
            None => self.take(input),
        };
        decision.reason = Some(Reason::Drawn);
        choices = input.choices.iter();
        let performed = choices.find(|choice| decision.active == Some(choice.behavior));
        for response in &mut self.tasks {
            let performs = performed.is_some_and(|choice| choice.task == response.task);
            response.learn(&self.config, performs, input.step_s);
        }
        // A row contains P as the utility.
        let probability = |choice: &Choice| {
            let key = |response: &Response| response.task;
            let place = self.tasks.binary_search_by_key(&choice.task, key);
            place.map_or(0.0, |at| self.tasks[at].probability())
        };
        log_choices(&self.me, input, decision, probability, |_| None);
    }
}
