//! Metrics of hand-made logs. Steps take 0.5 s; times are in seconds.

use std::path::Path;
use std::sync::Arc;

use missions::Registry;
use missions::waste::data::default_scenario;
use proto::tick::Outcome;
use proto::view::LevelUnit;
use run_log::{
    AllocationRow, EventRow, Figures, LogLevel, MemoryLog, MessageRow, MotivationRow, PoseRow,
    RobotFigures, RunFile, RunLog, RunOutcome, Table,
};
use scenario::ids::TaskId;
use scenario::time::SimTime;
use scenario::{Robot, Scenario, Setup, TaskSection};

use super::failures::{
    Detection, DetectionSign, Failure, Loss, OrphanOutcome, OrphanedTask, Takeover, TakeoverCause,
};
use super::figures::{FigureSelection, figures};
use super::history::History;
use super::made::RunOrigin as MadeHow;
use super::metrics::{Metrics, Occurrence, SentTotals};
use super::page::{RunSection, page};
use super::spans::{Span, Spans};
use super::stints::StintEnd;
use crate::visit;
use in_process::Team;

const BLUE: usize = 0;
const GOLD: usize = 1;
const GREEN: usize = 2;

const TOP: &str = "move-spill(top)";
const BOTTOM: &str = "move-spill(bottom)";
const REPORT: &str = "report-progress";

const STEP_MS: u64 = 500;

fn at(seconds: f64) -> SimTime {
    SimTime::from_secs_f64(seconds)
}

fn spans<const N: usize>(spans: [(f64, f64); N]) -> Spans {
    let span = |(from, to)| Span {
        from: at(from),
        to: at(to),
    };
    spans.into_iter().map(span).collect()
}

/// A log under construction.
struct Made {
    history: History,
    figures: Figures,
    outcome: RunOutcome,
}

impl Made {
    /// Creates a log of the default team with τ = 5 s and no rows.
    fn run(seconds: f64) -> Self {
        Self::with(seconds, |_| {})
    }

    fn with(seconds: f64, change: impl FnOnce(&mut Scenario)) -> Self {
        let mut scenario = Scenario {
            step_ms: STEP_MS,
            ..default_scenario()
        };
        change(&mut scenario);
        let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        Self {
            history: History::new(setup, at(seconds)),
            figures: Figures::default(),
            outcome: RunOutcome::Ended(Outcome::Complete),
        }
    }

    /// Adds rows for a robot in all ticks of an interval. Both spills' tasks are applicable, the set `active` is
    /// active, and all impatience is fast.
    fn during(&mut self, robot: &str, from: f64, to: f64, active: Option<&str>) {
        self.rows(robot, from, to, |row| {
            if Some(row.behavior_set.as_str()) == active {
                row.state = "active".to_owned();
            }
        });
    }

    fn rows(&mut self, robot: &str, from: f64, to: f64, change: impl Fn(&mut MotivationRow)) {
        let rank = self.history.rank(robot).unwrap();
        let sets: Vec<(String, f64)> = self.history.robots[rank]
            .sets
            .iter()
            .map(|set| (set.name.clone(), set.params.fast_impatience))
            .collect();
        for t_ms in (at(from).0..at(to).0).step_by(STEP_MS as usize) {
            for (set, fast) in &sets {
                let mut row = MotivationRow {
                    t_ms: SimTime(t_ms),
                    robot: robot.to_owned(),
                    behavior_set: set.clone(),
                    task: String::new(),
                    motivation: 1.0,
                    impatience: *fast,
                    sensory_feedback: set.starts_with("move-spill"),
                    activity_suppression: true,
                    impatience_reset: true,
                    acquiescence: true,
                    state: "hibernating".to_owned(),
                };
                change(&mut row);
                self.history.add_motivation(&row).unwrap();
            }
        }
    }

    fn event(&mut self, seconds: f64, kind: &str, robot: &str, rest: [&str; 3]) {
        let [subject, reason, detail] = rest.map(str::to_owned);
        self.history.events.push(EventRow {
            t_ms: at(seconds),
            kind: kind.to_owned(),
            robot: robot.to_owned(),
            subject,
            reason,
            detail,
        });
    }

    /// Adds a receipt: the receiver learns that the sender executes the task.
    fn claim(&mut self, seconds: f64, receiver: &str, sender: &str, task: &str) {
        self.message(seconds, receiver, sender, task, "executing", "heard");
    }

