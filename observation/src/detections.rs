//! The detection of lost robots by their teammates, found from views: while a run is live, and for its page at the end.

use std::collections::HashMap;

use proto::control::AgentState;
use proto::event::EventLine;
use proto::view::{LevelUnit, View};
use scenario::Setup;
use scenario::ids::{BehaviorId, TaskId};
use scenario::time::SimTime;

/// Finds the first teammate whose impatience for the task of a lost robot rises: by then, the robot's last claim is older than the
/// teammate's τ. Allocators with utilities have no impatience, and their robots show no detection. A fast live run skips views, so a
/// detection is as late as the next view, and its delay is approximate.
pub struct DetectionWatch {
    step: SimTime,
    robots: Vec<String>,
    tasks: Vec<String>,
    /// The task of each behavior set.
    sets: Vec<TaskId>,
    /// The active set of each robot in the last view; `None` before the first view.
    active: Vec<Option<BehaviorId>>,
    /// The time of the last view.
    seen: Option<SimTime>,
    lost: Vec<LostRobot>,
}

/// A lost robot whose loss no teammate has detected.
struct LostRobot {
    robot: usize,
    task: TaskId,
    at: SimTime,
    state: AgentState,
    /// The impatience of the teammates' sets for the task in the last view, motivation/s.
    impatience: HashMap<(usize, BehaviorId), f64>,
}

impl DetectionWatch {
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        let robots = setup.scenario.robots.iter();
        let robots: Vec<String> = robots.map(|robot| robot.name.clone()).collect();
        let tasks = setup.catalog.tasks.iter().map(|task| task.name.clone());
        Self {
            step: SimTime(setup.scenario.step_ms),
            active: vec![None; robots.len()],
            seen: None,
            robots,
            tasks: tasks.collect(),
            sets: setup.catalog.sets.iter().map(|set| set.task).collect(),
            lost: Vec::new(),
        }
    }

    /// Sets the behavior sets that the robots execute, in a tick without a view and without a loss.
    pub fn set_active(&mut self, active: impl Iterator<Item = Option<BehaviorId>>) {
        for (known, active) in self.active.iter_mut().zip(active) {
            *known = active;
        }
    }

    /// Adds the next view and returns the detections that it shows, as events. Their reason is the lost robot.
    pub fn see(&mut self, view: &View) -> Vec<EventLine> {
        // A view lies between two steps.
        let at = SimTime(view.now.0.saturating_sub(self.step.0));
        let seen = self.seen.replace(view.now);
        let is_exact = seen.is_none_or(|seen| view.now <= seen + self.step);
        for (rank, robot) in view.robots.iter().enumerate() {
            let is_lost = matches!(robot.state, AgentState::Dead | AgentState::Silent);
            let known = self.lost.iter().position(|lost| lost.robot == rank);
            match (is_lost, known) {
                (true, None) => {
                    if let Some(set) = self.active[rank].take() {
                        self.lost.push(LostRobot {
                            robot: rank,
                            task: self.sets[set.index()],
                            at,
                            state: robot.state,
                            impatience: HashMap::new(),
                        });
                    }
                }
                (false, Some(index)) => {
                    self.lost.swap_remove(index);
                }
                _ => {}
            }
            if !is_lost {
                self.active[rank] = robot.active;
            }
        }
        let mut events = Vec::new();
        let sets = &self.sets;
        let (robots, tasks) = (&self.robots, &self.tasks);
        self.lost.retain_mut(|lost| {
            let Some(by) = lost.detected_by(view, sets) else {
                return true;
            };
            let loss = match lost.state {
                AgentState::Dead => "its death",
                _ => "its last report",
            };
            events.push(EventLine {
                t_ms: at,
                kind: "detected".to_owned(),
                robot: robots[by].clone(),
                subject: tasks[lost.task.index()].clone(),
                reason: robots[lost.robot].clone(),
                detail: match (at.since(lost.at).as_secs_f64(), is_exact) {
                    (delay, true) => format!("{delay:.2} s after {loss}"),
                    (delay, false) => format!("about {delay:.0} s after {loss}"),
                },
            });
            false
        });
        events
    }
}

impl LostRobot {
    /// Returns the first teammate whose impatience for the task has risen since the last view.
    fn detected_by(&mut self, view: &View, sets: &[TaskId]) -> Option<usize> {
        let mut found = None;
        for (rank, robot) in view.robots.iter().enumerate() {
            let is_teammate = rank != self.robot && robot.state == AgentState::Present;
            if !is_teammate || robot.measure != LevelUnit::Motivation {
                continue;
            }
            for set in &robot.sets {
                let motivation = &set.motivation;
                if sets[motivation.set.index()] != self.task {
                    continue;
                }
                let key = (rank, motivation.set);
                let before = self.impatience.insert(key, motivation.impatience);
                if before.is_some_and(|before| before < motivation.impatience) {
                    found = found.or(Some(rank));
                }
            }
        }
        found
    }
}
