//! L-ALLIANCE in whole missions: its strategies, and its laws to the step.

use alliance_tests::runs::{Events, log_of, parse, play, run, setup, vocabulary};
use proto::tick::Outcome;
use run_log::{LogLevel, MessageRow, RunLog};
use scenario::mission::FigureValue;
use scenario::{Profile, Setup};

use crate::allocators::scenario;

/// Missions complete with each strategy and ordering that uses learned times, and after active learning.
#[test]
fn every_strategy_and_ordering_completes_the_mission() {
    for values in [
        "strategy = \"I\"",
        "strategy = \"III\"",
        "strategy = \"III\"\nordering = \"shortest-first\"",
        "strategy = \"III\"\nordering = \"random\"",
        "learning_trials = 3",
    ] {
        let rest = format!("[allocators.l-alliance]\n{values}\n");
        let (outcome, _) = play(scenario("l-alliance", &rest), 1);
        assert_eq!(outcome, Outcome::Complete, "{values}");
    }
}

/// Returns the log of robots `blue` and `gold` with one kind of work, of which each point takes `work_s`.
///
/// The profile states `blue_s` and `gold_s` as their learned times. With the longest time first, gold begins after
/// the shortest delay of 2 s. Blue's delay is the longest, 8 s. At θ a robot activates at once, regardless of other
/// claims.
fn two(
    step_ms: u64,
    (work_s, points): (f64, u16),
    (blue_s, gold_s): (f64, f64),
    faults: &str,
) -> RunLog {
    let text = format!(
        "step_ms = {step_ms}\nlimit_s = 300\nallocator = 'l-alliance'\n{faults}\
         [alliance.switches]\nwaiting = false\narbitration = false\n\
         [allocators.l-alliance]\nstrategy = 'III'\n[service]\ntasks = 'kinds'\nreach_m = 1000\n\
         [[service.kinds]]\nname = 'work'\nwork_s = {{ min = {work_s}, max = {work_s} }}\n\
         [[service.random]]\nn = {points}\n\
         [[robots]]\nname = 'blue'\nskills = {{ work = 1 }}\n[[robots]]\nname = 'gold'\nskills = {{ work = 1 }}\n"
    );
    let scenario = parse(&text);
    let profile = ["blue", "gold"].map(|robot| {
        let [blue, gold] =
            [blue_s, gold_s].map(|time_s| format!("{{ trials = 1, latest_s = [{time_s}] }}"));
        format!("[{robot}.'serve(work)']\nblue = {blue}\ngold = {gold}\n")
    });
    let profile = profile.concat();
    let setup = Setup {
        profile: Profile::parse("p.toml", &profile, &scenario, &vocabulary()).unwrap(),
        ..setup(scenario, 1)
    };
    log_of(run(setup, LogLevel::Full).1)
}

/// Returns the time of a robot's first activation, in ms.
fn activated(log: &RunLog, robot: &str) -> Option<u64> {
    log.times_of(robot, "activated").first().copied()
}

/// Returns the times at which blue received gold's first and last heartbeat with the task, in ms.
fn received(log: &RunLog) -> (u64, u64) {
    let rows = log.each_row::<MessageRow>().map(|row| row.unwrap());
    let received = rows.filter(|row| {
        row.receiver == "blue" && row.state == "executing" && row.delivery == "received"
    });
    let times: Vec<u64> = received.map(|row| row.t_ms.0).collect();
    (times[0], times[times.len() - 1])
}

/// Law L1 to the step: a robot that broadcasts without progress is taken over d after its first received heartbeat.
#[test]
fn a_robot_without_progress_is_taken_over_after_its_learned_time() {
    for step_ms in [10, 50, 200] {
        for d_s in [20.0, 61.0] {
            let log = two(step_ms, (1e4, 1), (d_s - 5.0, d_s), "");
            assert_eq!(activated(&log, "gold"), Some(2000), "the shortest delay");
            let (first, _) = received(&log);
            assert_eq!(first, 2000 + step_ms);
            let expected_ms = first + (1000.0 * d_s) as u64;
            assert_eq!(activated(&log, "blue"), Some(expected_ms), "{step_ms} ms");
        }
    }
}

/// A robot that completes a point every d - 2δt keeps its task, though each point counts as a trial.
#[test]
fn a_robot_with_timely_progress_keeps_its_task() {
    for step_ms in [10, 50, 200] {
        let work_s = 20.0 - 2.0 * step_ms as f64 / 1000.0;
        let log = two(step_ms, (work_s, 12), (15.0, 20.0), "");
        assert_eq!(log.run.result.mission.get("done"), FigureValue::Count(12));
        assert_eq!(activated(&log, "blue"), None, "{step_ms} ms");
    }
}

/// The motivation for a crashed robot's task rises slowly until τ after its last message, then at blue's own rate, θ
/// in 8 s.
#[test]
fn a_crashed_robot_is_taken_over_after_tau_at_the_learned_rate() {
    for step_ms in [10, 50, 200] {
        let kill = "[[faults.timeline]]\nat_s = 15.3\nfault.kill = 'gold'\n";
        let log = two(step_ms, (1e4, 1), (55.0, 60.0), kill);
        let (first, last) = received(&log);
        let slow_s = (last - first) as f64 / 1000.0 + 5.0;
        let expected_s = first as f64 / 1000.0 + slow_s + 8.0 * (1.0 - slow_s / 60.0);
        let taken_s = activated(&log, "blue").unwrap() as f64 / 1000.0;
        let step_s = step_ms as f64 / 1000.0;
        let is_on_time = (taken_s - expected_s).abs() <= step_s + 1e-9;
        assert!(is_on_time, "{taken_s}, not {expected_s} s");
    }
}