    fn message(
        &mut self,
        seconds: f64,
        receiver: &str,
        sender: &str,
        task: &str,
        state: &str,
        delivery: &str,
    ) {
        let row = MessageRow {
            t_ms: at(seconds),
            receiver: receiver.to_owned(),
            sender: sender.to_owned(),
            incarnation: 1,
            seq: Some(0),
            kind: "heartbeat".to_owned(),
            state: state.to_owned(),
            since_ms: None,
            behavior_set: task.to_owned(),
            task: task.to_owned(),
            progress: None,
            sent_ms: at(seconds - 0.5),
            delivery: delivery.to_owned(),
        };
        self.history.add_message(&row).unwrap();
    }

    fn run_file(&self) -> RunFile {
        RunFile {
            version: String::new(),
            log: LogLevel::Full,
            hash: None,
            outcome: self.outcome,
            unscripted: false,
            faults: Vec::new(),
            build: String::new(),
            agent_builds: std::collections::BTreeMap::new(),
            minds: std::collections::BTreeMap::new(),
            result: self.figures.clone(),
            setup: self.history.setup.clone(),
        }
    }

    fn metrics(&self) -> Metrics {
        Metrics::compute(&self.history, &self.run_file())
    }

    /// Returns the page without figures.
    fn page(&self) -> String {
        let (page, _) = page(&RunSection {
            run: &self.run_file(),
            history: &self.history,
            metrics: &self.metrics(),
            figures: Vec::new(),
            made: MadeHow::default(),
        });
        page
    }

    fn task(&self, name: &str) -> TaskId {
        self.history.task_named(name).unwrap()
    }
}

/// Gold executes the upper spill's task from 10 s, delivers in the step before 20 s and dies at 30 s. Blue takes over
/// at 45 s, delivers before 55 s and continues to 60 s.
fn death() -> Made {
    let mut made = Made::run(60.0);
    made.during("gold", 0.0, 10.0, None);
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.during("blue", 0.0, 45.0, None);
    made.during("blue", 45.0, 60.0, Some(TOP));
    made.during("green", 0.0, 60.0, None);
    for second in 10..30 {
        let received = f64::from(second) + 0.5;
        made.claim(received, "blue", "gold", TOP);
        // Green does not receive gold's last message.
        let delivery = if second == 29 { "lost" } else { "heard" };
        made.message(received, "green", "gold", TOP, "executing", delivery);
        // Claims of another task do not matter.
        made.claim(received + 0.5, "green", "blue", BOTTOM);
    }
    made.event(10.0, "activated", "gold", [TOP, "threshold", TOP]);
    made.event(19.5, "delivered", "gold", ["item-1", "", ""]);
    made.event(20.0, "progress", "gold", ["", "", TOP]);
    made.event(30.0, "gone", "gold", ["", "", ""]);
    made.event(45.0, "activated", "blue", [TOP, "threshold", TOP]);
    made.event(54.5, "delivered", "blue", ["item-2", "", ""]);
    made
}

#[test]
fn a_death_its_detection_and_its_takeover() {
    let made = death();
    let metrics = made.metrics();
    let task = made.task(TOP);
    assert_eq!(
        metrics.failures,
        [Failure {
            at: at(30.0),
            robot: GOLD,
            loss: Loss::Died,
            returned_at: None,
            orphan: Some(OrphanedTask {
                task,
                // Last received at 28.5 s, and τ = 5 s.
                detection: Some(Detection {
                    at: at(33.5),
                    robot: GREEN,
                    sign: DetectionSign::Silence,
                }),
                aftermath: OrphanOutcome::TakenOver {
                    at: at(45.0),
                    by: BLUE,
                },
            }),
        }]
    );
    let takeover = Takeover {
        at: at(45.0),
        task,
        from: GOLD,
        robot: BLUE,
        idle_since: at(30.0),
        cause: TakeoverCause::Lost(Loss::Died),
    };
    assert_eq!(takeover.latency(), at(15.0));
    assert_eq!(metrics.takeovers, [takeover]);
}

