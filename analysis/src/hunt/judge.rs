//! One exact run of a case and its judgement.

use std::sync::Arc;

use in_process::Team;
use missions::Registry;
use proto::tick::Outcome;
use run_log::{LogLevel, MemoryLog, RunLog};
use scenario::ids::RobotId;
use scenario::mission::columns::Progress;
use scenario::time::SimTime;
use scenario::{Scenario, Setup};
use terminal::counted;
use terminal::panics::catch;
use world_server::simulation::Simulation;

use super::case::{Case, Conditions, Judgement};
use super::cooperation::Cooperation;
use super::coverage::Coverage;
use super::violation::{FoundViolation, ViolationKind};
use crate::invariants::coverage::{is_covered, is_operational, is_within_reach};
use crate::invariants::termination::is_calm;
use crate::invariants::{Invariants, WorldState, replayed};

/// The number of ticks between two looks at the coverage and the remaining work. More ticks save time, but miss faults
/// that last for less.
const TICKS_PER_LOOK: u64 = 10;

/// Runs a case and judges it. Returns `None` if `stops` returned true. If a slow run is a violation and the makespan
/// without faults is not known, the case runs without faults first.
pub fn judge(case: &Case, conditions: &Conditions, stops: &dyn Fn() -> bool) -> Option<Judgement> {
    let mut base_ms = case.base_ms;
    if base_ms.is_none() && conditions.include(ViolationKind::Slow) && !case.faults.is_empty() {
        let fault_free = run(
            &case.without_faults(),
            None,
            &conditions.only(ViolationKind::Panic),
            stops,
        )?;
        base_ms = fault_free.complete.then_some(fault_free.end_ms);
    }
    let mut judgement = run(case, base_ms, conditions, stops)?;
    judgement.base_ms = base_ms;
    Some(judgement)
}

fn run(
    case: &Case,
    base_ms: Option<SimTime>,
    conditions: &Conditions,
    stops: &dyn Fn() -> bool,
) -> Option<Judgement> {
    let setup = match catch(|| case.setup()) {
        Ok(Ok(setup)) => setup,
        Ok(Err(error)) => {
            return Some(Judgement {
                invalid: Some(one_line(&format!("{error:#}"))),
                ..Judgement::default()
            });
        }
        Err(panic) => return Some(failed(panic, SimTime::ZERO)),
    };
    let simulated = catch(|| simulate(setup, base_ms, conditions, stops));
    match simulated {
        Ok(Ok(judgement)) => judgement,
        Ok(Err(error)) => Some(failed(format!("{error:#}"), SimTime::ZERO)),
        Err(panic) => Some(failed(panic, SimTime::ZERO)),
    }
}

/// Returns the judgement of a run that did not reach its end.
fn failed(reason: String, at_ms: SimTime) -> Judgement {
    Judgement {
        violation: Some(FoundViolation {
            kind: ViolationKind::Panic,
            at_ms,
            description: one_line(&reason),
        }),
        end_ms: at_ms,
        ..Judgement::default()
    }
}

fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ")
}

