//! An export that is impossible is refused in one line and changes no file.

use std::process::Command;

use alliance_tests::harness::{Lab, alliance};
use scenario::testkit::entry;

#[test]
fn wrong_arguments_are_refused_in_one_line() {
    let lab = Lab::new();
    let mission = "--limit 2 --log off --in-process";
    lab.mission("run", mission).expect(1);
    let before = lab.names("run");
    std::fs::create_dir_all(lab.path("taken.mcap")).unwrap();
    let commands = [
        "export",
        "export run",
        "export run --mcpa",
        "export run --csv",
        "export nowhere --mcap",
        "export run --parquet",
        "export run --mcap=no/such/folder.mcap",
        "export run --mcap=taken.mcap",
        "export nowhere --html",
        "export run --html=no/such/folder.html",
        "export run --html=taken.mcap",
        "export run --rosbag=taken.mcap",
        "export run --rosbag=no/such/folder",
        "export digit --rosbag",
        "export equal --rosbag",
        "export team --scenario=taken.toml --rosbag",
    ];
    for (name, robots) in [
        ("digit", r#"{ name = "blue" }, { name = "3po" }"#),
        ("equal", r#"{ name = "r-2" }, { name = "r_2" }"#),
        ("team", r#"{ name = "alliance" }"#),
    ] {
        let scenario = format!("name = \"{name}\"\nrobots = [{robots}]\n[waste]\n");
        lab.write(&format!("{name}.toml"), scenario);
        let mission = format!("{name}.toml --limit 2 --log off --in-process");
        lab.mission(name, mission).expect(1);
    }
    let answers = commands.map(|command| {
        let answer = entry(command, &lab.refusal(command));
        assert_eq!(lab.names("run"), before, "{command}");
        assert!(!lab.path("taken.toml").exists(), "{command}");
        answer
    });
    insta::assert_snapshot!(answers.concat());
    assert!(lab.names("").iter().all(|name| !name.starts_with('.')));
}

#[test]
fn a_run_that_this_program_does_not_reproduce_has_no_recording() {
    let lab = Lab::new();
    let mission = "--limit 2 --in-process --mcap";
    lab.mission("run", mission).expect(1);
    let before = lab.bytes("run/run.mcap");
    let hash = lab.log("run").run.hash.unwrap();
    let tampered = lab.text("run/run.json").replace(&hash, "0123456789abcdef");
    lab.write("run/run.json", tampered);
    let names = lab.names("run");
    let line = lab.run("export run --mcap").expect(1).stderr;
    assert_eq!(line.lines().count(), 1, "{line}");
    let reason =
        "alliance export: run/run.mcap: this program does not reproduce the logged run exactly";
    assert!(line.starts_with(reason), "{line}");
    assert!(before == lab.bytes("run/run.mcap"));
    assert_eq!(lab.names("run"), names);
    // The export of tables does not depend on a replay.
    lab.run("export run --parquet").expect(0);
}

#[test]
fn a_run_whose_recording_cannot_be_written_fails_at_its_end() {
    let lab = Lab::new();
    std::fs::create_dir_all(lab.path("run/run.mcap")).unwrap();
    let finished = lab.mission("run", "--limit 2 --mcap").expect(3);
    let last = finished.stderr.lines().last().unwrap();
    assert_eq!(
        last,
        "alliance run: --mcap: cannot write run/run.mcap: Is a directory (os error 21)"
    );
    // The run folder is complete.
    assert!(finished.stderr.contains("time-limit: "));
    assert!(lab.log("run").run.hash.is_some());
}

/// Without room for a byte, each format ends with one line that names the file and the cause. Older files stay, and no
/// temporary file is left.
#[test]
fn a_file_that_does_not_fit_is_named_once() {
    let lab = Lab::new();
    let mission = "l-alliance-abstract --limit 2 --log compact --in-process";
    lab.mission("run", mission).expect(1);
    lab.write("old.gif", "old");
    std::fs::create_dir(lab.path("new")).unwrap();
    for (command, path) in [
        ("export run --mcap=new/a.mcap", "new/a.mcap"),
        ("export run --rosbag=new/bag", "new/bag"),
        ("export run --parquet=new", "new/motivations.parquet"),
        ("export run --scenario=new/a.toml", "new/a.toml"),
        ("export run --html=new/a.html", "new/a.html"),
        ("export run --instance=new/a.json", "new/a.json"),
        ("export run --svg --out new", "new/room-at-2s.svg"),
        ("export run --png --out new", "new/room-at-2s.png"),
        ("export run --video new/a.webp --fps 1", "new/a.webp"),
        ("export run --video old.gif --fps 1", "old.gif"),
        ("replay run --out new", "new/motivations.csv"),
        ("report run --out new", "new/robots.csv"),
    ] {
        let output = Command::new("sh")
            .args(["-c", "ulimit -f 0; exec \"$0\" \"$@\""])
            .arg(alliance())
            .args(command.split(' '))
            .current_dir(lab.path(""))
            .output()
            .unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{command}: {stderr}");
        let lines = stderr.lines().filter(|line| line.contains("too large"));
        let name = command.split(' ').next().unwrap_or_default();
        let line = format!("alliance {name}: cannot write {path}: File too large (os error 27)");
        assert_eq!(lines.collect::<Vec<_>>(), [line], "{command}");
        assert_eq!(lab.names("new"), [""; 0], "{command}");
    }
    assert_eq!(lab.text("old.gif"), "old");
}
