//! A controller that broadcasts anything that the message types allow. No other robot is silenced by it, and a replay
//! is identical.

use std::sync::Arc;

use alliance_tests::harness::Lab;
use alliance_tests::lies;
use alliance_tests::runs::{self, Events, allocators, log_of, vocabulary};
use analysis::replay::replay;
use in_process::{AnswerError, AnswerSource, Team, joins_of};
use proto::mission::{Payload, SharedKnowledge};
use proto::team::{
    Broadcast, BroadcastContent, Bulletin, BulletinKind, BulletinSubject, Heartbeat, TaskState,
};
use proto::tick::{Outcome, Report, TickMessage};
use run_log::{Input, LogLevel, MemoryLog, RunLog, RunOutcome};
use scenario::Setup;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

const LIAR: RobotId = RobotId(1);

/// A controller with given lies.
struct Liar(Vec<Broadcast>);

impl AnswerSource for Liar {
    fn answer(
        &mut self,
        robot: RobotId,
        message: &TickMessage,
        _: &[Option<Arc<Broadcast>>],
        report: &mut Report,
        broadcasts: &mut Vec<Broadcast>,
    ) -> Result<(), AnswerError> {
        (*report, *broadcasts) = lies::answer(&self.0, robot, message);
        Ok(())
    }
}

/// Returns a small mission, or the default one, in which the controller of gold lies for the whole run.
fn setup(mission: usize, allocator: usize, limit_s: f64) -> Setup {
    let missions = vocabulary().missions;
    let mission = missions.iter().cycle().nth(mission).unwrap();
    let mut scenario = mission.family(3, 2).unwrap();
    let allocators: Vec<&str> = allocators().collect();
    scenario.allocator = Some(allocators[allocator % allocators.len()].to_owned());
    scenario.limit_s = limit_s;
    scenario.robots[LIAR.index()].controller = Some("liar".to_owned());
    runs::setup(scenario, 1)
}

/// Runs the setup with the lies. Checks that no other robot leaves the run and that a replay is identical.
#[track_caller]
fn run(setup: Setup, lies: Vec<Broadcast>) -> (Outcome, RunLog) {
    let inputs = joins_of(&setup);
    let name = setup.scenario.robots[LIAR.index()].name.clone();
    let source = Some(Box::new(Liar(lies)) as Box<dyn AnswerSource>);
    let memory = MemoryLog::default();
    let team = Team::with_answer_source(setup, inputs, LogLevel::Full, memory, source).unwrap();
    let (outcome, recorder) = team.run().unwrap();
    let hash = recorder.hash();
    let log = log_of(recorder);
    assert_only_the_liar_leaves(&log, &name);
    let (_, again) = replay(&log, LogLevel::Full, |_| {}).unwrap();
    assert_eq!(again.run.hash, Some(hash));
    (outcome, log)
}

#[track_caller]
fn assert_only_the_liar_leaves(log: &RunLog, liar: &str) {
    for line in log.inputs().unwrap() {
        let is_usual = matches!(line.input, Input::Join { .. });
        let is_of_liar = line.input.robot() == Some(liar);
        assert!(is_usual || is_of_liar, "{line:?}");
    }
}

/// Runs a team of processes in which gold is the program `liar`, and replays each run.
fn run_processes(seeds: std::ops::Range<u64>) {
    let lab = Lab::new();
    for seed in seeds {
        let scenario = setup(seed as usize, seed as usize / 4, 15.0).scenario;
        let liar = scenario.robots[LIAR.index()].name.clone();
        let (file, out) = (format!("{seed}.toml"), format!("run {seed}"));
        lab.write(&file, scenario.to_toml().unwrap());
        let controller = format!("liar={} {seed}", env!("CARGO_BIN_EXE_liar"));
        let finished = lab.mission(&out, ["--controller", &controller, &file]);
        let log = lab.log(&out);
        let has_ended = matches!(
            log.run.outcome,
            RunOutcome::Ended(Outcome::Complete | Outcome::TimeLimit)
        );
        assert!(has_ended, "seed {seed}: {finished:?}");
        assert_only_the_liar_leaves(&log, &liar);
        let joins = log.events_of(&liar, "joined");
        assert!(!joins.is_empty(), "seed {seed}: the liar did not join");
        lab.assert_repeated(&out);
        std::fs::remove_dir_all(lab.path(&out)).unwrap();
    }
}

