//! `alliance check`: its forecasts hold, and its output formats.

use alliance_tests::harness::Lab;
use alliance_tests::runs::{Events, log_of, run, setup};
use missions::waste::data::{default_scenario, default_setup};

use analysis::check::Check;
use analysis::check::forecast::Takeover;
use run_log::{EventRow, LogLevel, MessageRow};
use scenario::testkit::entry;
use scenario::{BehaviorSection, Preset, RobotSection, Scenario, Setup, SwitchSection};
use serde_json::Value;

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
    let mut forecasts = forecasts.into_iter();
    let gold = forecasts.find(|forecast| forecast.robot == "gold" && forecast.set == FIND);
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
    let alliance = &setup.alliance;
    let step_s = alliance.step_ms as f64 / 1000.0;
    let early_s = match alliance.switches.release_message {
        true => step_s,
        false => 1.0,
    };
    let agrees = (forecast_s - early_s..=forecast_s + 4.0 * step_s).contains(&actual_s);
    assert!(agrees, "{actual_s}, not {forecast_s} s with {alliance:#?}");
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
                let mut messages = log.rows::<MessageRow>().unwrap().into_iter();
                let first_heartbeat =
                    messages.find(|row| row.receiver == "gold" && row.state == "executing");
                let taken_over = &log.events_of("gold", "activated")[0];
                let took = taken_over.t_ms - first_heartbeat.unwrap().t_ms;
                let forecast_s = forecast_takeover(&setup).failing_s;
                assert_agrees(took.as_secs_f64(), forecast_s, &setup);
            }
        }
    }
}

/// In the default mission no working robot is taken over, and no unit of work takes much longer than its estimate.
#[test]
fn a_working_teammate_keeps_its_task_and_its_work_takes_the_estimated_time() {
    let setup = default_setup(1);
    let forecasts = Check::new(&setup, &[]).forecasts;
    let estimated_s = |robot: &str, set: &str| {
        let mut all = forecasts.iter();
        let found = all.find(|forecast| forecast.robot == robot && forecast.set == set);
        found.unwrap().work_s
    };
    let log = log_of(run(setup.clone(), LogLevel::Full).1);
    let events: Vec<EventRow> = log.rows().unwrap();

    let mut deliveries = 0;
    for robot in setup.scenario.robots.iter().map(|robot| &robot.name) {
        // The active set, with the time of its latest delivery.
        let mut working = None;
        for row in events.iter().filter(|row| row.robot == *robot) {
            match (row.kind.as_str(), working) {
                ("activated", _) => working = Some((row.subject.as_str(), None)),
                ("hibernated", _) => {
                    assert!(!row.reason.starts_with("acquiesced"), "{row:?}");
                    working = working.filter(|&(set, _)| set != row.subject);
                }
                // A robot that has just left the task may still drop the last item.
                ("delivered", Some((set, before))) => {
                    if let Some(before) = before {
                        let took_s = (row.t_ms - before).as_secs_f64();
                        let estimated_s = estimated_s(robot, set);
                        let likely_s = estimated_s / 2.0..1.25 * estimated_s;
                        assert!(likely_s.contains(&took_s), "{took_s} s");
                        deliveries += 1;
                    }
                    working = Some((set, Some(row.t_ms)));
                }
                _ => {}
            }
        }
    }
    assert!(deliveries >= 18, "{deliveries}");
    let movers = forecasts.iter();
    let movers = movers.filter(|forecast| forecast.set.starts_with("move-spill"));
    let mut takeovers = movers.flat_map(|forecast| &forecast.takeovers);
    assert!(takeovers.all(|takeover| takeover.working_s.is_none()));
}

#[test]
fn check_prints_a_table_for_people_and_json_for_programs() {
    let lab = Lab::new();
    let shown = lab.run("check").expect(0);
    assert_eq!(shown.stdout, "");
    let lines: Vec<&str> = shown.stderr.lines().collect();
    let sets = ["find-locations-", "move-spill(", "report-progress"];
    let is_row = |line: &&&str| sets.iter().any(|set| line.starts_with(set));
    let widths = lines.iter().filter(is_row).map(|line| line.chars().count());
    let widths: Vec<usize> = widths.collect();
    assert!(widths.iter().max() <= Some(&80), "{}", shown.stderr);
    // All robots of a set have the same figures.
    assert_eq!(widths.len(), 5, "{}", shown.stderr);
    assert_eq!(lines[lines.len() - 1], "waste-cleanup: no warnings");

    // Warnings are no failure: the exit status is 0.
    let mine = "timeBeforeYielding.move-spill(top) = 20\n";
    lab.write("mine.properties", mine);
    let check = lab.run("check waste-cleanup --params mine.properties --json");
    let json = check.expect(0).json();
    assert_eq!(json["sets"].as_array().unwrap().len(), 13);
    let set = &json["sets"][2];
    assert_eq!(set["behavior_set"], "move-spill(top)");
    assert_eq!(set["yields_s"], 20.0);
    assert_eq!(set["takeovers"][0]["working_s"], Value::Null);
    let warnings = json["warnings"].as_array().unwrap();
    assert_eq!(warnings.len(), 1);
    assert_eq!(warnings[0]["kind"], "yields-too-early");
    assert_eq!(warnings[0]["robots"].as_array().unwrap().len(), 3);
}

#[test]
fn many_points_are_checked() {
    let lab = Lab::new();
    let points = "limit_s = 100000.0\nroom = { width_m = 300.0, height_m = 300.0 }\n\
         [service]\n[[service.kinds]]\nname = 'k'\nwork_s = { min = 1.0, max = 2.0 }\n\
         [[service.random]]\nn = 4000\nkind = 'k'\n";
    lab.write("points.toml", points);
    let finished = lab.run("check points.toml").expect(0);
    let last = format!("{}{}", finished.stdout, finished.stderr);
    assert!(last.contains("serve(p3999)"), "{last}");
}

#[test]
fn mistakes_give_one_line() {
    let lab = Lab::new();
    lab.write("bad.toml", "[alliance]\nthreshold = -1.0\n");
    let commands = [
        "check nowhere",
        "check bad.toml",
        "check --params none.properties",
    ];
    let answers = commands.map(|command| entry(command, &lab.refusal(command)));
    insta::assert_snapshot!(answers.concat());
}

#[test]
fn groups_with_the_same_times_are_counted() {
    let output = Lab::new().run("check --robots 300").expect(0).stderr;
    let counted = "and 99 more groups of robots with the same times";
    assert!(output.contains(counted), "{output}");
    assert!(output.lines().count() < 50, "{output}");
}
