//! Mistakes in arguments, scenarios and parameters: one line with the problem and the remedy, exit status 2, and no
//! started process.

use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;

use crate::harness::Lab;

/// Checks that a command is refused in one line with these texts, and creates no process and no folder.
#[track_caller]
fn assert_refused(lab: &Lab, arguments: &[&str], texts: &[&str]) {
    let finished = lab.run(arguments).expect(2);
    let stderr = &finished.stderr;
    let name = &finished.name;
    assert_eq!(
        stderr.lines().count(),
        1,
        "not one line for {name}:\n{stderr}"
    );
    assert!(
        ["alliance", "world: ", "robot-agent: "]
            .iter()
            .any(|part| stderr.starts_with(part)),
        "{name}: {stderr}"
    );
    for text in texts {
        assert!(stderr.contains(text), "no '{text}' for {name}: {stderr}");
    }
    assert_eq!(finished.stdout, "");
    assert!(
        !lab.path("runs").exists() && !lab.path("out").exists(),
        "{name}: a folder was created"
    );
    // A started world or agent would create this folder first.
    assert!(
        !lab.path("runtime/alliance").exists(),
        "{name}: a process was started"
    );
}

#[test]
fn wrong_arguments_are_refused_in_one_line() {
    let lab = Lab::new();
    let cases: &[(&[&str], &[&str])] = &[
        (&["rum"], &["unrecognized subcommand 'rum'", "'run'"]),
        (&["run", "--limt", "3"], &["'--limt'", "'--limit'"]),
        (&["run", "a", "b"], &["unexpected argument 'b'"]),
        (
            &["run", "--seed", "first"],
            &["'first'", "--seed", "a whole number from 0 to"],
        ),
        (
            &["run", "--limit", "0"],
            &["'0'", "--limit", "a number of seconds above 0"],
        ),
        (
            &["run", "--robots", "0"],
            &["'0'", "--robots", "a whole number from 1 to 10000"],
        ),
        (
            &["run", "thesis-trapped-robot", "--spills", "5"],
            &[
                "'thesis-trapped-robot' has a fixed size",
                "use them with 'waste-cleanup' and ",
            ],
        ),
        (
            &["run", "service", "--spills", "5"],
            &["--spills: 'service' has another size option; use --points"],
        ),
        (
            &["run", "--spills", "5", "--points", "5"],
            &["'--spills <M>' cannot be used with '--points <M>'"],
        ),
        (
            &["run", "--speed", "fast"],
            &["'fast'", "--speed", "'max'", "'5x'"],
        ),
        (
            &["run", "--log", "loud"],
            &["'loud'", "--log", "full, summary, off"],
        ),
        (
            &["run", "--step-order", "random"],
            &["'random'", "'simultaneous' or 'in-order'"],
        ),
        (
            &["run", "--stall-after", "-1"],
            &["'-1'", "--stall-after", "a number of seconds above 0"],
        ),
        (
            &["world", "--run", "a/b"],
            &["'a/b'", "--run", "letters, digits"],
        ),
        (&["agent"], &["which robot?", "--robot NAME"]),
        (
            &["agent", "--robot", "blue#"],
            &["'blue#'", "letters, digits"],
        ),
        (&["clock", "step", "0"], &["'0'", "a whole number above 0"]),
        (&["scenarios", "nowhere"], &["'nowhere'", "waste-cleanup"]),
    ];
    for (arguments, texts) in cases {
        assert_refused(&lab, arguments, texts);
    }
}

