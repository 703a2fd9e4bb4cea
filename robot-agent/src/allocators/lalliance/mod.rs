//! L-ALLIANCE: ALLIANCE with φ, ψ, δ_slow and δ_fast computed from measured task times (Parker, ORNL report 1995;
//! Advanced Robotics 11(4), 1997; docs/allocators/l-alliance.md).
//!
//! ALLIANCE's engine computes motivations, states and heartbeats, with θ, the switches, ρ and τ of `[alliance]`. In
//! each step this module measures task times and sets the engine's parameters.
//!
//! - `monitor`: the measured time of each robot for each task.
//! - `rates`: the parameters by strategy and ordering.

mod config;
mod kind;
mod monitor;
mod rates;
#[cfg(test)]
mod tests;

use rand::RngExt;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{LearnedTimes, Setup, Switches};

use super::alliance::{Engine, LearnedTerms, LearnedValues, TowardTeammate};
use crate::allocator::{Input, RunningAllocator, SelfState, StepOutcome};
use crate::broken::is_broken;
use monitor::Monitor;
use rates::{Category, Rates, TaskTimes};

pub use config::{Config, Ordering, Strategy};
pub use kind::kind;

#[derive(Clone, Debug)]
pub struct Learner {
    me: SelfState,
    config: Config,
    threshold: f64,
    engine: Engine,
    monitor: Monitor,
    /// The robot's tasks without duplicates, in the order of the catalog.
    tasks: Vec<TaskId>,
    began: Option<SimTime>,
    was_active: bool,
    boredom: f64,
    /// A random number in [0, 1) per task, for [`Ordering::Random`].
    draws: Vec<f64>,
    /// The values of the robot's tasks in the latest step.
    task_values: Vec<TaskValues>,
    /// A buffer for φ and δ_slow toward single teammates.
    toward: Vec<(RobotId, TowardTeammate)>,
}

#[derive(Clone, Copy, Debug)]
struct TaskValues {
    knowledge: TaskTimes,
    rates: Rates,
    /// The step of active learning; `None` once it has ended.
    learning: Option<LearningStep>,
}

/// The role of a task in active learning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LearningStep {
    /// The robot tries the task next.
    Try,
    /// The robot does not try the task now.
    Rest,
    /// The robot leaves the task, because its trial has just ended and another task is next.
    Leave,
}

impl Learner {
    /// Creates a robot at the start of an incarnation, with θ and the switches of `[alliance]`.
    #[must_use]
    pub fn new(me: &SelfState, config: &Config, threshold: f64, switches: Switches) -> Self {
        let tasks = me.own_tasks();
        let wishes_at_work = switches.wish_when_suppressed;
        Self {
            engine: Engine::to_be_learned(me, threshold, switches),
            monitor: Monitor::new(me, config.trials, config.prior_units, wishes_at_work),
            config: *config,
            threshold,
            began: None,
            was_active: false,
            boredom: 0.0,
            draws: vec![0.0; tasks.len()],
            task_values: Vec::with_capacity(tasks.len()),
            toward: Vec::new(),
            tasks,
            me: me.clone(),
        }
    }

    /// Loads the times that the robot has learned in earlier runs.
    pub(super) fn load(&mut self, setup: &Setup) {
        let profile = setup.profile.robots.get(setup.roster.name(self.me.robot));
        for (task, times) in profile.into_iter().flatten() {
            for (robot, times) in times {
                let task = setup.catalog.find_task(task);
                let robot = setup.roster.find(robot);
                if let (Some(task), Some(robot)) = (task, robot) {
                    self.monitor.recall(task, robot, times);
                }
            }
        }
    }

    /// Updates the boredom, and draws a new order when the robot becomes free.
    fn update_boredom(&mut self, input: &Input<'_>) {
        let is_active = self.engine.active().is_some();
        if self.began.is_none() || (self.was_active && !is_active) {
            let mut stream = input.draws.stream();
            self.draws.fill_with(|| stream.random());
        }
        let is_never_bored = is_broken("l-alliance-is-never-bored");
        self.boredom = if is_active || self.began.is_none() || is_never_bored {
            0.0
        } else {
            // Boredom stops at its threshold.
            let bored = self.boredom + self.config.boredom_rate * input.step_s;
            bored.min(self.config.boredom_threshold)
        };
        self.was_active = is_active;
        self.began.get_or_insert(input.now);
    }