#[test]
fn a_task_is_orphaned_unless_a_robot_is_productive_on_it() {
    let made = death();
    let metrics = made.metrics();
    let top = &metrics.tasks[made.task(TOP).index()];
    assert_eq!(top.applicable, spans([(0.0, 60.0)]));
    // Gold was productive from 10 to 20 s, blue from 45 to 55 s.
    assert_eq!(top.orphan, spans([(0.0, 10.0), (20.0, 45.0), (55.0, 60.0)]));
    assert_eq!(top.unattended, spans([(0.0, 10.0), (30.0, 45.0)]));
    assert_eq!(top.duplicate, Some(Spans::default()));
    let bottom = &metrics.tasks[made.task(BOTTOM).index()];
    assert_eq!(bottom.orphan, spans([(0.0, 60.0)]));
    assert_eq!(bottom.unattended, bottom.orphan);
    // Never applicable to any robot.
    let report = &metrics.tasks[made.task(REPORT).index()];
    let none = Spans::default();
    assert_eq!((&report.applicable, &report.orphan), (&none, &none));
}

#[test]
fn stints_with_their_effects_and_ends() {
    let stints = death().metrics().stints;
    let facts: Vec<_> = stints
        .iter()
        .map(|stint| (stint.robot, stint.effects.clone(), stint.end.clone()))
        .collect();
    assert_eq!(
        facts,
        [
            (GOLD, vec![at(20.0)], StintEnd::Absent),
            (BLUE, vec![at(55.0)], StintEnd::Ongoing),
        ]
    );
}

/// Gold is stopped at 30 s during its stint and continues at `back`.
fn stop(back: f64) -> Made {
    let mut made = Made::run(60.0);
    made.during("blue", 0.0, 60.0, None);
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.during("gold", back, 60.0, Some(TOP));
    made.claim(29.5, "blue", "gold", TOP);
    made.event(30.0, "stalled", "gold", ["", "", ""]);
    made.event(back, "back", "gold", ["", "", ""]);
    made
}

#[test]
fn a_stopped_robot_that_comes_back() {
    for (back, detected) in [(40.0, Some(34.5)), (34.5, None), (33.0, None)] {
        let metrics = stop(back).metrics();
        let [failure] = metrics.failures.as_slice() else {
            panic!("{:?}", metrics.failures)
        };
        assert_eq!(
            (failure.loss, failure.returned_at),
            (Loss::Stopped, Some(at(back)))
        );
        let orphan = failure.orphan.as_ref().unwrap();
        assert_eq!(orphan.aftermath, OrphanOutcome::Resumed { at: at(back) });
        assert_eq!(orphan.detection.map(|found| found.at), detected.map(at));
        assert_eq!(metrics.takeovers, []);
        assert_eq!(metrics.robots[GOLD].present, at(20.0 + 60.0 - back));
    }
}

#[test]
fn a_stand_in_for_a_stopped_robot_takes_over_and_gives_back() {
    let mut made = Made::run(60.0);
    made.during("blue", 10.0, 30.0, Some(TOP));
    made.during("blue", 50.0, 60.0, Some(TOP));
    made.during("gold", 0.0, 40.0, None);
    made.during("gold", 40.0, 51.0, Some(TOP));
    made.event(30.0, "stalled", "blue", ["", "", ""]);
    made.event(50.0, "back", "blue", ["", "", ""]);
    made.event(51.0, "waiting", "gold", [TOP, "arbitration", TOP]);
    let metrics = made.metrics();
    let facts: Vec<_> = metrics
        .takeovers
        .iter()
        .map(|takeover| (takeover.at, takeover.robot, takeover.latency()))
        .collect();
    assert_eq!(facts, [(at(40.0), GOLD, at(10.0))]);
    let top = &metrics.tasks[made.task(TOP).index()];
    assert_eq!(top.duplicate, Some(spans([(50.0, 51.0)])));
}

#[test]
fn a_claim_that_is_withdrawn_takes_nothing_over() {
    // Gold claims blue's task and yields; later blue yields to green.
    let mut made = Made::run(60.0);
    made.during("blue", 10.0, 40.0, Some(TOP));
    made.during("gold", 0.0, 20.0, None);
    made.during("gold", 20.0, 21.0, Some(TOP));
    made.during("green", 0.0, 45.0, None);
    made.during("green", 45.0, 60.0, Some(TOP));
    made.event(21.0, "waiting", "gold", [TOP, "arbitration", TOP]);
    made.event(40.0, "hibernated", "blue", [TOP, "acquiesced-psi", TOP]);
    let takeovers = made.metrics().takeovers;
    let facts: Vec<_> = takeovers
        .iter()
        .map(|takeover| (takeover.from, takeover.robot, takeover.latency()))
        .collect();
    assert_eq!(facts, [(BLUE, GREEN, at(35.0))]);
}

