//! Whole runs and their replays.

use run_log::RunOutcome;

use super::*;

#[test]
fn the_next_tick_is_accepted() {
    assert_eq!(check_changed(|_| ()), Ok(()));
}

#[test]
fn a_whole_mission_is_accepted() {
    let (team, outcome) = checked(setup());
    let (_, recorder) = team.end(outcome).unwrap();
    let mut log = testkit::open(&recorder.into_sink());
    replayed::check(&log).unwrap();

    log.run.hash = Some("0".repeat(16));
    let error = replayed::check(&log).unwrap_err();
    let violation = error.downcast_ref::<Violation>().unwrap();
    assert_eq!(violation.invariant, Invariant::ReplayIdentical);
}

#[test]
fn figures_that_differ_in_the_replay_are_a_violation() {
    let team = Team::new(setup(), LogLevel::Off, MemoryLog::default()).unwrap();
    let (_, recorder) = team.run_for(20, Outcome::Interrupted, |_| ()).unwrap();
    let mut log = testkit::open(&recorder.into_sink());
    replayed::check(&log).unwrap();
    log.run.result.mission.add("reports_made", 9_u32);
    assert!(replayed::check(&log).is_err());
}

/// Checks that the replay derives how a run ended. Only an interruption comes from outside.
#[test]
fn an_end_that_the_run_did_not_have_is_a_violation() {
    use Outcome::{Complete, Expired, NoRobotLeft, TimeLimit};
    let team = Team::new(setup(), LogLevel::Off, MemoryLog::default()).unwrap();
    let (_, recorder) = team.run_for(20, Outcome::Interrupted, |_| ()).unwrap();
    let interrupted = recorder.into_sink();
    replayed::check(&testkit::open(&interrupted)).unwrap();
    for outcome in [Complete, Expired, NoRobotLeft, TimeLimit] {
        let mut log = testkit::open(&interrupted);
        log.run.outcome = RunOutcome::Ended(outcome);
        assert!(replayed::check(&log).is_err(), "{outcome:?}");
    }
    let mut log = testkit::run(testkit::setup(testkit::scenario("limit_s = 5.0")));
    replayed::check(&log).unwrap();
    log.run.setup.scenario.limit_s = 6.0;
    assert!(replayed::check(&log).is_err());
}

/// Checks that the replay begins the tick in which no robot is left, because faults may be due in it.
#[test]
fn a_run_that_ends_without_robots_is_replayed_to_its_last_fault() {
    let text = "
        robots = [{ name = 'blue' }, { name = 'gold', absent = true }]
        [[faults.timeline]]
        fault.kill = 'blue'
        at_s = 1.0
        [[faults.timeline]]
        fault.continue = 'gold'
        at_s = 2.0
    ";
    let log = testkit::run(testkit::setup(testkit::scenario(text)));
    assert_eq!(log.run.outcome, RunOutcome::Ended(Outcome::NoRobotLeft));
    let mut faults = log.run.faults.iter();
    assert!(faults.all(|fault| fault.applied_ms.is_some()));
    replayed::check(&log).unwrap();
}

/// Checks that a kill in the tick of a restart affects the same incarnation in the replay.
#[test]
fn a_restart_and_a_kill_in_one_tick_are_replayed() {
    for [first, then] in [["restart", "kill"], ["kill", "restart"]] {
        let text = format!(
            "
            robots = [{{ name = 'blue' }}, {{ name = 'gold' }}]
            limit_s = 5.0
            [[faults.timeline]]
            fault.{first} = 'blue'
            at_s = 1.0
            [[faults.timeline]]
            fault.{then} = 'blue'
            at_s = 1.0
        "
        );
        let log = testkit::run(testkit::setup(testkit::scenario(&text)));
        assert!(!log.run.unscripted, "{first}, {then}");
        assert!(log.run.faults.iter().all(|fault| fault.hits == 1));
        replayed::check(&log).unwrap();
    }
}

#[test]
fn ticks_that_are_left_out_or_do_not_end() {
    let left_out = check_changed(|state| state.tick = 2).unwrap_err();
    let expected = "ticks go on: tick 2: tick 1 was expected";
    assert_eq!(left_out.to_string(), expected);
    let mut invariants = Invariants::new(&setup());
    let mut team = Team::new(setup(), LogLevel::Off, MemoryLog::default()).unwrap();
    team.tick().unwrap();
    invariants.check_simulation(team.simulation()).unwrap();
    let stuck = invariants.check_simulation(team.simulation()).unwrap_err();
    let expected = "ticks go on: tick 1: the tick does not end";
    assert_eq!(stuck.to_string(), expected);
}

/// Compares the state with the run. The motivations come from the agents.
#[test]
fn a_world_state_matches_the_run() {
    let state = beginning();
    assert_eq!((state.tick, state.now), (0, SimTime(0)));
    assert_eq!((state.robots.len(), state.items.len()), (3, 24));
    let sets = |rank: usize| -> Vec<BehaviorId> {
        let motivations = state.robots[rank].motivations.iter();
        motivations.map(|motivation| motivation.set).collect()
    };
    assert_eq!(sets(0), [0, 1, 2, 3, 4].map(BehaviorId));
    assert_eq!(sets(1), [1, 2, 3, 4].map(BehaviorId));
    let mut robots = state.robots.iter();
    assert!(robots.all(|robot| robot.present && robot.takes_part));
}
