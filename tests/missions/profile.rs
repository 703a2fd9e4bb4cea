//! `alliance run --profile`: learned times pass from run to run, and such a run can be repeated.

use std::fs::{read_to_string, remove_file};

use alliance_tests::harness::{Lab, command_line, wait_until};
use alliance_tests::runs::{self, vocabulary};
use alliance_tests::ten_missions::{error, mission, ten, wrong_by};
use alliance_tests::testkit::{KILL, RESTART, in_repository};
use in_process::Team;
use missions::service::data::ServiceSection;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use proto::tick::Outcome;
use run_log::{LogLevel, MemoryLog};
use scenario::{LearnedTimes, Profile, Scenario, Setup};

use crate::allocators::scenario;

const L_ALLIANCE: &str = "l-alliance";

/// Returns the default mission before its first tick.
fn team(faults: &str, seed: u64, profile: Profile) -> Team<MemoryLog> {
    let setup = Setup {
        profile,
        ..runs::setup(scenario(L_ALLIANCE, faults), seed)
    };
    runs::team(setup, LogLevel::Off)
}

fn learned(seed: u64) -> Profile {
    mission("allocator = \"l-alliance\"", seed, Profile::default()).learned
}

fn own_trials<'p>(profile: &'p Profile, robot: &str) -> Vec<(&'p str, &'p LearnedTimes)> {
    let tasks = profile.robots[robot].iter();
    let trials = tasks.filter_map(|(task, times)| Some((task.as_str(), times.get(robot)?)));
    trials.collect()
}

/// Runs three missions in a row: to the end, with a real SIGKILL, and to a limit without a log.
#[test]
fn processes_and_one_process_learn_the_same_and_a_replay_needs_no_file() {
    let lab = Lab::new();
    lab.write("kill.toml", KILL);
    let missions = [
        ("first", "--seed 1", 0),
        ("second", "kill.toml --seed 2", 0),
        ("third", "--limit 60 --log off", 1),
    ];
    let mut before = Profile::default();
    for (name, arguments, status) in missions {
        let [many, one] = ["many", "one"].map(|way| format!("{name}-{way}"));
        let arguments = format!("{arguments} --allocator {L_ALLIANCE} --profile");
        let by_processes = lab.mission(&many, format!("{arguments} many.toml"));
        by_processes.expect(status);
        let in_process = lab.mission(&one, format!("{arguments} one.toml --in-process"));
        in_process.expect(status);
        if name != "third" {
            lab.assert_same_bytes(&many, &one);
        }
        let run_file = |run: &str| lab.text(&format!("{run}/run.json"));
        assert_eq!(run_file(&many), run_file(&one), "{name}");
        let text = lab.text("many.toml");
        assert_eq!(text, lab.text("one.toml"), "{name}");

        // The log of the run contains the profile at its start.
        let setup = lab.log(&many).run.setup;
        assert_eq!(setup.profile, before, "{name}");
        let after = Profile::parse("many.toml", &text, &setup.scenario, &vocabulary()).unwrap();
        assert_ne!(after, before, "{name}");
        // A crashed robot loses the times that it learned in this run.
        let gold = |profile: &Profile| profile.robots.get("gold").cloned();
        assert_eq!(gold(&after) == gold(&before), name == "second", "{name}");
        before = after;
    }
    remove_file(lab.path("many.toml")).unwrap();
    remove_file(lab.path("one.toml")).unwrap();
    for (name, _, _) in missions {
        lab.assert_repeated(&format!("{name}-many"));
    }
    assert!(!lab.exists("many.toml"), "a replay must write no profile");
}

#[test]
fn a_restarted_robot_begins_with_its_profile_again() {
    let profile = learned(1);
    let mut team = team(RESTART, 2, profile.clone());
    let mut at = |time_s: u64| {
        let ticks = time_s * 1000 / 50;
        team.continue_for(ticks, Outcome::Interrupted, |_| {})
            .unwrap();
        team.learned()
    };
    let before = at(99);
    assert_ne!(own_trials(&before, "gold"), own_trials(&profile, "gold"));
    let crashed = at(102);
    assert_eq!(crashed.robots["gold"], profile.robots["gold"]);
    assert_ne!(crashed.robots["blue"], profile.robots["blue"]);
    let again = at(161);
    assert_eq!(own_trials(&again, "gold"), own_trials(&profile, "gold"));
    let end = at(1800);
    assert_ne!(own_trials(&end, "gold"), own_trials(&profile, "gold"));
}