fn simulate(
    setup: Setup,
    base_ms: Option<SimTime>,
    conditions: &Conditions,
    stops: &dyn Fn() -> bool,
) -> anyhow::Result<Option<Judgement>> {
    let mut inspector = Inspector::new(&setup, base_ms, conditions);
    let scenario = Arc::new(setup.scenario.clone());
    let limit = SimTime::from_secs_f64(scenario.limit_s);
    let mut team = Team::new(setup, LogLevel::Off, MemoryLog::default())?;
    let outcome = loop {
        let outcome = team.tick()?;
        if let Some(found) = inspector.inspect(team.simulation(), outcome.is_some()) {
            return Ok(Some(inspector.judgement(
                team.simulation(),
                Some(found),
                false,
            )));
        }
        if let Some(outcome) = outcome {
            break outcome;
        }
        if stops() {
            return Ok(None);
        }
    };
    let is_complete = outcome == Outcome::Complete;
    let mut judgement = inspector.judgement(team.simulation(), None, is_complete);
    let at_ms = judgement.end_ms;
    let of = |kind, description| FoundViolation {
        kind,
        at_ms,
        description,
    };
    if !is_complete && conditions.include(ViolationKind::Incomplete) {
        let left = progress(team.simulation()).map_or(0, |progress| progress.left);
        let left = counted(left as usize, "unit");
        let what = format!("the run ended at {at_ms} with {left} of work left");
        judgement.violation = Some(of(ViolationKind::Incomplete, what));
    } else if let Some(from) = conditions.par2_from
        && judgement.par2(limit) >= from
    {
        let what = format!("the PAR2 time is {}", judgement.par2(limit));
        judgement.violation = Some(of(ViolationKind::WorstPar2, what));
    } else if conditions.include(ViolationKind::ReplayIdentical) {
        let (_, recorder) = team.end(outcome)?;
        let vocabulary = Registry::current().vocabulary();
        let log = RunLog::from_memory(&recorder.into_sink(), &vocabulary)?;
        if let Err(error) = replayed::check(&log) {
            let what = one_line(&format!("{error:#}"));
            judgement.violation = Some(of(ViolationKind::ReplayIdentical, what));
        }
    }
    Ok(Some(judgement))
}

/// Returns the progress of the mission; `None` if it counts no work.
fn progress(simulation: &Simulation) -> Option<Progress> {
    Progress::from_row(&simulation.mission_columns())
}

/// The checks of a run after each of its ticks.
struct Inspector<'c> {
    scenario: Scenario,
    conditions: &'c Conditions,
    /// The checks of invariants; `None` if the plan names none.
    invariants: Option<Invariants>,
    slow_from: Option<SimTime>,
    cooperation: Cooperation,
    coverage: Coverage,
    /// The least remaining work so far.
    left: Option<u64>,
    /// The time since which a robot could work, but the remaining work did not decrease.
    idle_since: Option<SimTime>,
    idle: SimTime,
}

impl<'c> Inspector<'c> {
    fn new(setup: &Setup, base_ms: Option<SimTime>, conditions: &'c Conditions) -> Self {
        let mut invariants = ViolationKind::INVARIANTS.into_iter();
        let needs_invariants = invariants.any(|kind| conditions.include(kind));
        let is_slow = conditions.include(ViolationKind::Slow);
        let slow_from = base_ms.filter(|_| is_slow);
        Self {
            scenario: setup.scenario.clone(),
            conditions,
            invariants: needs_invariants.then(|| Invariants::new(setup)),
            slow_from: slow_from.map(|base| conditions.slow_from(base)),
            cooperation: Cooperation::default(),
            coverage: Coverage::default(),
            left: None,
            idle_since: None,
            idle: SimTime::ZERO,
        }
    }

    /// Checks the run after a tick. Returns the first violation.
    fn inspect(&mut self, simulation: &Simulation, is_over: bool) -> Option<FoundViolation> {
        if let Some(invariants) = &mut self.invariants
            && let Err(found) = invariants.check_simulation(simulation)
            && self.conditions.include(found.invariant.into())
        {
            return Some(FoundViolation {
                kind: found.invariant.into(),
                at_ms: SimTime(found.tick * self.scenario.step_ms),
                description: one_line(&found.to_string()),
            });
        }
        if is_over || !simulation.tick().is_multiple_of(TICKS_PER_LOOK) {
            return None;
        }
        let state = WorldState::from_simulation(simulation);
        let progress = progress(simulation);
        self.coverage.look(simulation, &state, progress.as_ref());
        self.measure_idle_time(simulation, &state, progress.as_ref());
        let of = |kind, description| FoundViolation {
            kind,
            at_ms: state.now,
            description,
        };
        if self.idle > self.conditions.abandoned
            && self.conditions.include(ViolationKind::Abandoned)
            && self.reaches_work(&state)
        {
            let left = self.left.unwrap_or(0);
            let left = counted(left as usize, "unit");
            let what = format!(
                "with {left} of work left and a robot that could do one, none was done for {}",
                self.idle
            );
            return Some(of(ViolationKind::Abandoned, what));
        }
        let bounds = [
            (ViolationKind::Duplicated, self.conditions.duplicated),
            (ViolationKind::Idle, self.conditions.idle),
        ];
        if bounds
            .iter()
            .any(|&(kind, _)| self.conditions.include(kind))
        {
            for held in self.cooperation.look(&self.scenario, simulation, &state) {
                let mut searched = bounds
                    .iter()
                    .filter(|&&(kind, _)| self.conditions.include(kind));
                if searched.any(|&(kind, bound)| kind == held.kind && held.held > bound) {
                    let what = format!("{}, for {}", held.description, held.held);
                    return Some(of(held.kind, what));
                }
            }
        }
        if let Some(from) = self.slow_from
            && state.now > from
        {
            let what = format!(
                "the run takes longer than {from}, which is {} times the run without faults",
                self.conditions.slow_factor
            );
            return Some(of(ViolationKind::Slow, what));
        }
        None
    }

