//! When a behavior set activates, takes a task over, yields and gives up (ALLIANCE.md §4): closed forms, exact but for the
//! steps in which things are noticed and heard.

use alliance_proto::scenario::{
    BehaviorParams, BehaviorSpec, HistoryOrigin, Robot, Setup, Switches,
};

/// Times of one behavior set of one robot, s.
#[derive(Clone, Debug, PartialEq)]
pub struct Forecast {
    /// The robot.
    pub robot: String,
    /// Its behavior set.
    pub set: String,
    /// The task.
    pub task: String,
    /// From 0 to the threshold while nobody is on the task.
    pub activates_s: f64,
    /// ψ: active for so long, it yields to a teammate that wants the task.
    pub yields_s: f64,
    /// λ: active for so long, it gives up.
    pub gives_up_s: f64,
    /// Estimated length of a unit of its work, as the mission says.
    pub work_s: f64,
    /// Toward each set of a teammate that does the same task.
    pub takeovers: Vec<Takeover>,
}

/// When a robot takes a task over from a teammate, counted from the teammate's first word, s. A teammate that reports
/// progress counts as speaking its first word again, where the history begins at progress.
#[derive(Clone, Debug, PartialEq)]
pub struct Takeover {
    /// The teammate.
    pub teammate: String,
    /// The behavior set that it uses.
    pub set: String,
    /// From one that falls silent after its first word.
    pub silent_s: f64,
    /// From one that talks, makes no progress, yields and gives up in time, and does not come back after that; the robot
    /// has not spoken of the task before.
    pub failing_s: f64,
    /// From one that makes progress with every unit of its work; `None`: never.
    pub working_s: Option<f64>,
}

/// The forecasts of all robots and sets, by rank and in the catalog's order.
#[must_use]
pub fn forecasts(setup: &Setup) -> Vec<Forecast> {
    let scenario = &setup.scenario;
    let catalog = &setup.catalog;
    let unit_s = |robot: &Robot, set: &BehaviorSpec| {
        let body = scenario.body_of(robot);
        catalog
            .mission
            .unit_s(scenario, &body, robot.skill_at(set), set)
    };
    let params_of = |robot: &str, set: &str| &setup.alliance.robots[robot].sets[set];
    let mut forecasts = Vec::new();
    for robot in &scenario.robots {
        for id in catalog.behaviors_of(robot) {
            let set = &catalog.sets[id.index()];
            let own = params_of(&robot.name, &set.name);
            let mut takeovers = Vec::new();
            for teammate in scenario.robots.iter().filter(|it| it.name != robot.name) {
                for theirs in catalog.behaviors_of(teammate) {
                    let theirs = &catalog.sets[theirs.index()];
                    if theirs.task == set.task {
                        let rival = Rival {
                            name: &teammate.name,
                            set: &theirs.name,
                            params: params_of(&teammate.name, &theirs.name),
                            work_s: unit_s(teammate, theirs),
                        };
                        takeovers.push(rival.takeover(setup, own));
                    }
                }
            }
            forecasts.push(Forecast {
                robot: robot.name.clone(),
                set: set.name.clone(),
                task: own.task.clone(),
                activates_s: setup.alliance.threshold / own.fast_impatience,
                yields_s: own.before_yielding_s,
                gives_up_s: own.before_giving_up_s,
                work_s: unit_s(robot, set),
                takeovers,
            });
        }
    }
    forecasts
}

/// Time from 0 to `threshold` with rate `slow` for the first `slow_s` and `fast` after that, s.
#[must_use]
pub fn rise_s(threshold: f64, slow: f64, fast: f64, slow_s: f64) -> f64 {
    let reached = slow * slow_s;
    if reached >= threshold {
        threshold / slow
    } else {
        slow_s + (threshold - reached) / fast
    }
}

/// A teammate on the task.
struct Rival<'a> {
    name: &'a str,
    set: &'a str,
    params: &'a BehaviorParams,
    work_s: f64,
}

impl Rival<'_> {
    fn takeover(&self, setup: &Setup, own: &BehaviorParams) -> Takeover {
        let switches = &setup.alliance.switches;
        let (tau_s, phi_s) = (own.ceased_after_s, own.phi_toward(self.name));
        let rise = |slow_s: f64| {
            let slow = own.slow_toward(self.name);
            rise_s(setup.alliance.threshold, slow, own.fast_impatience, slow_s)
        };

        let silent = rise(tau_s.min(phi_s));
        let failing_s = self.failing_s(switches, own, &rise);
        let starts_again = switches.history_origin == HistoryOrigin::Progress;
        let is_left_alone = starts_again && rise(phi_s) > self.work_s;
        Takeover {
            teammate: self.name.to_owned(),
            set: self.set.to_owned(),
            // At the threshold, it waits until the teammate is taken to have ceased.
            silent_s: if switches.waiting {
                silent.max(tau_s)
            } else {
                silent
            },
            failing_s,
            working_s: (!is_left_alone).then_some(failing_s),
        }
    }

    fn failing_s(
        &self,
        switches: &Switches,
        own: &BehaviorParams,
        rise: &impl Fn(f64) -> f64,
    ) -> f64 {
        let tau_s = own.ceased_after_s;
        let phi_s = own.phi_toward(self.name);
        let (psi_s, lambda_s) = (
            self.params.before_yielding_s,
            self.params.before_giving_up_s,
        );
        // Without a release, its last heartbeat slows the others down for τ, and occupies the task unless it says that it
        // is idle.
        let slows_s = if switches.release_message { 0.0 } else { tau_s };
        let occupies_s = if switches.idle_heartbeat {
            0.0
        } else {
            slows_s
        };
        let wishes_s = rise(phi_s.min(lambda_s + slows_s));
        if !switches.waiting {
            return wishes_s;
        }
        let leaves_s = if switches.waiting_counts && switches.reset_stops_active {
            // The wish is its first word on the task, and switches the other off.
            wishes_s.min(lambda_s)
        } else {
            wishes_s.max(psi_s).min(lambda_s)
        };
        let waits_out_s = wishes_s + own.before_yielding_s + tau_s;
        wishes_s.max(leaves_s + occupies_s).min(waits_out_s)
    }
}