#[test]
fn a_lying_process_silences_no_other() {
    run_processes(0..4);
}

/// Some reports of gold list a broadcast that is never sent, and some precede their broadcasts.
#[test]
fn a_report_of_other_broadcasts_silences_no_other() {
    let lab = Lab::new();
    // The default mission with ALLIANCE.
    let scenario = setup(0, 0, 15.0).scenario;
    lab.write("15s.toml", scenario.to_toml().unwrap());
    let controller = format!("liar={} reports", env!("CARGO_BIN_EXE_liar"));
    let finished = lab.mission("run", ["--controller", &controller, "15s.toml"]);
    finished.expect(1);
    let log = lab.log("run");
    assert_only_the_liar_leaves(&log, "gold");
    assert!(log.times_of("gold", "gone").is_empty());
    lab.assert_repeated("run");
}

/// `cargo test -p alliance-tests --test missions -- --ignored two_hundred_lying_processes`
#[test]
#[ignore = "takes many minutes; `a_lying_process_silences_no_other` is its short form"]
fn two_hundred_lying_processes_silence_no_other() {
    run_processes(0..200);
}

#[test]
fn no_content_silences_a_receiver() {
    for seed in 0..40 {
        let setup = setup(seed as usize, seed as usize, 30.0);
        let (outcome, log) = run(setup, lies::lies(seed));
        let is_over = outcome == Outcome::TimeLimit && log.run.result.ticks == 600;
        let has_ended = outcome == Outcome::Complete || is_over;
        assert!(has_ended, "{seed}: {outcome:?}");
    }
}

/// The sender of a behavior set or task that does not exist is dismissed, and the others complete the mission.
#[test]
fn a_sender_of_unknown_numbers_is_dismissed_and_the_others_complete() {
    let honest = Heartbeat {
        state: TaskState::Executing,
        since: SimTime::ZERO,
        set: Some(BehaviorId(0)),
        task: Some(TaskId(0)),
        progress: 0,
        position: None,
        carrying: false,
        shared_knowledge: SharedKnowledge::Nothing,
    };
    let heartbeat = |set, task| {
        BroadcastContent::Heartbeat(Heartbeat {
            set: Some(BehaviorId(set)),
            task: Some(TaskId(task)),
            ..honest.clone()
        })
    };
    let about = BroadcastContent::Bulletin(Bulletin {
        kind: BulletinKind::First,
        about: Some(BulletinSubject {
            task: TaskId(7),
            set: BehaviorId(u32::MAX),
            progress: 0,
        }),
        payload: Payload::Open(Vec::new()),
    });
    for body in [heartbeat(999, 0), heartbeat(0, 999), about] {
        let broadcast = |seq, body| Broadcast {
            sender: LIAR,
            incarnation: 1,
            tick: 0,
            index: 0,
            seq,
            sent: SimTime::ZERO,
            body,
        };
        let honest = (0..100).map(|seq| broadcast(seq, heartbeat(0, 0)));
        let lies = honest.chain([broadcast(100, body)]).collect();
        // The default mission with ALLIANCE.
        let (outcome, log) = run(setup(0, 0, 3600.0), lies);
        assert_eq!(outcome, Outcome::Complete);
        // Two broadcasts a tick: the 101st is in tick 50, at 2.5 s.
        assert_eq!(log.events("gone").len(), 1);
        assert_eq!(log.times_of("gold", "gone"), [2500]);
    }
}
