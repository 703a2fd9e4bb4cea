//! `alliance check`: its forecasts hold, and its output formats.

use alliance_tests::harness::Lab;
use alliance_tests::runs::{log_of, run, setup};
use missions::waste::data::{default_scenario, default_setup};

use analysis::check::Check;
use analysis::check::forecast::Takeover;
use run_log::{EventRow, LogLevel, MessageRow};
use scenario::testkit::entry;
use scenario::{BehaviorSection, Preset, RobotSection, Scenario, Setup, SwitchSection};

const PRESETS: [Preset; 3] = [Preset::Thesis, Preset::Par98, Preset::Team];
const FIND: &str = "find-locations-wander";

/// Returns a setup with two robots that make no progress. The first one activates the task earlier.
fn stuck(preset: Preset, defaults: &BehaviorSection, switches: SwitchSection) -> Setup {
    let mut scenario = Scenario {
        limit_s: 150.0,
        ..default_scenario()
    };
    scenario.body.speed_m_s = 1e-4;
    // Turning while looking along a wall would count as progress.
    scenario.body.turn_deg_s = 1e-3;
    scenario.robots.truncate(2);
    scenario.robots[0].side_sensor = false;
    let alliance = &mut scenario.alliance;
    alliance.preset = preset;
    alliance.switches = switches;
    alliance.defaults = defaults.clone();
    let mut blue = RobotSection::default();
    blue.defaults.fast_impatience = Some(10.0);
    alliance.robots.insert("blue".to_owned(), blue);
    setup(scenario, 1)
}

fn forecast_takeover(setup: &Setup) -> Takeover {
    let forecasts = Check::new(setup, &[]).forecasts;
    let gold = forecasts
        .iter()
        .find(|forecast| forecast.robot == "gold" && forecast.set == FIND);
    gold.unwrap().takeovers[0].clone()
}

/// Returns parameters in which each of φ, ψ, λ and τ determines the takeover once.
fn parameters() -> [BehaviorSection; 4] {
    let section = |phi_s, psi_s, lambda_s| BehaviorSection {
        fast_impatience: Some(5.0),
        slow_impatience: Some(1.0),
        willing_to_affect_s: Some(phi_s),
        before_yielding_s: Some(psi_s),
        before_giving_up_s: Some(lambda_s),
        ..BehaviorSection::default()
    };
    [
        section(30.0, 80.0, 200.0),
        section(30.0, 20.0, 200.0),
        section(300.0, 40.0, 90.0),
        section(300.0, 60.0, 300.0),
    ]
}

/// Checks that a takeover time agrees with its forecast.
///
/// Detection, delivery and rounding may add a few steps. Without release messages, silence begins with the last
/// heartbeat, up to 1/ρ = 1 s before the teammate left.
#[track_caller]
fn assert_agrees(actual_s: f64, forecast_s: f64, setup: &Setup) {
    let step_s = setup.alliance.step_ms as f64 / 1000.0;
    let early_s = if setup.alliance.switches.release_message {
        step_s
    } else {
        1.0
    };
    assert!(
        (forecast_s - early_s..=forecast_s + 4.0 * step_s).contains(&actual_s),
        "{actual_s} instead of {forecast_s} s with {:#?}",
        setup.alliance
    );
}

#[test]
fn a_failing_teammate_is_taken_over_at_the_forecast_time() {
    let no_release = SwitchSection {
        release_message: Some(false),
        ..SwitchSection::default()
    };
    for preset in PRESETS {
        for defaults in parameters() {
            for switches in [SwitchSection::default(), no_release] {
                let setup = stuck(preset, &defaults, switches);
                let log = log_of(run(setup.clone(), LogLevel::Full).1);
                let messages: Vec<MessageRow> = log.rows().unwrap();
                let first_heartbeat = messages
                    .iter()
                    .find(|row| row.receiver == "gold" && row.state == "executing")
                    .unwrap();
                let events: Vec<EventRow> = log.rows().unwrap();
                let taken_over = events
                    .iter()
                    .find(|row| row.kind == "activated" && row.robot == "gold")
                    .unwrap();
                let took_s = (taken_over.t_ms - first_heartbeat.t_ms).as_secs_f64();
                assert_agrees(took_s, forecast_takeover(&setup).failing_s, &setup);
            }
        }
    }
}