/// Green bids for a task for one step, gold executes it and dies, and green bids again. Then blue takes over for good.
#[test]
fn a_claim_of_one_step_is_no_takeover_and_the_lost_robot_is_the_predecessor() {
    let mut made = Made::run(60.0);
    made.during("green", 5.0, 5.5, Some(TOP));
    made.during("green", 5.5, 33.0, None);
    made.during("green", 33.0, 33.5, Some(TOP));
    made.during("green", 33.5, 60.0, None);
    made.during("gold", 0.0, 10.0, None);
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.during("blue", 0.0, 45.0, None);
    made.during("blue", 45.0, 60.0, Some(TOP));
    made.event(5.5, "hibernated", "green", [TOP, "outbid", TOP]);
    made.event(30.0, "gone", "gold", ["", "", ""]);
    made.event(33.5, "hibernated", "green", [TOP, "outbid", TOP]);
    let metrics = made.metrics();
    let task = made.task(TOP);
    let takeover = Takeover {
        at: at(45.0),
        task,
        from: GOLD,
        robot: BLUE,
        idle_since: at(30.0),
        cause: TakeoverCause::Lost(Loss::Died),
    };
    assert_eq!(metrics.takeovers, [takeover]);
    let orphan = metrics.failures[0].orphan.as_ref().unwrap();
    assert_eq!(
        orphan.aftermath,
        OrphanOutcome::TakenOver {
            at: at(45.0),
            by: BLUE
        }
    );
    // The facts, the losses and the takeovers of the page have the same number.
    let page = made.page();
    for text in [
        "mean 15.00 s, longest 15.00 s (of 1)",
        "blue took over after 15.00 s",
        "<td>15.00 s</td><td class=\"text\">gold died</td>",
    ] {
        assert!(page.contains(text), "no '{text}' in {page}");
    }
}

/// A teammate that shared the task left it before the loss: the lost robot executed it last.
#[test]
fn the_robot_that_executed_the_task_last_is_the_predecessor() {
    let mut made = Made::run(60.0);
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.during("blue", 0.0, 15.0, None);
    made.during("blue", 15.0, 20.0, Some(TOP));
    made.during("blue", 20.0, 60.0, None);
    made.during("green", 0.0, 40.0, None);
    made.during("green", 40.0, 60.0, Some(TOP));
    made.event(20.0, "hibernated", "blue", [TOP, "acquiesced-psi", TOP]);
    made.event(30.0, "gone", "gold", ["", "", ""]);
    let metrics = made.metrics();
    let facts: Vec<_> = metrics
        .takeovers
        .iter()
        .map(|takeover| (takeover.from, takeover.robot, takeover.cause.clone()))
        .collect();
    assert_eq!(
        facts,
        [
            (GOLD, BLUE, TakeoverCause::StillActive),
            (GOLD, GREEN, TakeoverCause::Lost(Loss::Died))
        ]
    );
}

/// A task for two robots has no takeovers; its loss names the next robot all the same.
#[test]
fn a_shared_task_is_continued_without_a_takeover() {
    let mut made = Made::with(60.0, |scenario| {
        let section = TaskSection {
            max_robots: Some(2),
            ..TaskSection::default()
        };
        scenario.tasks.insert(TOP.to_owned(), section);
    });
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.during("blue", 0.0, 45.0, None);
    made.during("blue", 45.0, 60.0, Some(TOP));
    made.event(30.0, "gone", "gold", ["", "", ""]);
    let metrics = made.metrics();
    assert_eq!(metrics.takeovers, []);
    let orphan = metrics.failures[0].orphan.as_ref().unwrap();
    assert_eq!(
        orphan.aftermath,
        OrphanOutcome::Continued {
            at: at(45.0),
            by: BLUE
        }
    );
}

#[test]
fn a_robot_lost_without_a_task_leaves_no_orphan() {
    let mut made = Made::run(20.0);
    made.during("blue", 0.0, 20.0, None);
    made.during("gold", 0.0, 10.0, None);
    made.event(10.0, "gone", "gold", ["", "", ""]);
    assert_eq!(made.metrics().failures[0].orphan, None);
}