#[test]
fn an_interrupted_run_writes_the_file_and_a_killed_world_leaves_it() {
    let lab = Lab::new();
    let text = learned(1).to_toml();
    // Comments in the file are not kept.
    let edited = format!("# mine\n{text}");
    let start = |name: &str| {
        lab.write(&format!("{name}.toml"), &edited);
        let profile = format!("--allocator {L_ALLIANCE} --profile {name}.toml");
        let run = format!("run --no-page --speed 1x --out {name} {profile}");
        let mut run = lab.start(run);
        run.wait_for_stderr("process ids");
        let log = lab.path(name).join("ticks.csv");
        wait_until("the first ticks", || {
            read_to_string(&log).is_ok_and(|text| text.lines().count() > 1)
        });
        run
    };
    let run = start("interrupted");
    run.signal(Signal::SIGINT);
    run.wait().expect(130);
    let now = lab.text("interrupted.toml");
    assert!(now.starts_with("# Learned times"), "{now}");

    let run = start("killed");
    let mut children = run.children().into_iter();
    let is_world = |pid: &u32| command_line(*pid).is_some_and(|line| line.contains(" world "));
    let world = children.find(is_world).unwrap();
    kill(Pid::from_raw(world as i32), Signal::SIGKILL).unwrap();
    run.wait().expect(3);
    assert_eq!(lab.text("killed.toml"), edited);
    let mut names = lab.names("");
    names.retain(|name| name.starts_with(".alliance-new-"));
    assert_eq!(names, Vec::<String>::new(), "a partial file is left");
}

/// Estimates of a tenth and of ten times the real times converge within ten missions, and the missions become faster
/// if patience was too short. docs/allocators/l-alliance.md has the whole table.
#[test]
fn wrong_estimates_converge_within_ten_missions() {
    let lines = "allocator = \"l-alliance\"";
    let reference_profile = &ten(lines, 1, Profile::default())[9].learned;
    for factor in [0.1, 10.0] {
        let begin = wrong_by(factor);
        let missions = ten(lines, 1, begin.clone());
        let learned = missions.iter();
        let learned = learned.map(|mission| error(&mission.learned, reference_profile));
        let (before, learned) = (
            error(&begin, reference_profile),
            learned.collect::<Vec<f64>>(),
        );
        let converges =
            before > 7.0 && learned[0] < before && learned[9] < learned[0] && learned[9] < 2.0;
        assert!(converges, "{before}, then {learned:?}");
        if factor < 1.0 {
            let took_s: Vec<f64> = missions.iter().map(|mission| mission.took_s).collect();
            assert!(took_s[9] < took_s[0], "{took_s:?}");
        }
    }
}

/// Returns the least makespan of all assignments of the points to robots with the skill, s.
fn least_makespan_s(scenario: &Scenario) -> f64 {
    let section = ServiceSection::of(scenario);
    let mut all: Vec<Vec<f64>> = vec![vec![0.0; scenario.robots.len()]];
    for kind in section.kinds_of_points() {
        let kind = &section.kinds[kind];
        let with_point = all.iter().flat_map(|loads_s| {
            let robots = scenario.robots.iter().enumerate();
            robots.filter_map(move |(rank, robot)| {
                let mut loads_s = loads_s.clone();
                let skill = robot.skill(&kind.name).filter(|skill| *skill > 0.0)?;
                loads_s[rank] += kind.work_s.max / skill;
                Some(loads_s)
            })
        });
        all = with_point.collect();
    }
    let makespans_s = all
        .iter()
        .map(|loads_s| loads_s.iter().copied().fold(0.0, f64::max));
    makespans_s.fold(f64::INFINITY, f64::min)
}

/// The scenario and its page state the ratios to the optimum here, beside the published ones.
#[test]
fn the_abstract_study_states_its_own_ratios_to_the_optimum() {
    let text = vocabulary().builtin("l-alliance-abstract").unwrap().text;
    let optimum_s = least_makespan_s(&runs::parse(text));
    let mut missions = vec![mission(text, 1, Profile::default())];
    for before in 0..4 {
        let profile = missions[before].learned.clone();
        missions.push(mission(text, 1, profile));
    }
    let ratio = |mission: usize| format!("{:.2}", missions[mission].took_s / optimum_s);
    let (first, later) = (ratio(0), ratio(3));
    assert_eq!(later, ratio(4), "the ratio stays");
    let took = format!("{:.1} s", missions[0].took_s);
    let stated = format!("{first} times the optimum of {optimum_s:.1} s");
    let page = read_to_string(in_repository("docs/missions/service.md")).unwrap();
    for (document, text) in [("scenario", text), ("page", page.as_str())] {
        let words: Vec<&str> = text
            .split_whitespace()
            .filter(|word| *word != "#")
            .collect();
        let words = words.join(" ");
        for expected in [&took, &stated, &format!("{later} times")] {
            assert!(words.contains(expected), "{document}: {expected}");
        }
    }
    assert!(text.contains("1.20 times the optimum"));
}
