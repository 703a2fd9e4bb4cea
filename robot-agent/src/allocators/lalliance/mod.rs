//! L-ALLIANCE: ALLIANCE whose φ, ψ, δ_slow and δ_fast come from measured times (Parker, ORNL report 1995; Advanced Robotics 11(4),
//! 1997; ALLOCATORS.md §3).
//!
//! Motivations, states and heartbeats are ALLIANCE's own engine, with θ, the switches, ρ and τ of `[alliance]`. In each step this rule
//! measures, and gives the engine the values that follow. It says nothing beside heartbeats.
//!
//! - `monitor`: how long each robot needs for each task;
//! - `rates`: which values follow from that, by strategy and ordering;
//! - `config`: the parameters;
//! - `kind`: L-ALLIANCE as an allocator that scenarios name.

mod config;
mod kind;
mod monitor;
mod rates;
#[cfg(test)]
mod tests;

use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
use alliance_proto::scenario::{KnownTimes, Setup, Switches};
use alliance_proto::time::SimTime;
use rand::RngExt;

use super::alliance::{Engine, Learned, Toward, Values};
use crate::allocator::{Input, Me, Mind, Outcome};
use monitor::Monitor;
use rates::{Category, Knowledge, Rates};

pub use config::{Config, Ordering, Strategy};
pub use kind::LAlliance;

/// The learning motivational behaviors of one robot.
#[derive(Clone, Debug)]
pub struct Learner {
    me: Me,
    config: Config,
    threshold: f64,
    engine: Engine,
    monitor: Monitor,
    /// The own tasks, each once, in the order of the catalog.
    tasks: Vec<TaskId>,
    /// When the incarnation began.
    began: Option<SimTime>,
    /// Whether a behavior was active after the latest step.
    was_active: bool,
    boredom: f64,
    /// From [0, 1), by own task: the order of [`Ordering::Random`].
    draws: Vec<f64>,
    /// What the robot knew of its tasks and made of it in the latest step; kept for its memory.
    lessons: Vec<Lesson>,
    /// φ and δ_slow toward single teammates; kept for its memory.
    toward: Vec<(RobotId, Toward)>,
}

/// What a robot knows of an own task, and what follows.
#[derive(Clone, Copy, Debug)]
struct Lesson {
    knowledge: Knowledge,
    rates: Rates,
    /// How active learning goes about the task, while it goes on.
    drill: Option<Drill>,
}

/// What active learning wants of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Drill {
    /// A trial.
    Try,
    /// Nothing for now.
    Rest,
    /// It is left for another one after the trial that has just ended.
    Leave,
}