#[test]
fn impatience_and_activation_are_signs_too() {
    // Blue's impatience rises at 32 s, before τ has passed.
    let mut made = Made::run(60.0);
    made.rows("blue", 0.0, 32.0, |row| row.impatience = 0.1);
    made.during("blue", 32.0, 60.0, None);
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.claim(29.5, "blue", "gold", TOP);
    made.event(30.0, "gone", "gold", ["", "", ""]);
    let detection = |made: &Made| {
        let orphan = made.metrics().failures[0].orphan.clone();
        orphan
            .unwrap()
            .detection
            .map(|found| (found.at, found.sign))
    };
    assert_eq!(
        detection(&made),
        Some((at(32.0), DetectionSign::Impatience))
    );

    // Green has received nothing from gold, and its own turn was due.
    made.during("green", 0.0, 31.0, None);
    made.during("green", 31.0, 60.0, Some(TOP));
    assert_eq!(
        detection(&made),
        Some((at(31.0), DetectionSign::Activation))
    );
}

#[test]
fn a_shared_task_is_covered_and_an_abandoned_one_is_not() {
    let mut made = Made::run(60.0);
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.event(30.0, "gone", "gold", ["", "", ""]);
    let aftermath = |made: &Made| made.metrics().failures[0].orphan.clone().unwrap().aftermath;
    assert_eq!(aftermath(&made), OrphanOutcome::Abandoned);
    made.during("blue", 20.0, 40.0, Some(TOP));
    assert_eq!(aftermath(&made), OrphanOutcome::Covered { by: BLUE });
}

/// Blue executes the upper spill's task from 10 s, delivers last before 30 s and leaves at 50 s for `reason`. Gold
/// activates it at 52 s.
fn handover(reason: &str) -> Made {
    let mut made = Made::run(60.0);
    made.during("blue", 0.0, 10.0, None);
    made.during("blue", 10.0, 50.0, Some(TOP));
    made.during("blue", 50.0, 60.0, None);
    made.during("gold", 0.0, 52.0, None);
    made.during("gold", 52.0, 60.0, Some(TOP));
    made.event(29.5, "delivered", "blue", ["item-1", "", ""]);
    made.event(50.0, "hibernated", "blue", [TOP, reason, TOP]);
    made
}

#[test]
fn a_handover_counts_from_the_latest_effect() {
    for reason in ["acquiesced-psi", "gave-up-lambda", "reset-by gold"] {
        let made = handover(reason);
        assert_eq!(
            made.metrics().takeovers,
            [Takeover {
                at: at(52.0),
                task: made.task(TOP),
                from: BLUE,
                robot: GOLD,
                idle_since: at(30.0),
                cause: TakeoverCause::Left(reason.to_owned()),
            }]
        );
    }
    assert_eq!(handover("not-applicable").metrics().takeovers, []);
}

/// Two robots execute one task from 15 to 20 s.
fn both(max_robots: u32) -> Made {
    let mut made = Made::with(30.0, |scenario| {
        let section = TaskSection {
            max_robots: Some(max_robots),
            ..TaskSection::default()
        };
        scenario.tasks.insert(TOP.to_owned(), section);
    });
    made.during("blue", 10.0, 20.0, Some(TOP));
    made.during("gold", 0.0, 15.0, None);
    made.during("gold", 15.0, 25.0, Some(TOP));
    made.event(11.5, "delivered", "blue", ["item-1", "", ""]);
    made.event(17.5, "delivered", "blue", ["item-2", "", ""]);
    made.event(20.0, "hibernated", "blue", [TOP, "acquiesced-psi", TOP]);
    made
}

#[test]
fn two_robots_on_an_exclusive_task_count_as_duplicate() {
    let made = both(1);
    let metrics = made.metrics();
    let top = &metrics.tasks[made.task(TOP).index()];
    assert_eq!(top.duplicate, Some(spans([(15.0, 20.0)])));
    let takeover = &metrics.takeovers[0];
    assert_eq!(takeover.cause, TakeoverCause::StillActive);
    // Only blue's first delivery came before gold's activation.
    assert_eq!(takeover.latency(), at(3.0));

    let made = both(2);
    let metrics = made.metrics();
    assert_eq!(metrics.tasks[made.task(TOP).index()].duplicate, None);
    assert_eq!(metrics.takeovers, []);
}