/// In the default mission no working robot is taken over, and no unit of work takes much longer than its estimate.
#[test]
fn a_working_teammate_keeps_its_task_and_its_work_takes_the_estimated_time() {
    let setup = default_setup(1);
    let check = Check::new(&setup, &[]);
    let of = |robot: &str, set: &str| {
        let mut all = check.forecasts.iter();
        all.find(|forecast| forecast.robot == robot && forecast.set == set)
            .unwrap()
    };
    let log = log_of(run(setup.clone(), LogLevel::Full).1);
    let events: Vec<EventRow> = log.rows().unwrap();

    let mut deliveries = 0;
    for robot in setup
        .scenario
        .robots
        .iter()
        .map(|robot| robot.name.as_str())
    {
        let mut working = None;
        for row in events.iter().filter(|row| row.robot == robot) {
            match row.kind.as_str() {
                "activated" => working = Some((row.subject.as_str(), None)),
                "hibernated" => {
                    assert!(!row.reason.starts_with("acquiesced"), "{row:?}");
                    working = working.filter(|&(set, _)| set != row.subject);
                }
                "delivered" => {
                    // A robot that has just left the task may still drop the last item.
                    let Some((set, before)) = working else {
                        continue;
                    };
                    if let Some(before) = before {
                        let took_s = (row.t_ms - before).as_secs_f64();
                        let estimated_s = of(robot, set).work_s;
                        let least_s = estimated_s / 2.0;
                        assert!(
                            (least_s..1.25 * estimated_s).contains(&took_s),
                            "{took_s} s"
                        );
                        deliveries += 1;
                    }
                    working = Some((set, Some(row.t_ms)));
                }
                _ => {}
            }
        }
    }
    assert!(deliveries >= 18, "{deliveries}");
    let movers = check
        .forecasts
        .iter()
        .filter(|forecast| forecast.set.starts_with("move-spill"));
    for takeover in movers.flat_map(|forecast| &forecast.takeovers) {
        assert_eq!(takeover.working_s, None);
    }
}

#[test]
fn check_prints_a_table_for_people_and_json_for_programs() {
    let lab = Lab::new();
    let shown = lab.run(&["check"]).expect(0);
    assert_eq!(shown.stdout, "");
    let lines: Vec<&str> = shown.stderr.lines().collect();
    let sets = ["find-locations-", "move-spill(", "report-progress"];
    let is_row = |line: &&&str| sets.iter().any(|set| line.starts_with(set));
    assert_eq!(
        lines.iter().filter(is_row).count(),
        5,
        "all robots of a set have the same figures: {}",
        shown.stderr
    );
    let widths = lines.iter().filter(is_row).map(|line| line.chars().count());
    assert!(widths.max() <= Some(80), "{}", shown.stderr);
    assert_eq!(lines[lines.len() - 1], "waste-cleanup: no warnings");

    // Warnings are no failure: the exit status is 0.
    std::fs::write(
        lab.path("mine.properties"),
        "timeBeforeYielding.move-spill(top) = 20\n",
    )
    .unwrap();
    let check = lab.run(&[
        "check",
        "waste-cleanup",
        "--params",
        "mine.properties",
        "--json",
    ]);
    let json = check.expect(0).json();
    assert_eq!(json["sets"].as_array().unwrap().len(), 13);
    assert_eq!(json["sets"][2]["behavior_set"], "move-spill(top)");
    assert_eq!(json["sets"][2]["yields_s"], 20.0);
    assert_eq!(
        json["sets"][2]["takeovers"][0]["working_s"],
        serde_json::Value::Null
    );
    let warnings = json["warnings"].as_array().unwrap();
    assert_eq!(warnings.len(), 1);
    assert_eq!(warnings[0]["kind"], "yields-too-early");
    assert_eq!(warnings[0]["robots"].as_array().unwrap().len(), 3);
}

#[test]
fn mistakes_give_one_line() {
    let lab = Lab::new();
    std::fs::write(lab.path("bad.toml"), "[alliance]\nthreshold = -1.0\n").unwrap();
    let commands = [
        &["check", "nowhere"][..],
        &["check", "bad.toml"],
        &["check", "--params", "none.properties"],
    ];
    let answers = commands.map(|command| entry(&command.join(" "), &lab.refusal(command)));
    insta::assert_snapshot!(answers.concat());
}