    /// Measures how long an operational robot has had an applicable task without less remaining work. The time starts
    /// again with each unit of work. It stops while a fault is about to begin or to heal.
    fn measure_idle_time(
        &mut self,
        simulation: &Simulation,
        state: &WorldState,
        progress: Option<&Progress>,
    ) {
        let Some(progress) = progress else {
            return;
        };
        let is_less = self.left.is_none_or(|left| progress.left < left);
        let has_work = |robot: RobotId| {
            let levels = simulation.levels(robot);
            is_operational(&self.scenario, state, robot.index())
                && levels.iter().any(|level| level.sensory_feedback)
        };
        let could_work = !is_less
            && progress.left > 0
            && is_calm(state)
            && is_covered(&self.scenario, state)
            && simulation.barrier().robots().any(has_work);
        self.left = Some(progress.left);
        if !could_work {
            self.idle_since = None;
            return;
        }
        let since = *self.idle_since.get_or_insert(state.now);
        self.idle = self.idle.max(state.now.since(since));
    }

    /// Returns whether obstacles and bodies leave a way to the work. Otherwise the measurement starts again, because
    /// they move.
    fn reaches_work(&mut self, state: &WorldState) -> bool {
        let properties = self.scenario.mission().expected_properties(&self.scenario);
        let is_reached = is_within_reach(&self.scenario, &properties, state);
        if !is_reached {
            (self.idle, self.idle_since) = (SimTime::ZERO, None);
        }
        is_reached
    }