    fn knowledge_of(&self, task: TaskId, now: SimTime) -> TaskTimes {
        let (me, brief) = (self.me.robot, &self.me.briefs[task.index()]);
        let own_s = self.monitor.time_s(task, me);
        let has_tried = |robot| {
            self.monitor
                .trials_of(task)
                .any(|(other, _)| other == robot)
        };
        let able = self
            .monitor
            .present(now)
            .filter(move |&robot| brief.robots.binary_search(&robot).is_ok() || has_tried(robot));
        let able = able.map(|robot| (self.monitor.time_s(task, robot), robot));
        let (mut best_s, mut is_best) = (own_s, true);
        for other in able {
            best_s = best_s.min(other.0);
            is_best &= rates::is_better((own_s, me), other);
        }
        let is_free = self.monitor.executing_count(task) < brief.max_robots;
        let times = self.monitor.trials_of(task).map(|(_, time_s)| time_s);
        TaskTimes {
            own_s,
            best_s,
            shortest_s: times.fold(own_s, f64::min),
            category: if is_best && is_free {
                Category::BestHere
            } else {
                Category::Others
            },
        }
    }

    /// Computes the values of each task by strategy and ordering.
    fn update_values(&mut self, now: SimTime) {
        let (mut low_s, mut high_s) = (f64::INFINITY, 0.0_f64);
        for &task in &self.tasks {
            let own_s = self.monitor.time_s(task, self.me.robot);
            let times = self.monitor.trials_of(task).map(|(_, time_s)| time_s);
            for time_s in times.chain([own_s]) {
                (low_s, high_s) = (low_s.min(time_s), high_s.max(time_s));
            }
        }
        let mut task_values = std::mem::take(&mut self.task_values);
        task_values.clear();
        task_values.extend(self.tasks.iter().zip(&self.draws).map(|(&task, &draw)| {
            let knowledge = self.knowledge_of(task, now);
            TaskValues {
                rates: rates::rates(&self.config, &knowledge, (low_s, high_s), draw),
                knowledge,
                learning: None,
            }
        }));
        self.task_values = task_values;
    }

    /// Plans active learning: the next trial is the least tried applicable task that no teammate executes.
    fn plan_learning(&mut self, input: &Input<'_>) {
        let required = self.config.learning_trials as u32;
        let since = input.now.since(self.began.unwrap_or_default());
        let is_over = since >= SimTime::from_secs_f64(self.config.learning_limit_s)
            || (self.tasks.iter()).all(|&task| self.monitor.trial_count(task) >= required);
        if is_over {
            return;
        }
        let can = |task: TaskId| {
            let mut pairs = self.me.behaviors.iter().zip(input.applicable);
            pairs.any(|(behavior, applicable)| behavior.task == task && *applicable)
        };
        let free = self.tasks.iter().copied();
        let free = free.filter(|&task| can(task) && self.monitor.executing_count(task) == 0);
        let next = free.min_by_key(|&task| self.monitor.trial_count(task));
        let at = self.monitor.current_trial().map(|(task, _)| task);
        for (&task, values) in self.tasks.iter().zip(&mut self.task_values) {
            let has_ended = at == Some(task) && input.progressed.contains(&task);
            values.learning = Some(if next == Some(task) {
                LearningStep::Try
            } else if has_ended && next.is_some() {
                LearningStep::Leave
            } else {
                LearningStep::Rest
            });
        }
    }

    fn apply(&mut self) {
        let mut list = std::mem::take(&mut self.toward);
        for (place, behavior) in self.me.behaviors.iter().enumerate() {
            // The list contains the tasks of all behaviors of the robot.
            let index = self.tasks.binary_search(&behavior.task).unwrap_or_default();
            list.clear();
            let values = match self.task_values[index].learning {
                None => self.adaptive(behavior.task, &self.task_values[index], &mut list),
                Some(step) => self.active(behavior.task, step),
            };
            let toward = &list;
            self.engine
                .set_learned(place, &LearnedValues { toward, ..values });
        }
        self.toward = list;
    }