#[test]
fn shares_and_rates_count_the_time_in_which_a_robot_took_part() {
    let mut made = death();
    let figures = RobotFigures {
        messages_sent: 60,
        bytes_sent: 6_000,
        ..RobotFigures::default()
    };
    made.figures.robots.insert("gold".to_owned(), figures);
    let metrics = made.metrics();
    let gold = &metrics.robots[GOLD];
    assert_eq!((gold.present, gold.idle), (at(30.0), at(10.0)));
    assert_eq!(gold.idle_share(), 1.0 / 3.0);
    assert_eq!(gold.activations_per_min(), 2.0);
    let sent = SentTotals {
        messages: 60,
        bytes: 6_000,
    };
    assert_eq!(gold.sent, Some(sent));
    assert_eq!(sent.per_s(gold.present), (2.0, 200.0));
    assert_eq!(metrics.robots[GREEN].idle_share(), 1.0);
    assert_eq!(metrics.makespan, Some(at(60.0)));

    // A killed run has no record of its sent messages.
    made.outcome = RunOutcome::Running;
    let metrics = made.metrics();
    assert_eq!((metrics.robots[GOLD].sent, metrics.makespan), (None, None));
    made.outcome = RunOutcome::Ended(Outcome::TimeLimit);
    assert_eq!(made.metrics().makespan, None);
}

#[test]
fn lateness_of_reports() {
    let mut made = Made::run(600.0);
    for (seconds, robot) in [(130.0, "green"), (200.0, "gold"), (400.0, "green")] {
        made.event(seconds, "reported", robot, ["", "", ""]);
    }
    let metrics = made.metrics();
    let [reports] = metrics.recurring.as_slice() else {
        panic!("{:?}", metrics.recurring)
    };
    let made = |seconds, by, interval, late| Occurrence {
        at: at(seconds),
        by: Some(by),
        interval: at(interval),
        late: at(late),
    };
    assert_eq!(
        reports.moments,
        [
            made(130.0, GREEN, 130.0, 10.0),
            made(200.0, GOLD, 70.0, 0.0),
            made(400.0, GREEN, 200.0, 80.0),
        ]
    );
    // The next report was due at 520 s.
    assert_eq!(reports.overdue, at(80.0));
}

#[test]
fn only_reductions_of_motivation_count_as_resets() {
    let mut made = Made::run(10.0);
    made.rows("blue", 0.0, 1.0, |row| row.motivation = 5.0);
    for (from, level) in [(1.0, 0.0), (1.5, 0.0)] {
        made.rows("blue", from, from + 0.5, |row| {
            row.impatience_reset = false;
            row.motivation = level;
        });
    }
    let sets = &made.history.robots[BLUE].sets;
    for set in sets {
        let resets: Vec<SimTime> = set.resets.iter().map(|reset| reset.at).collect();
        assert_eq!(resets, [at(1.0)], "{}", set.name);
        assert_eq!(set.levels.len(), 4);
    }
}

/// Runs a setup in this process and returns its history and run.json.
pub fn run_of(setup: Setup) -> (History, RunFile) {
    let team = Team::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
    let (_, recorder) = team.run().unwrap();
    let log =
        RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary()).unwrap();
    (History::read(&log).unwrap(), log.run)
}

/// Runs a setup in this process and returns its history.
pub fn history_of(setup: Setup) -> History {
    run_of(setup).0
}

#[test]
fn each_reset_names_its_sender() {
    let text = include_str!("../../../missions/src/waste/scenarios/thesis-no-interruption.toml");
    let scenario = Scenario::parse(
        "thesis-no-interruption",
        text,
        &Registry::built_in().vocabulary(),
    )
    .unwrap();
    let history = history_of(Setup::resolve(scenario, 1, None).unwrap().setup);
    let mut count = 0;
    for (rank, robot) in history.robots.iter().enumerate() {
        for reset in robot.sets.iter().flat_map(|set| &set.resets) {
            assert!(!reset.by.is_empty(), "{} at {}", robot.name, reset.at);
            assert!(!reset.by.contains(&rank), "{} at {}", robot.name, reset.at);
            count += 1;
        }
    }
    assert!(count > 10, "{count} resets");
}

