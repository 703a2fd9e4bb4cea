//! Mistakes in arguments, scenario and parameters: one line that says what is wrong and what would be right, exit status 2,
//! and nothing started.

use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;

use crate::harness::Lab;

/// Refused in one line that begins with `alliance` and holds these texts; no process, no folder.
#[track_caller]
fn assert_refused(lab: &Lab, arguments: &[&str], texts: &[&str]) {
    let finished = lab.run(arguments).expect(2);
    let said = &finished.stderr;
    let name = &finished.name;
    assert_eq!(said.lines().count(), 1, "not one line for {name}:\n{said}");
    assert!(
        ["alliance", "world: ", "robot-agent: "]
            .iter()
            .any(|part| said.starts_with(part)),
        "{name}: {said}"
    );
    for text in texts {
        assert!(said.contains(text), "no '{text}' for {name}: {said}");
    }
    assert_eq!(finished.stdout, "");
    assert!(
        !lab.path("runs").exists() && !lab.path("out").exists(),
        "{name}: a folder was made"
    );
    // The first thing that a world or an agent does is to look for others here.
    assert!(
        !lab.path("runtime/alliance").exists(),
        "{name}: a process was started"
    );
}

#[test]
fn arguments() {
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
                "'thesis-trapped-robot' has its own",
                "they go with 'waste-cleanup' and ",
            ],
        ),
        (
            &["run", "service", "--spills", "5"],
            &["--spills: 'service' goes by --points"],
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
fn scenarios_and_parameter_files() {
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

/// Points of work: sizes that do not fit, skills of unknown kinds, tasks that nobody can do, devices that the mission lacks.
#[test]
fn scenarios_of_service_and_of_foraging() {
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
            "nobody has serve(p1) among its tasks and the skill floor, and 1 more tasks that nobody can do",
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
            "waste.duration_s: the clean-up ends when all is delivered",
        ),
    ];
    let lab = Lab::new();
    for (text, line) in cases {
        std::fs::write(lab.path("s.toml"), text).unwrap();
        assert_refused(&lab, &["run", "s.toml", "--out", "out"], &["s.toml:", line]);
    }
}

#[test]
fn a_folder_that_holds_a_run() {
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

/// Too few for the bus, then too few for so many robots.
#[test]
fn too_few_open_files_are_told_before_anything_begins() {
    for (limit, robots, status, needed) in [(16, "3", 3, 64), (80, "30", 2, 124)] {
        let lab = Lab::new();
        let asked = std::process::Command::new("sh")
            .args(["-c", &format!("ulimit -n {limit}; exec \"$0\" \"$@\"")])
            .arg(env!("CARGO_BIN_EXE_alliance-under-test"))
            .args(["run", "--robots", robots, "--no-page", "--out", "run"])
            .current_dir(lab.path(""))
            .output()
            .unwrap();
        let said = String::from_utf8(asked.stderr).unwrap();
        assert_eq!(asked.status.code(), Some(status), "{said}");
        let expected = format!("{needed} open files are needed and {limit} allowed");
        assert!(
            said.contains(&expected) && said.lines().count() == 1,
            "{said}"
        );
        assert!(!lab.path("run").exists());
    }
}

/// As for a user who may have no further process. The limit does not hold for root, who tries as nobody.
#[test]
fn too_few_threads_are_told_before_anything_begins() {
    let lab = Lab::new();
    let mut limited = std::process::Command::new("prlimit");
    if nix::unistd::Uid::effective().is_root() {
        limited.uid(65534);
        let open = std::fs::Permissions::from_mode(0o777);
        std::fs::set_permissions(lab.path(""), open).unwrap();
    }
    let asked = limited
        .arg("--nproc=1")
        .arg(env!("CARGO_BIN_EXE_alliance-under-test"))
        .args(["run", "--no-page", "--out", "run"])
        .current_dir(lab.path(""))
        .output()
        .unwrap();
    let said = String::from_utf8(asked.stderr).unwrap();
    assert_eq!(asked.status.code(), Some(3), "{said}");
    assert!(
        said.starts_with("alliance: 5 threads are needed and 0 can be had")
            && said.lines().count() == 1,
        "{said}"
    );
    assert!(!lab.path("run").exists());
}

#[test]
fn profiles() {
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
        for way in [&["run"][..], &["run", "--in-process"]] {
            let given = ["--allocator", "l-alliance", "--profile", file];
            assert_refused(&lab, &[way, &given].concat(), texts);
        }
    }
    // Of one that learns nothing there is nothing to be kept, whether there is a file or not.
    let texts = [
        "--profile new.toml",
        "alliance, which learns nothing",
        "l-alliance",
    ];
    assert_refused(&lab, &["run", "--profile", "new.toml"], &texts);
    assert_refused(&lab, &["world", "--profile", "new.toml"], &texts);
}