    /// Computes the values of adaptive learning. Adds to `list` the teammates whose φ differs from that of a robot
    /// without trials.
    fn adaptive(
        &self,
        task: TaskId,
        values: &TaskValues,
        list: &mut Vec<(RobotId, TowardTeammate)>,
    ) -> LearnedValues<'static> {
        let TaskValues {
            knowledge, rates, ..
        } = values;
        let toward = |theirs_s| {
            let strategy = self.config.strategy;
            self.toward_within(rates::patience_s(strategy, knowledge, theirs_s))
        };
        let toward_most = toward(self.monitor.prior_s(task));
        for (robot, theirs_s) in self.monitor.trials_of(task) {
            let theirs = toward(theirs_s);
            if robot != self.me.robot && theirs != toward_most {
                list.push((robot, theirs));
            }
        }
        let others = list.iter().map(|(_, toward)| toward.phi);
        let shortest = others.fold(toward_most.phi, SimTime::min);
        let is_bored = self.boredom >= self.config.boredom_threshold;
        let is_withheld = rates::has_categories(&self.config)
            && knowledge.category == Category::Others
            && !is_bored;
        LearnedValues {
            fast: self.threshold / rates::clamp_delay_s(rates.delay_s, shortest.as_secs_f64()),
            toward_most,
            toward: &[],
            psi: SimTime::from_secs_f64(rates.psi_s),
            lambda: SimTime::from_secs_f64(rates.lambda_s),
            learned: LearnedTerms {
                is_withheld,
                trial: self.trial_of(task),
            },
        }
    }

    /// Computes the values of active learning: patience until its end, and no ψ.
    fn active(&self, task: TaskId, step: LearningStep) -> LearnedValues<'static> {
        let prior_s = self.monitor.prior_s(task);
        let longest_s = self.config.learning_limit_s.max(prior_s);
        let leaves = step == LearningStep::Leave;
        let lambda_s = if leaves {
            0.0
        } else {
            rates::LAMBDA_PER_PSI * prior_s
        };
        LearnedValues {
            fast: self.threshold / rates::clamp_delay_s(self.config.min_delay_s, longest_s),
            toward_most: self.toward_within(longest_s),
            toward: &[],
            psi: SimTime(u64::MAX),
            lambda: SimTime::from_secs_f64(lambda_s),
            learned: LearnedTerms {
                is_withheld: step != LearningStep::Try,
                // A robot that leaves does so at once, because its time counts from activation.
                trial: if leaves {
                    SimTime::ZERO
                } else {
                    self.trial_of(task)
                },
            },
        }
    }

    /// Returns the start of the robot's current trial of a task; 0 if there is none.
    fn trial_of(&self, task: TaskId) -> SimTime {
        let trial = self.monitor.current_trial().filter(|(at, _)| *at == task);
        trial.map_or(SimTime::ZERO, |(_, began)| began)
    }

    fn toward_within(&self, patience_s: f64) -> TowardTeammate {
        // Rounded to the millisecond as all times, so that the motivation reaches θ when φ ends.
        let phi = SimTime::from_secs_f64(patience_s).max(SimTime(1));
        TowardTeammate {
            slow: self.threshold / phi.as_secs_f64(),
            phi,
        }
    }
}

impl RunningAllocator for Learner {
    fn checkpoint(&self) -> Box<dyn RunningAllocator> {
        Box::new(self.clone())
    }

    fn weighs_costs(&self) -> bool {
        false
    }

    fn learned(&self) -> Vec<(TaskId, RobotId, LearnedTimes)> {
        self.monitor.learned()
    }

    fn step(&mut self, input: &Input<'_>, outcome: &mut StepOutcome) {
        self.monitor.receive(input.now, input.received);
        self.monitor.note_progress(input.now, input.progressed);
        self.update_boredom(input);
        self.update_values(input.now);
        self.plan_learning(input);
        self.apply();
        RunningAllocator::step(&mut self.engine, input, outcome);
        let active = outcome.active.and_then(|active| self.me.task_of(active));
        self.monitor.note_active(input.now, active);
    }
}