#[test]
fn wrong_scenarios_and_parameter_files_are_refused_in_one_line() {
    let lab = Lab::new();
    let write = |name: &str, text: &str| std::fs::write(lab.path(name), text).unwrap();
    write("key.toml", "name = 'mine'\n\nstepms = 5\n");
    write("torn.toml", "name = 'mine'\n[room\n");
    write("crowded.toml", "[room]\nwidth_m = 0.5\nheight_m = 0.5\n");
    write(
        "idle.toml",
        "[drill]\n[[robots]]\nname = 'a'\nskills = { lift = 0 }\ntasks = ['move(top)']\n",
    );
    write(
        "key.properties",
        "# comment\nimpatience.report-progress = 1\n",
    );
    write(
        "value.properties",
        "threshold = 100\nbroadcastRate.report-progress =\n",
    );
    write(
        "rule.properties",
        "\n\nslowImpatience.gold.report-progress = 1000\n",
    );
    let cases: &[(&[&str], &[&str])] = &[
        (
            &["nowhere"],
            &[
                "'nowhere' is neither a built-in scenario nor a file",
                "there are waste-cleanup, ",
            ],
        ),
        (&["waste-clean"], &["did you mean 'waste-cleanup'?"]),
        (
            &["key.toml"],
            &["key.toml:3: stepms: ", "did you mean 'step_ms'?"],
        ),
        (&["torn.toml"], &["torn.toml:2: ", "`]`"]),
        (&["crowded.toml"], &["crowded.toml"]),
        (
            &["idle.toml"],
            &[
                "idle.toml:5: robots[0].tasks: a has no behavior for any of its tasks",
                "it can do find, report",
            ],
        ),
        (
            &["--params", "nowhere.properties"],
            &["nowhere.properties: "],
        ),
        (
            &["--params", "key.properties"],
            &["key.properties:2: impatience.report-progress: unknown parameter"],
        ),
        (
            &["--params", "value.properties"],
            &["value.properties:2: ", "the value is missing", "above 0 Hz"],
        ),
        (
            &["--params", "rule.properties"],
            &["rule.properties:3: ", "the rule is 0 < slow < fast"],
        ),
    ];
    for (arguments, texts) in cases {
        for part in ["run", "world"] {
            let mut all = vec![part, "--out", "out"];
            all.extend(*arguments);
            assert_refused(&lab, &all, texts);
        }
    }
}

/// Checks wrong sizes, unknown skills, impossible tasks and missing devices.
#[test]
fn wrong_service_and_foraging_scenarios_are_refused_in_one_line() {
    const SERVICE: &str = "[service]\nkinds = [{ name = 'dust', work_s = { min = 6, max = 10 } }, \
        { name = 'floor', work_s = { min = 6, max = 10 } }]\nrandom = [{ n = 4 }]\n";
    let gold = |skills: &str| format!("{SERVICE}[[robots]]\nname = 'gold'\nskills = {skills}\n");
    let fault =
        |fault: &str| format!("{SERVICE}[faults]\ntimeline = [{{ fault.{fault}, at_s = 3 }}]\n");
    let cases = [
        (
            SERVICE.replace("n = 4", "n = 20000"),
            "service: more than 10000 points in all; give fewer points, random and spare",
        ),
        (
            SERVICE.replace("max = 10 } }]", "max = 1 } }]"),
            "kinds[1].work_s: min 6 is above max 1",
        ),
        (
            gold("{ dust = 1, flor = 1 }"),
            "robots[0].skills.flor: there is no skill 'flor'; did you mean 'floor'?",
        ),
        (
            gold("{ dust = 1 }"),
            "no robot has serve(p1) among its tasks and the skill floor, and 1 more task that no robot can do",
        ),
        (
            gold("{ dust = 1, floor = 1 }\ndevices = ['gripper']"),
            "robots[0].devices[0]: there is no optional device 'gripper'",
        ),
        (
            fault("sensor = { robot = 'blue', device = 'eye', mode = 'dead' }"),
            "sensor.device: there is no choice 'eye'; there are position",
        ),
        (
            fault("skill = { robot = 'blue', skill = 'dusk', share = 0.3 }"),
            "skill.skill: there is no skill 'dusk'; did you mean 'dust'?",
        ),
        (
            "[waste]\nduration_s = 5\n".to_owned(),
            "waste.duration_s: the clean-up ends when all items are delivered",
        ),
    ];
    let lab = Lab::new();
    for (text, line) in cases {
        std::fs::write(lab.path("s.toml"), text).unwrap();
        assert_refused(&lab, &["run", "s.toml", "--out", "out"], &["s.toml:", line]);
    }
}

#[test]
fn a_folder_with_a_run_is_not_overwritten() {
    let lab = Lab::new();
    lab.mission("run", &["--limit", "1"]).expect(1);
    let before = std::fs::read(lab.path("run/run.json")).unwrap();
    let again = lab.mission("run", &["--limit", "2"]).expect(2);
    assert_eq!(
        again.stderr,
        "alliance run: --out run: already holds a run; name a new folder\n"
    );
    assert_eq!(std::fs::read(lab.path("run/run.json")).unwrap(), before);
}

