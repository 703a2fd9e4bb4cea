//! A run in one process writes the same bytes as a run by processes.

use std::collections::BTreeSet;

use in_process::{BodyCommand, Team, Workspaces};
use missions::waste::data::default_scenario;
use proto::tick::Outcome;
use run_log::recorder::Recorder;
use run_log::{
    AllocationMessageRow, Document, EventRow, LogLevel, MemoryLog, MessageRow, RunLog, Table,
};
use scenario::ids::RobotId;
use scenario::{Scenario, Setup, StepOrder};

use crate::harness::Lab;

/// Returns the default mission as `alliance run --seed … --limit … --step-order …` resolves it.
pub fn setup(seed: u64, limit_s: f64, order: StepOrder) -> Setup {
    let mut scenario = Scenario {
        limit_s,
        ..default_scenario()
    };
    scenario.step_order = Some(order);
    Setup::resolve(scenario, seed, None).unwrap().setup
}

pub fn run(setup: Setup, log: LogLevel) -> (Outcome, Recorder<MemoryLog>) {
    Team::new(setup, log, MemoryLog::default())
        .unwrap()
        .run()
        .unwrap()
}

#[test]
fn teams_can_alternate_share_workspaces_and_return_events_without_a_log() {
    let setups = [3, 4].map(|seed| setup(seed, 60.0, StepOrder::Simultaneous));
    let mut spaces = Workspaces::default();
    let mut teams = setups
        .clone()
        .map(|setup| Team::new(setup, LogLevel::Off, MemoryLog::default()).unwrap());
    let mut events = [Vec::new(), Vec::new()];
    for team in &mut teams {
        assert!(team.take_events().is_empty());
    }
    let outcome = loop {
        let mut outcomes = [None, None];
        for (at, team) in teams.iter_mut().enumerate() {
            team.swap_workspaces(&mut spaces);
            outcomes[at] = team.tick().unwrap();
            team.swap_workspaces(&mut spaces);
            events[at].extend(team.take_events());
        }
        assert_eq!(outcomes[0], outcomes[1]);
        if let Some(outcome) = outcomes[0] {
            break outcome;
        }
    };
    for ((setup, team), events) in setups.into_iter().zip(teams).zip(events) {
        let (_, alone) = run(setup, LogLevel::Full);
        let (ended, _) = team.end(outcome).unwrap();
        assert_eq!(ended.hash, Some(alone.hash()));
        let log = RunLog::from_memory(
            &alone.into_sink(),
            &missions::Registry::built_in().vocabulary(),
        )
        .unwrap();
        let logged: Vec<_> = log
            .rows::<EventRow>()
            .unwrap()
            .into_iter()
            .map(|row| {
                (
                    row.t_ms,
                    row.kind,
                    row.robot,
                    row.subject,
                    row.reason,
                    row.detail,
                )
            })
            .collect();
        let returned: Vec<_> = events
            .into_iter()
            .map(|event| {
                (
                    event.t_ms,
                    event.kind,
                    event.robot,
                    event.subject,
                    event.reason,
                    event.detail,
                )
            })
            .collect();
        assert!(logged.len() > 10);
        assert_eq!(returned, logged);
    }
}

#[test]
fn one_process_and_many_write_the_same_bytes() {
    // The programs write their build to run.json.
    proto::program_build::set(launch::BUILD);
    let lab = Lab::new();
    for order in [StepOrder::Simultaneous, StepOrder::InOrder] {
        for seed in 1..=3 {
            let out = format!("{}-{seed}", order.as_str());
            let (seed_text, order_text) = (seed.to_string(), order.as_str());
            let arguments = [
                "--limit",
                "100",
                "--seed",
                &seed_text,
                "--step-order",
                order_text,
            ];
            lab.mission(&out, &arguments).expect(1);

            let (outcome, recorder) = run(setup(seed, 100.0, order), LogLevel::Full);
            assert_eq!(outcome, Outcome::TimeLimit);
            assert_eq!(lab.log(&out).run.hash, Some(recorder.hash()), "{out}");
            let memory = recorder.into_sink();
            let read = |file: &str| std::fs::read(lab.path(&out).join(file)).unwrap();
            for table in Table::ALL.into_iter().filter(|table| !table.is_optional()) {
                assert!(
                    read(table.file_name()) == memory.tables[&table],
                    "{} of {out}",
                    table.file_name()
                );
            }
            let run_file = memory.documents[&Document::Run].as_bytes();
            assert!(read("run.json") == run_file, "run.json of {out}");
        }
    }
}

#[test]
fn one_process_and_many_write_the_same_allocation_messages() {
    let lab = Lab::new();
    for allocator in ["ble", "murdoch", "cbba", "acbba", "grape"] {
        lab.mission(allocator, &["--limit", "40", "--allocator", allocator])
            .expect(1);
        let mut setup = setup(1, 40.0, StepOrder::Simultaneous);
        setup.scenario.allocator = Some(allocator.to_owned());
        let (_, recorder) = run(setup, LogLevel::Full);
        let memory = recorder.into_sink();
        let written = &memory.tables[&Table::AllocationMessages];
        let path = lab.path(allocator).join("allocation_messages.csv");
        assert!(&std::fs::read(path).unwrap() == written, "{allocator}");
        let log = lab.log(allocator);
        let rows: Vec<AllocationMessageRow> = log.rows().unwrap();
        let sent: BTreeSet<(String, u64)> = rows
            .iter()
            .map(|row| (row.sender.clone(), row.seq))
            .collect();
        let messages: Vec<MessageRow> = log.rows().unwrap();
        let received = messages.into_iter().filter(|row| row.kind == "allocation");
        let received: BTreeSet<(String, u64)> = received
            .filter_map(|row| Some((row.sender, row.seq?)))
            .collect();
        // The last messages are not received any more.
        assert!(
            !received.is_empty() && received.is_subset(&sent),
            "{allocator}"
        );
        assert!(
            rows.iter()
                .any(|row| row.bid.is_some() || row.stamp.is_some()),
            "{allocator}"
        );
        let replayed = lab.run(&["replay", allocator]).expect(0);
        assert!(
            replayed.answer().starts_with("identical"),
            "{allocator}: {}",
            replayed.stderr
        );
    }
}

#[test]
fn a_driven_body_follows_its_commands_until_its_agent_drives_again() {
    let (robot, turn) = (
        RobotId(1),
        BodyCommand {
            speed_m_s: 0.0,
            turn_rad_s: 0.5,
            action: None,
        },
    );
    let nearest = || {
        let mut setup = setup(1, 60.0, StepOrder::Simultaneous);
        setup.scenario.allocator = Some("nearest".to_owned());
        Team::new(setup, LogLevel::Off, MemoryLog::default()).unwrap()
    };
    let (mut team, mut free) = (nearest(), nearest());
    let step = |team: &mut Team<MemoryLog>, ticks: u64| {
        for _ in 0..ticks {
            team.tick().unwrap();
        }
        team.simulation().world().pose(robot)
    };
    assert_eq!(step(&mut team, 20), step(&mut free, 20));

    let before = team.simulation().world().pose(robot);
    team.drive(robot, Some(turn));
    let turned = step(&mut team, 20);
    assert_eq!(turned.position, before.position);
    let angle = (turned.heading_rad - before.heading_rad).rem_euclid(std::f32::consts::TAU);
    assert!(
        (angle - 0.5).abs() < 1e-4,
        "20 ticks of 50 ms at 0.5 rad/s: {angle}"
    );
    assert_ne!(step(&mut free, 20).position, before.position);

    team.drive(robot, None);
    assert_ne!(step(&mut team, 100).position, before.position);
}
