//! Closed forms of the times of a behavior set: activation, takeover, yielding and giving up (docs/ALLIANCE.md §4). They are
//! exact except for the ticks in which messages arrive.

use scenario::ids::TaskId;
use scenario::{BehaviorParams, BehaviorSpec, HistoryOrigin, Robot, Setup};
use serde::Serialize;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Forecast {
    pub robot: String,
    #[serde(rename = "behavior_set")]
    pub set: String,
    pub task: String,
    /// Time from motivation 0 to the threshold while no robot is on the task.
    pub activates_s: f64,
    /// ψ: the time after which an active set yields to a teammate that requests the task.
    pub yields_s: f64,
    /// λ: the time after which an active set gives up.
    pub gives_up_s: f64,
    /// The mission's estimate of the time for one unit of work.
    #[serde(rename = "unit_of_work_s")]
    pub work_s: f64,
    /// One entry per set of a teammate that does the same task.
    pub takeovers: Vec<Takeover>,
}

/// The times until a robot takes a task over from a teammate, counted from the teammate's first message on the task, s. If the
/// history starts at progress, each report of progress counts as a first message.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Takeover {
    pub teammate: String,
    #[serde(rename = "behavior_set")]
    pub set: String,
    /// The time if the teammate stops sending after its first message.
    pub silent_s: f64,
    /// The time if the teammate sends, makes no progress, yields and gives up on time, and does not return. The robot has not
    /// sent messages on the task before.
    pub failing_s: f64,
    /// The time if the teammate makes progress with every unit of work; `None`: never.
    pub working_s: Option<f64>,
}

/// Returns the forecasts of all robots and sets, by rank and in catalog order.
#[must_use]
pub fn forecasts(setup: &Setup) -> Vec<Forecast> {
    let scenario = &setup.scenario;
    let catalog = &setup.catalog;
    let unit_s_of = catalog.mission.work_unit_s(scenario);
    let unit_s = |robot: &Robot, set: &BehaviorSpec| {
        unit_s_of(&scenario.body_of(robot), robot.skill_at(set), set)
    };
    let params_of = |robot: &str, set: &str| &setup.alliance.robots[robot].sets[set];
    // The sets of all robots by task: a search for each set would be quadratic in the number of tasks.
    let mut sets: Vec<(TaskId, Rival<'_>)> = Vec::new();
    let mut by_task = vec![Vec::new(); catalog.tasks.len()];
    for robot in &scenario.robots {
        for id in catalog.behaviors_of(robot) {
            let set = &catalog.sets[id.index()];
            by_task[set.task.index()].push(sets.len());
            let set_of_robot = Rival {
                name: &robot.name,
                set: &set.name,
                params: params_of(&robot.name, &set.name),
                work_s: unit_s(robot, set),
            };
            sets.push((set.task, set_of_robot));
        }
    }
    let forecasts = sets.iter().map(|(task, own)| {
        let rivals = by_task[task.index()].iter().map(|place| &sets[*place].1);
        let rivals = rivals.filter(|rival| rival.name != own.name);
        Forecast {
            robot: own.name.to_owned(),
            set: own.set.to_owned(),
            task: own.params.task.clone(),
            activates_s: setup.alliance.threshold / own.params.fast_impatience,
            yields_s: own.params.before_yielding_s,
            gives_up_s: own.params.before_giving_up_s,
            work_s: own.work_s,
            takeovers: rivals
                .map(|rival| rival.takeover(setup, own.params))
                .collect(),
        }
    });
    forecasts.collect()
}

/// Returns the time from 0 to `threshold` with rate `slow` for the first `slow_s` and then with rate `fast`, s.
#[must_use]
pub fn rise_time_s(threshold: f64, slow: f64, fast: f64, slow_s: f64) -> f64 {
    let reached = slow * slow_s;
    if reached >= threshold {
        threshold / slow
    } else {
        slow_s + (threshold - reached) / fast
    }
}

/// A behavior set of a robot, as its teammates on the same task see it.
struct Rival<'a> {
    name: &'a str,
    set: &'a str,
    params: &'a BehaviorParams,
    work_s: f64,
}

impl Rival<'_> {
    fn takeover(&self, setup: &Setup, params: &BehaviorParams) -> Takeover {
        let switches = &setup.alliance.switches;
        let tau_s = params.ceased_after_s;
        let phi_s = params.willing_to_affect_toward_s(self.name);
        let (psi_s, lambda_s) = (
            self.params.before_yielding_s,
            self.params.before_giving_up_s,
        );
        let slow = params.slow_impatience_toward(self.name);
        let (threshold, fast) = (setup.alliance.threshold, params.fast_impatience);
        let rise = |slow_s: f64| rise_time_s(threshold, slow, fast, slow_s);

        // Without a release message, the teammate's last heartbeat slows the others for τ. It also occupies the task unless a
        // later heartbeat reports that the teammate is idle.
        let slows_s = if switches.release_message { 0.0 } else { tau_s };
        let occupies_s = match switches.idle_heartbeat {
            true => 0.0,
            false => slows_s,
        };
        let wishes_s = rise(phi_s.min(lambda_s + slows_s));
        let leaves_s = if switches.waiting_counts && switches.reset_stops_active {
            // The request is the robot's first message on the task and deactivates the teammate.
            wishes_s.min(lambda_s)
        } else {
            wishes_s.max(psi_s).min(lambda_s)
        };
        let waits_out_s = wishes_s + params.before_yielding_s + tau_s;
        let silent_s = rise(tau_s.min(phi_s));
        let (silent_s, failing_s) = match switches.waiting {
            // At the threshold, the robot waits until it considers the teammate lost.
            true => (
                silent_s.max(tau_s),
                wishes_s.max(leaves_s + occupies_s).min(waits_out_s),
            ),
            false => (silent_s, wishes_s),
        };
        let starts_again = switches.history_origin == HistoryOrigin::Progress;
        let is_left_alone = starts_again && rise(phi_s) > self.work_s;
        Takeover {
            teammate: self.name.to_owned(),
            set: self.set.to_owned(),
            silent_s,
            failing_s,
            working_s: (!is_left_alone).then_some(failing_s),
        }
    }
}