#[test]
fn a_robot_alone_and_a_run_without_a_tick() {
    let alone = |scenario: &mut Scenario| {
        scenario.robots = vec![Robot {
            name: "solo".to_owned(),
            ..Robot::default()
        }];
    };
    let mut made = Made::with(60.0, alone);
    made.during("solo", 0.0, 30.0, Some(TOP));
    made.event(30.0, "gone", "solo", ["", "", ""]);
    let orphan = made.metrics().failures[0].orphan.clone().unwrap();
    assert_eq!(
        (orphan.detection, orphan.aftermath),
        (None, OrphanOutcome::Abandoned)
    );

    let metrics = Made::with(0.0, alone).metrics();
    assert_eq!(metrics.robots[0].idle_share(), 0.0);
    assert_eq!(metrics.robots[0].activations_per_min(), 0.0);
    assert_eq!(metrics.stints.len(), 0);
    assert_eq!(metrics.recurring[0].overdue, SimTime::ZERO);
}

#[test]
fn rows_of_another_run_are_refused() {
    let mut history = Made::run(10.0).history;
    let row = MotivationRow {
        t_ms: SimTime(0),
        robot: "red".to_owned(),
        behavior_set: TOP.to_owned(),
        task: TOP.to_owned(),
        motivation: 0.0,
        impatience: 1.0,
        sensory_feedback: true,
        activity_suppression: true,
        impatience_reset: true,
        acquiescence: true,
        state: "hibernating".to_owned(),
    };
    let error = history.add_motivation(&row).unwrap_err();
    assert_eq!(
        error.to_string(),
        "motivations.csv has a row about 'red', which is not in run.json"
    );
    let row = AllocationRow {
        t_ms: SimTime(0),
        robot: "blue".to_owned(),
        task: TOP.to_owned(),
        behavior_set: "sing".to_owned(),
        utility: 0.5,
        holder: String::new(),
        state: "hibernating".to_owned(),
    };
    let error = history.add_utility(&row).unwrap_err();
    assert_eq!(
        error.to_string(),
        "allocation.csv has a row about 'sing', which is not in run.json"
    );
}

/// Blue has two behavior sets that find the locations, with different utilities.
#[test]
fn each_behavior_set_has_its_own_utilities() {
    let mut history = Made::run(10.0).history;
    for (t_ms, behavior_set, utility) in [
        (0, "find-locations-methodical", 0.5),
        (0, "find-locations-wander", 0.25),
        (50, "find-locations-wander", 1.0),
    ] {
        let row = AllocationRow {
            t_ms: SimTime(t_ms),
            robot: "blue".to_owned(),
            task: "find-locations".to_owned(),
            behavior_set: behavior_set.to_owned(),
            utility,
            holder: String::new(),
            state: "hibernating".to_owned(),
        };
        history.add_utility(&row).unwrap();
    }
    let levels = |name: &str| {
        let mut sets = history.robots[0].sets.iter();
        sets.find(|set| set.name == name).unwrap().levels.clone()
    };
    assert_eq!(levels("find-locations-methodical"), [(SimTime(0), 0.5)]);
    let wander = [(SimTime(0), 0.25), (SimTime(50), 1.0)];
    assert_eq!(levels("find-locations-wander"), wander);
}

/// Reports a mission that this program does not contain, with a map, figures and tables.
#[test]
fn the_report_of_an_external_mission_shows_its_marks_columns_and_events() {
    let mut run = visit::run_file();
    run.result.mission.add("places_visited", 3_u32);
    let tables = [(Table::Mission, visit::TABLE.as_bytes().to_vec())];
    let log = RunLog::from_tables(Path::new(""), run, tables.into());
    let mut made = Made::run(60.0);
    made.history.catalog = Arc::clone(&log.run.setup.catalog);
    made.history.mission = log.rows().unwrap();
    made.history.marks = visit::marks().to_vec();
    for robot in ["blue", "gold", "green"] {
        made.history.add_pose(&pose(robot)).unwrap();
    }
    for (seconds, robot) in [(10.0, "blue"), (20.0, "gold")] {
        made.event(seconds, "visited", robot, ["", "", ""]);
    }
    let metrics = Metrics::compute(&made.history, &log.run);
    let [visits] = metrics.recurring.as_slice() else {
        panic!("{:?}", metrics.recurring)
    };
    assert_eq!((visits.event, visits.moments.len()), ("visited", 2));
    // The next visit is due after 15 s.
    assert_eq!(visits.overdue, at(25.0));

    let figures = figures(&made.history, &metrics, &FigureSelection::default()).unwrap();
    let svg = |name: &str| {
        &figures
            .iter()
            .find(|figure| figure.name == name)
            .expect(name)
            .svg
    };
    for label in ["place", "home", "box", "rope"] {
        assert!(svg("map").contains(&format!("{label}\n")), "{label}");
    }
    for label in ["places left", "places visited"] {
        assert!(svg("mission").contains(label), "{label}");
    }
    assert!(svg("mission-way-m").contains("way m"));
    assert!(svg("every-visited").contains("gold: in time"));
    let (page, _) = page(&RunSection {
        run: &log.run,
        history: &made.history,
        metrics: &metrics,
        figures,
        made: MadeHow::default(),
    });
    for text in [
        "3 of 5 places visited",
        "Events: visited",
        "Wanted period: 15 s",
    ] {
        assert!(page.contains(text), "{text}");
    }
}

