//! Mistakes in arguments, scenarios and parameters: one line with the problem and the remedy, exit status 2, and no
//! started process.

use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::process::Command;

use alliance_tests::harness::Lab;
use scenario::testkit::entry;

/// Returns a refused command and its error, for a snapshot. Checks that the command creates no process and no folder.
#[track_caller]
fn refusal(lab: &Lab, command: &str) -> String {
    let error = lab.refusal(command);
    // A started world or agent would create the last folder first.
    for folder in ["runs", "out", "runtime/alliance"] {
        assert!(!lab.exists(folder), "{command} created {folder}");
    }
    entry(command, &error)
}

#[test]
fn wrong_arguments_are_refused_in_one_line() {
    let lab = Lab::new();
    let commands = [
        "rum",
        "run --limt 3",
        "run a b",
        "run --seed first",
        "run --limit 0",
        "run --robots 0",
        "run thesis-trapped-robot --spills 5",
        "run service --spills 5",
        "run --spills 5 --points 5",
        "run --speed fast",
        "run --log loud",
        "run --step-order random",
        "run --stall-after -1",
        "run waste-cleanup --at 3s",
        "run --seed 2 --faults none",
        "run --in-process --foxglove-control",
        "cluster world --run a/b",
        "cluster agent",
        "cluster agent --robot blue#",
        "clock step 0",
        "list scenarios nowhere",
    ];
    let answers = commands.map(|command| refusal(&lab, command));
    insta::assert_snapshot!(answers.concat());
}

#[test]
fn wrong_scenarios_and_parameter_files_are_refused_in_one_line() {
    let lab = Lab::new();
    let idle = "[drill]\n[[robots]]\nname = 'a'\nskills = { lift = 0 }\ntasks = ['move(top)']\n";
    for (name, text) in [
        ("key.toml", "name = 'mine'\n\nstepms = 5\n"),
        ("torn.toml", "name = 'mine'\n[room\n"),
        ("crowded.toml", "[room]\nwidth_m = 0.5\nheight_m = 0.5\n"),
        ("idle.toml", idle),
        (
            "key.properties",
            "# comment\nimpatience.report-progress = 1\n",
        ),
        (
            "value.properties",
            "threshold = 100\nbroadcastRate.report-progress =\n",
        ),
        (
            "rule.properties",
            "\n\nslowImpatience.gold.report-progress = 1000\n",
        ),
    ] {
        lab.write(name, text);
    }
    let cases = [
        "nowhere",
        "waste-clean",
        "key.toml",
        "torn.toml",
        "crowded.toml",
        "idle.toml",
        "--params nowhere.properties",
        "--params key.properties",
        "--params value.properties",
        "--params rule.properties",
    ];
    let mut answers = String::new();
    for command in ["run", "cluster world"] {
        for arguments in cases {
            answers += &refusal(&lab, &format!("{command} --out out {arguments}"));
        }
    }
    insta::assert_snapshot!(answers);
}

#[test]
fn a_folder_with_a_run_is_not_overwritten() {
    let lab = Lab::new();
    lab.mission("run", "--limit 1").expect(1);
    let before = lab.bytes("run/run.json");
    insta::assert_snapshot!(lab.refusal("run --limit 2 --out run"));
    assert_eq!(lab.bytes("run/run.json"), before);
}

/// Checks that a limited command ends with this status and this line, and does not begin a run.
#[track_caller]
fn assert_limited(lab: &Lab, command: &mut Command, status: i32, line: &str) {
    let command = command.args(["run", "--no-page", "--out", "run"]);
    let output = command.current_dir(lab.path("")).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(status), "{stderr}");
    let is_line = stderr.contains(line) && stderr.lines().count() == 1;
    assert!(is_line, "{stderr}");
    assert!(!lab.exists("run"));
}

/// The first limit is too low for the bus, the second for the number of robots. The process limit of a user does not
/// apply to root, so root runs the command as another user.
#[test]
fn too_few_open_files_and_threads_are_reported_before_the_run_begins() {
    let program = env!("CARGO_BIN_EXE_alliance-under-test");
    for (limit, robots, status, needed) in [(16, "3", 3, 64), (80, "30", 2, 124)] {
        let mut limited = Command::new("sh");
        let script = format!("ulimit -n {limit}; exec \"$0\" \"$@\" --robots {robots}");
        limited.args(["-c", &script, program]);
        let line = format!("{needed} open files are required, but the system allows only {limit}");
        assert_limited(&Lab::new(), &mut limited, status, &line);
    }
    let lab = Lab::new();
    let mut limited = Command::new("prlimit");
    if nix::unistd::Uid::effective().is_root() {
        limited.uid(65534);
        let open = std::fs::Permissions::from_mode(0o777);
        std::fs::set_permissions(lab.path(""), open).unwrap();
    }
    limited.args(["--nproc=1", program]);
    let line = "alliance: 5 threads are required, but the system allows only 0";
    assert_limited(&lab, &mut limited, 3, line);
}

#[test]
fn wrong_profiles_are_refused_in_one_line() {
    let lab = Lab::new();
    let known = "{ trials = 1, latest_s = [20.0] }";
    let negative = "[gold.report-progress]\ngold = { trials = 1, latest_s = [-2] }\n";
    lab.write(
        "robot.toml",
        format!("\n[blue.report-progress]\nrad = {known}\n"),
    );
    lab.write("task.toml", format!("[blue.report]\nblue = {known}\n"));
    lab.write("time.toml", negative);
    lab.write("syntax.toml", "[gold\n");
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
        for command in ["run", "run --in-process"] {
            let options = format!("--allocator l-alliance --profile {file}");
            answers += &refusal(&lab, &format!("{command} {options}"));
        }
    }
    // An allocator that learns nothing refuses a profile, whether the file exists or not.
    answers += &refusal(&lab, "run --profile new.toml");
    answers += &refusal(&lab, "cluster world --profile new.toml");
    insta::assert_snapshot!(answers);
}

/// A file stands where a folder is needed. In containers, it is a file system that cannot be written.
#[test]
fn a_folder_that_cannot_be_made_is_named_with_the_option_for_another_one() {
    let lab = Lab::new();
    lab.write("file", "");
    lab.mission("run", "--in-process --limit 1").expect(1);
    for (command, status) in [
        ("run --no-page --limit 1 --out file/x", 3),
        ("report run --out file/x", 2),
        ("export run --png end --out file/x", 2),
    ] {
        let refused = lab.run(command).expect(status);
        let text = "; choose another folder with --out: Not a directory";
        assert!(refused.stderr.contains(text), "{}", refused.stderr);
    }
}