    /// Returns the judgement of the run so far.
    fn judgement(
        &mut self,
        simulation: &Simulation,
        violation: Option<FoundViolation>,
        complete: bool,
    ) -> Judgement {
        let end_ms = violation.as_ref().map_or_else(
            || SimTime(simulation.tick() * self.scenario.step_ms),
            |found| found.at_ms,
        );
        Judgement {
            violation,
            complete,
            end_ms,
            idle_ms: self.idle,
            states: std::mem::take(&mut self.coverage).into_states(),
            base_ms: None,
            invalid: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use scenario::fault::{Fault, Order};

    use super::super::plan::HuntPlan;
    use super::*;

    const PLAN: &str = "
budget = { runs = 1 }
limit_s = 120.0
seeds = 2
abandoned_s = 40.0
violations = ['abandoned', 'duplicated', 'idle', 'slow', 'incomplete', 'replay-identical']
slow_factor = 1.5
duplicated_s = 20.0
idle_s = 20.0
allocators = ['static', 'nearest', 'nearest-silent']
[scenario]
robots = [{ name = 'blue', side_sensor = true }, { name = 'gold' }]
room = { width_m = 7.0, height_m = 5.0 }
[scenario.waste]
border_known = true
spills = [{ name = 'left', items = 2, x_fraction = 0.3 }, { name = 'right', items = 2, x_fraction = 0.7 }]
";

    fn plan() -> HuntPlan {
        HuntPlan::parse("plan.toml", PLAN, |_| unreachable!()).unwrap()
    }

    fn kill(robot: &str, for_s: Option<f64>) -> Order {
        Order {
            at_s: Some(4.0),
            for_s,
            ..Order::now(Fault::Kill(robot.to_owned()))
        }
    }

    /// Judges a run of `static` (0), `nearest` (1) or `nearest-silent` (2) by one violation.
    fn judged(allocator: usize, faults: Vec<Order>, kind: ViolationKind) -> Judgement {
        let plan = plan();
        let case = Case {
            faults,
            ..plan.fault_free(allocator, 1)
        };
        let judge = || judge(&case, &plan.conditions.only(kind), &|| false).unwrap();
        assert_eq!(judge(), judge());
        judge()
    }

    #[test]
    fn a_run_without_faults_has_no_violation() {
        for allocator in [0, 1] {
            for kind in plan().conditions.violations {
                let judgement = judged(allocator, Vec::new(), kind);
                assert!(
                    judgement.complete && judgement.violation.is_none(),
                    "{judgement:?}"
                );
                assert!(judgement.states.is_empty());
            }
        }
    }

    #[test]
    fn the_tasks_of_a_lost_robot_are_abandoned_by_a_fixed_assignment() {
        let faults = || vec![kill("gold", None)];
        let left = judged(0, faults(), ViolationKind::Incomplete);
        assert_eq!(
            (left.kind(), left.end_ms),
            (Some(ViolationKind::Incomplete), SimTime(120_000))
        );
        assert!(!left.states.is_empty());
        // The run ends as soon as the task counts as abandoned, and the other rule takes over.
        let abandoned = judged(0, faults(), ViolationKind::Abandoned);
        assert_eq!(
            abandoned.kind(),
            Some(ViolationKind::Abandoned),
            "{abandoned:?}"
        );
        assert!(abandoned.end_ms < left.end_ms && abandoned.idle_ms > SimTime(40_000));
        let taken_over = judged(1, faults(), ViolationKind::Abandoned);
        assert!(
            taken_over.complete && taken_over.violation.is_none(),
            "{taken_over:?}"
        );
    }

    #[test]
    fn robots_without_a_radio_duplicate_work() {
        // Each robot executes the last task within a few seconds.
        let mut plan = plan();
        plan.conditions.duplicated = SimTime(3_000);
        let conditions = plan.conditions.only(ViolationKind::Duplicated);
        let silent = judge(&plan.fault_free(2, 1), &conditions, &|| false).unwrap();
        assert_eq!(silent.kind(), Some(ViolationKind::Duplicated), "{silent:?}");
        assert!(silent.end_ms > SimTime(3_000));
        assert_eq!(judged(2, Vec::new(), ViolationKind::Idle).kind(), None);
    }

    #[test]
    fn a_robot_with_a_fixed_assignment_is_idle_beside_the_task_of_a_lost_one() {
        let idle = judged(0, vec![kill("gold", None)], ViolationKind::Idle);
        assert_eq!(idle.kind(), Some(ViolationKind::Idle), "{idle:?}");
        let taken_over = judged(1, vec![kill("gold", None)], ViolationKind::Idle);
        assert!(
            taken_over.complete && taken_over.violation.is_none(),
            "{taken_over:?}"
        );
    }

    #[test]
    fn a_slow_run_is_measured_against_the_run_without_faults() {
        let faults = vec![kill("gold", Some(40.0)), kill("blue", Some(40.0))];
        let slow = judged(1, faults, ViolationKind::Slow);
        let base = judged(1, Vec::new(), ViolationKind::Slow).end_ms;
        assert_eq!(slow.base_ms, Some(base));
        assert_eq!(slow.kind(), Some(ViolationKind::Slow));
        assert!(slow.end_ms.as_secs_f64() > 1.5 * base.as_secs_f64());
    }

    #[test]
    fn a_contradiction_is_no_violation() {
        let judgement = judged(0, vec![kill("red", None)], ViolationKind::Incomplete);
        assert!(judgement.invalid.is_some() && judgement.violation.is_none());
    }

    #[test]
    fn a_stopped_run_has_no_judgement() {
        let plan = plan();
        let case = plan.fault_free(0, 1);
        assert_eq!(judge(&case, &plan.conditions, &|| true), None);
    }
}
