//! Mistakes in arguments, scenarios and parameters: one line with the problem and the remedy, exit status 2, and no
//! started process.

use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;

use alliance_tests::harness::Lab;
use scenario::testkit::entry;

/// Returns a refused command and its error, for a snapshot. Checks that the command creates no process and no folder.
#[track_caller]
fn refusal(lab: &Lab, arguments: &[&str]) -> String {
    let command = arguments.join(" ");
    let error = lab.refusal(arguments);
    assert!(
        !lab.path("runs").exists() && !lab.path("out").exists(),
        "{command}: a folder was created"
    );
    // A started world or agent would create this folder first.
    assert!(
        !lab.path("runtime/alliance").exists(),
        "{command}: a process was started"
    );
    entry(&command, &error)
}

#[test]
fn wrong_arguments_are_refused_in_one_line() {
    let lab = Lab::new();
    let commands: &[&[&str]] = &[
        &["rum"],
        &["run", "--limt", "3"],
        &["run", "a", "b"],
        &["run", "--seed", "first"],
        &["run", "--limit", "0"],
        &["run", "--robots", "0"],
        &["run", "thesis-trapped-robot", "--spills", "5"],
        &["run", "service", "--spills", "5"],
        &["run", "--spills", "5", "--points", "5"],
        &["run", "--speed", "fast"],
        &["run", "--log", "loud"],
        &["run", "--step-order", "random"],
        &["run", "--stall-after", "-1"],
        &["cluster", "world", "--run", "a/b"],
        &["cluster", "agent"],
        &["cluster", "agent", "--robot", "blue#"],
        &["clock", "step", "0"],
        &["list", "scenarios", "nowhere"],
    ];
    let answers = commands.iter().map(|command| refusal(&lab, command));
    insta::assert_snapshot!(answers.collect::<String>());
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
    let cases: &[&[&str]] = &[
        &["nowhere"],
        &["waste-clean"],
        &["key.toml"],
        &["torn.toml"],
        &["crowded.toml"],
        &["idle.toml"],
        &["--params", "nowhere.properties"],
        &["--params", "key.properties"],
        &["--params", "value.properties"],
        &["--params", "rule.properties"],
    ];
    let mut answers = String::new();
    for command in [&["run"][..], &["cluster", "world"]] {
        for arguments in cases {
            answers += &refusal(&lab, &[command, &["--out", "out"], *arguments].concat());
        }
    }
    insta::assert_snapshot!(answers);
}

#[test]
fn a_folder_with_a_run_is_not_overwritten() {
    let lab = Lab::new();
    lab.mission("run", &["--limit", "1"]).expect(1);
    let before = std::fs::read(lab.path("run/run.json")).unwrap();
    insta::assert_snapshot!(lab.refusal(&["run", "--limit", "2", "--out", "run"]));
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
    let mut answers = String::new();
    for file in [
        "robot.toml",
        "task.toml",
        "time.toml",
        "syntax.toml",
        "folder",
        "nowhere/p.toml",
    ] {
        for command in [&["run"][..], &["run", "--in-process"]] {
            let options = ["--allocator", "l-alliance", "--profile", file];
            answers += &refusal(&lab, &[command, &options].concat());
        }
    }
    // An allocator that learns nothing refuses a profile, whether the file exists or not.
    answers += &refusal(&lab, &["run", "--profile", "new.toml"]);
    answers += &refusal(&lab, &["cluster", "world", "--profile", "new.toml"]);
    insta::assert_snapshot!(answers);
}