fn pose(robot: &str) -> PoseRow {
    PoseRow {
        t_ms: SimTime::ZERO,
        robot: robot.to_owned(),
        x_m: 1.0,
        y_m: 1.0,
        heading_rad: 0.0,
        speed_m_s: 0.0,
        carrying: false,
        behavior_set: String::new(),
        energy: None,
    }
}

#[test]
fn utilities_are_drawn_where_there_are_no_motivations() {
    let scenario = Scenario {
        allocator: Some("nearest".to_owned()),
        limit_s: 60.0,
        ..default_scenario()
    };
    let (history, run) = run_of(Setup::resolve(scenario, 1, None).unwrap().setup);
    let whole = Span {
        from: SimTime::ZERO,
        to: history.end,
    };
    for robot in &history.robots {
        assert_eq!(robot.measure, LevelUnit::Utility);
        assert_eq!(robot.present.iter().collect::<Vec<_>>(), [whole]);
        assert!(robot.sets.iter().any(|set| !set.levels.is_empty()));
        let active = robot.active();
        assert!(active.total() > at(30.0), "{}: {active:?}", robot.name);
    }
    // The events show the same activations.
    let set = |robot: &str, name: &str| {
        let robot = &history.robots[history.rank(robot).unwrap()];
        robot.sets.iter().find(|set| set.name == name).unwrap()
    };
    for event in history.events_of("activated") {
        let begins = set(&event.robot, &event.subject)
            .active
            .contains(event.t_ms);
        assert!(begins, "{event:?}");
    }
    let metrics = Metrics::compute(&history, &run);
    let figures = figures(&history, &metrics, &FigureSelection::default()).unwrap();
    let blue = figures
        .iter()
        .find(|figure| figure.name == "robot-blue")
        .unwrap();
    assert!(blue.caption.starts_with("Utility of"), "{}", blue.caption);
    assert!(blue.svg.contains("utility u") && !blue.svg.contains("threshold"));
}

/// Runs a shipped scenario up to `limit_s` and returns its metrics.
fn shipped(scenario: &str, limit_s: f64) -> Metrics {
    let vocabulary = Registry::built_in().vocabulary();
    let text = vocabulary.builtin(scenario).unwrap().text;
    let mut scenario = Scenario::parse(scenario, text, &vocabulary).unwrap();
    scenario.limit_s = limit_s;
    scenario.faults.timeline.clear();
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    let team = Team::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
    let (_, recorder) = team.run().unwrap();
    let log = RunLog::from_memory(&recorder.into_sink(), &vocabulary).unwrap();
    Metrics::compute(&History::read(&log).unwrap(), &log.run)
}

#[test]
fn a_push_stroke_is_an_effect_and_observation_is_a_continuous_one() {
    let push = shipped("parker-box", 30.0);
    assert!(push.stints.len() > 8, "{:?}", push.stints);
    let ended = push
        .stints
        .iter()
        .filter(|stint| stint.end != StintEnd::Ongoing);
    for stint in ended {
        assert_eq!(stint.effects, [stint.span.to], "{stint:?}");
    }
    for task in &push.tasks {
        assert!(task.applicable.total() > task.orphan.total());
    }
    let observe = shipped("cmommt", 30.0);
    for task in &observe.tasks {
        assert_eq!(task.orphan, task.unattended);
        assert!(task.applicable.total() > task.orphan.total());
    }
}