impl Learner {
    /// A robot at the start of an incarnation, with θ and the switches of `[alliance]`.
    #[must_use]
    pub fn new(me: &Me, config: &Config, threshold: f64, switches: Switches) -> Self {
        let mut tasks: Vec<TaskId> = me.behaviors.iter().map(|own| own.task).collect();
        tasks.sort_unstable();
        tasks.dedup();
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
            lessons: Vec::with_capacity(tasks.len()),
            toward: Vec::new(),
            tasks,
            me: me.clone(),
        }
    }

    /// Takes in what the robot has learned in earlier runs.
    pub(super) fn recall(&mut self, setup: &Setup) {
        let own = setup.profile.robots.get(setup.roster.name(self.me.robot));
        for (task, times) in own.into_iter().flatten() {
            for (robot, times) in times {
                let task = setup.catalog.task_named(task);
                let robot = setup.roster.robot_named(robot);
                if let (Some(task), Some(robot)) = (task, robot) {
                    self.monitor.recall(task, robot, times);
                }
            }
        }
    }

    fn task_of(&self, behavior: BehaviorId) -> Option<TaskId> {
        let mut own = self.me.behaviors.iter();
        own.find(|own| own.id == behavior).map(|own| own.task)
    }

    /// Boredom, and a new order whenever the robot becomes free.
    fn wait(&mut self, input: &Input<'_>) {
        let is_active = self.engine.active().is_some();
        if self.began.is_none() || (self.was_active && !is_active) {
            let mut stream = input.draws.stream();
            self.draws.fill_with(|| stream.random());
        }
        self.boredom = if is_active || self.began.is_none() {
            0.0
        } else {
            // There is nothing beyond the threshold.
            let bored = self.boredom + self.config.boredom_rate * input.step_s;
            bored.min(self.config.boredom_threshold)
        };
        self.was_active = is_active;
        self.began.get_or_insert(input.now);
    }

    fn know(&self, task: TaskId, now: SimTime) -> Knowledge {
        let (me, brief) = (self.me.robot, &self.me.briefs[task.index()]);
        let own_s = self.monitor.time_s(task, me);
        let has_tried = |robot| self.monitor.tried(task).any(|(it, _)| it == robot);
        let able = self
            .monitor
            .present(now)
            .filter(move |&robot| brief.robots.binary_search(&robot).is_ok() || has_tried(robot));
        let able = able.map(|robot| (self.monitor.time_s(task, robot), robot));
        let (mut best_s, mut is_best) = (own_s, true);
        for other in able {
            best_s = best_s.min(other.0);
            is_best &= rates::goes_before((own_s, me), other);
        }
        let is_free = self.monitor.executing(task) < brief.max_robots;
        let times = self.monitor.tried(task).map(|(_, time_s)| time_s);
        Knowledge {
            own_s,
            best_s,
            shortest_s: times.fold(own_s, f64::min),
            category: if is_best && is_free {
                Category::Mine
            } else {
                Category::Others
            },
        }
    }

    /// What is known of each own task, and what follows from it by strategy and ordering.
    fn study(&mut self, now: SimTime) {
        let (mut low_s, mut high_s) = (f64::INFINITY, 0.0_f64);
        for &task in &self.tasks {
            let own_s = self.monitor.time_s(task, self.me.robot);
            let times = self.monitor.tried(task).map(|(_, time_s)| time_s);
            for time_s in times.chain([own_s]) {
                (low_s, high_s) = (low_s.min(time_s), high_s.max(time_s));
            }
        }
        let mut lessons = std::mem::take(&mut self.lessons);
        lessons.clear();
        lessons.extend(self.tasks.iter().zip(&self.draws).map(|(&task, &draw)| {
            let knowledge = self.know(task, now);
            Lesson {
                rates: rates::rates(&self.config, &knowledge, (low_s, high_s), draw),
                knowledge,
                drill: None,
            }
        }));
        self.lessons = lessons;
    }

    /// Active learning: of the applicable tasks at which nobody is heard, the one that the robot has tried least.
    fn drill(&mut self, input: &Input<'_>) {
        let wanted = self.config.learning_trials;
        let since = input.now.since(self.began.unwrap_or_default());
        let is_over = since >= SimTime::from_secs_f64(self.config.learning_limit_s)
            || (self.tasks.iter()).all(|&task| self.monitor.own_trials(task) >= wanted);
        if is_over {
            return;
        }
        let can = |task: TaskId| {
            let mut own = self.me.behaviors.iter().zip(input.applicable);
            own.any(|(own, applicable)| own.task == task && *applicable)
        };
        let free = self.tasks.iter().copied();
        let free = free.filter(|&task| can(task) && self.monitor.executing(task) == 0);
        let next = free.min_by_key(|&task| self.monitor.own_trials(task));
        let at = self.monitor.own().map(|(task, _)| task);
        for (&task, lesson) in self.tasks.iter().zip(&mut self.lessons) {
            let has_ended = at == Some(task) && input.progressed.contains(&task);
            lesson.drill = Some(if next == Some(task) {
                Drill::Try
            } else if has_ended && next.is_some() {
                Drill::Leave
            } else {
                Drill::Rest
            });
        }
    }

    /// Gives the engine what has been learned.
    fn apply(&mut self) {
        let mut list = std::mem::take(&mut self.toward);
        for (place, own) in self.me.behaviors.iter().enumerate() {
            // The list is of the tasks of all own behaviors.
            let index = self.tasks.binary_search(&own.task).unwrap_or_default();
            list.clear();
            let values = match self.lessons[index].drill {
                None => self.adaptive(own.task, &self.lessons[index], &mut list),
                Some(drill) => self.active(own.task, drill),
            };
            let toward = &list;
            self.engine.learn(place, &Values { toward, ..values });
        }
        self.toward = list;
    }

    /// Adaptive learning. Writes to `list` the teammates for whom φ is another than for who has made no trial.
    fn adaptive(
        &self,
        task: TaskId,
        lesson: &Lesson,
        list: &mut Vec<(RobotId, Toward)>,
    ) -> Values<'static> {
        let Lesson {
            knowledge, rates, ..
        } = lesson;
        let toward = |theirs_s| {
            let strategy = self.config.strategy;
            self.toward_within(rates::patience_s(strategy, knowledge, theirs_s))
        };
        let toward_most = toward(self.monitor.prior_s(task));
        for (robot, theirs_s) in self.monitor.tried(task) {
            let it = toward(theirs_s);
            if robot != self.me.robot && it != toward_most {
                list.push((robot, it));
            }
        }
        let others = list.iter().map(|(_, toward)| toward.phi);
        let shortest = others.fold(toward_most.phi, SimTime::min);
        let is_bored = self.boredom >= self.config.boredom_threshold;
        let is_withheld = rates::has_categories(&self.config)
            && knowledge.category == Category::Others
            && !is_bored;
        Values {
            fast: self.threshold / rates::clamped_s(rates.delay_s, shortest.as_secs_f64()),
            toward_most,
            toward: &[],
            psi: SimTime::from_secs_f64(rates.psi_s),
            lambda: SimTime::from_secs_f64(rates.lambda_s),
            learned: Learned {
                is_withheld,
                trial: self.trial_of(task),
            },
        }
    }

    /// Active learning: patient with all for as long as it lasts, without ψ.
    fn active(&self, task: TaskId, drill: Drill) -> Values<'static> {
        let prior_s = self.monitor.prior_s(task);
        let longest_s = self.config.learning_limit_s.max(prior_s);
        let leaves = drill == Drill::Leave;
        let lambda_s = if leaves {
            0.0
        } else {
            rates::GIVING_UP * prior_s
        };
        Values {
            fast: self.threshold / rates::clamped_s(self.config.min_delay_s, longest_s),
            toward_most: self.toward_within(longest_s),
            toward: &[],
            psi: SimTime(u64::MAX),
            lambda: SimTime::from_secs_f64(lambda_s),
            learned: Learned {
                is_withheld: drill != Drill::Try,
                // Whoever leaves does so at once: its time counts from activation.
                trial: if leaves {
                    SimTime::ZERO
                } else {
                    self.trial_of(task)
                },
            },
        }
    }

    /// Since when the robot's own trial of a task goes on, if one does.
    fn trial_of(&self, task: TaskId) -> SimTime {
        let own = self.monitor.own().filter(|(at, _)| *at == task);
        own.map_or(SimTime::ZERO, |(_, began)| began)
    }

    fn toward_within(&self, patience_s: f64) -> Toward {
        // To the millisecond, as all times: the motivation is at θ when patience is over.
        let phi = SimTime::from_secs_f64(patience_s).max(SimTime(1));
        Toward {
            slow: self.threshold / phi.as_secs_f64(),
            phi,
        }
    }
}

impl Mind for Learner {
    fn checkpoint(&self) -> Box<dyn Mind> {
        Box::new(self.clone())
    }

    fn weighs_costs(&self) -> bool {
        false
    }

    fn learned(&self) -> Vec<(TaskId, RobotId, KnownTimes)> {
        self.monitor.learned()
    }

    fn step(&mut self, input: &Input<'_>, outcome: &mut Outcome) {
        self.monitor.hear(input.now, input.heard);
        self.monitor.note_progress(input.now, input.progressed);
        self.wait(input);
        self.study(input.now);
        self.drill(input);
        self.apply();
        Mind::step(&mut self.engine, input, outcome);
        let active = outcome.active.and_then(|active| self.task_of(active));
        self.monitor.note_active(input.now, active);
    }
}