/// The first limit is too low for the bus, the second for the number of robots.
#[test]
fn too_few_open_files_are_reported_before_the_run_begins() {
    for (limit, robots, status, needed) in [(16, "3", 3, 64), (80, "30", 2, 124)] {
        let lab = Lab::new();
        let run = std::process::Command::new("sh")
            .args(["-c", &format!("ulimit -n {limit}; exec \"$0\" \"$@\"")])
            .arg(env!("CARGO_BIN_EXE_alliance-under-test"))
            .args(["run", "--robots", robots, "--no-page", "--out", "run"])
            .current_dir(lab.path(""))
            .output()
            .unwrap();
        let stderr = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(status), "{stderr}");
        let expected =
            format!("{needed} open files are required, but the system allows only {limit}");
        assert!(
            stderr.contains(&expected) && stderr.lines().count() == 1,
            "{stderr}"
        );
        assert!(!lab.path("run").exists());
    }
}

/// The process limit of a user. It does not apply to root, so root runs the command as another user.
#[test]
fn too_few_threads_are_reported_before_the_run_begins() {
    let lab = Lab::new();
    let mut limited = std::process::Command::new("prlimit");
    if nix::unistd::Uid::effective().is_root() {
        limited.uid(65534);
        let open = std::fs::Permissions::from_mode(0o777);
        std::fs::set_permissions(lab.path(""), open).unwrap();
    }
    let run = limited
        .arg("--nproc=1")
        .arg(env!("CARGO_BIN_EXE_alliance-under-test"))
        .args(["run", "--no-page", "--out", "run"])
        .current_dir(lab.path(""))
        .output()
        .unwrap();
    let stderr = String::from_utf8(run.stderr).unwrap();
    assert_eq!(run.status.code(), Some(3), "{stderr}");
    assert!(
        stderr.starts_with("alliance: 5 threads are required, but the system allows only 0")
            && stderr.lines().count() == 1,
        "{stderr}"
    );
    assert!(!lab.path("run").exists());
}

#[test]
fn wrong_profiles_are_refused_in_one_line() {
    let lab = Lab::new();
    let known = "{ trials = 1, latest_s = [20.0] }";
    let files = [
        (
            "robot.toml",
            format!("\n[blue.report-progress]\nrad = {known}\n"),
        ),
        ("task.toml", format!("[blue.report]\nblue = {known}\n")),
        (
            "time.toml",
            "[gold.report-progress]\ngold = { trials = 1, latest_s = [-2] }\n".to_owned(),
        ),
        ("syntax.toml", "[gold\n".to_owned()),
    ];
    for (name, text) in files {
        std::fs::write(lab.path(name), text).unwrap();
    }
    std::fs::create_dir(lab.path("folder")).unwrap();
    let cases: &[(&str, &[&str])] = &[
        (
            "robot.toml",
            &[
                "robot.toml:3: blue.report-progress.rad: ",
                "no robot 'rad'",
                "there are blue, gold, green",
            ],
        ),
        (
            "task.toml",
            &[
                "task.toml:1: blue.report: ",
                "no task 'report'",
                "report-progress",
            ],
        ),
        (
            "time.toml",
            &[
                "time.toml:2: ",
                "latest_s[0]: -2 is out of range",
                "above 0",
            ],
        ),
        ("syntax.toml", &["syntax.toml:1: ", "TOML"]),
        ("folder", &["--profile folder", "name a file"]),
        (
            "nowhere/p.toml",
            &["--profile", "cannot write nowhere/p.toml"],
        ),
    ];
    for (file, texts) in cases {
        for command in [&["run"][..], &["run", "--in-process"]] {
            let options = ["--allocator", "l-alliance", "--profile", file];
            assert_refused(&lab, &[command, &options].concat(), texts);
        }
    }
    // An allocator that learns nothing refuses a profile, whether the file exists or not.
    let texts = [
        "--profile new.toml",
        "alliance, which learns nothing",
        "l-alliance",
    ];
    assert_refused(&lab, &["run", "--profile", "new.toml"], &texts);
    assert_refused(&lab, &["world", "--profile", "new.toml"], &texts);
}
