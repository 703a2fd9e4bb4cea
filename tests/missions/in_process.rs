//! The library of runs in one process. `parity.rs` compares its runs with runs by processes.

use alliance_tests::runs::{self, log_of, run};
use in_process::{BodyCommand, Team, Workspaces};
use missions::waste::data::default_scenario;
use run_log::{EventRow, LogLevel, MemoryLog};
use scenario::ids::RobotId;
use scenario::{Scenario, Setup};

/// Returns the first minute of the default mission.
fn setup(seed: u64) -> Setup {
    let scenario = Scenario {
        limit_s: 60.0,
        ..default_scenario()
    };
    runs::setup(scenario, seed)
}

#[test]
fn teams_can_alternate_share_workspaces_and_return_events_without_a_log() {
    let setups = [3, 4].map(setup);
    let mut spaces = Workspaces::default();
    let mut teams = setups.clone().map(|setup| runs::team(setup, LogLevel::Off));
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
    for ((setup, team), returned) in setups.into_iter().zip(teams).zip(events) {
        let (_, alone) = run(setup, LogLevel::Full);
        let (ended, _) = team.end(outcome).unwrap();
        assert_eq!(ended.hash, Some(alone.hash()));
        let logged = log_of(alone).rows::<EventRow>().unwrap();
        assert!(logged.len() > 10);
        let returned = returned.into_iter().map(|event| EventRow {
            t_ms: event.t_ms,
            kind: event.kind,
            robot: event.robot,
            subject: event.subject,
            reason: event.reason,
            detail: event.detail,
        });
        assert_eq!(returned.collect::<Vec<_>>(), logged);
    }
}

#[test]
fn a_driven_body_follows_its_commands_until_its_agent_drives_again() {
    let robot = RobotId(1);
    let turn = BodyCommand {
        speed_m_s: 0.0,
        turn_rad_s: 0.5,
        action: None,
    };
    let nearest = || {
        let mut setup = setup(1);
        setup.scenario.allocator = Some("nearest".to_owned());
        runs::team(setup, LogLevel::Off)
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
    // 20 ticks of 50 ms at 0.5 rad/s.
    assert!((angle - 0.5).abs() < 1e-4, "{angle}");
    assert_ne!(step(&mut free, 20).position, before.position);

    team.drive(robot, None);
    assert_ne!(step(&mut team, 100).position, before.position);
}
