//! An export that is impossible is refused in one line and changes no file.

use super::{bytes, files};
use crate::harness::Lab;

/// Returns the one-line error of a command that ends with `status`.
#[track_caller]
fn refusal(lab: &Lab, arguments: &[&str], status: i32) -> String {
    let stderr = lab.run(arguments).expect(status).stderr;
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    stderr.trim_end().to_owned()
}

#[test]
fn wrong_arguments_are_refused_in_one_line() {
    let lab = Lab::new();
    lab.mission("run", &["--limit", "2", "--log", "off", "--in-process"])
        .expect(1);
    let before = files(&lab, "run");
    std::fs::create_dir_all(lab.path("taken.mcap")).unwrap();
    for (arguments, texts) in [
        (&["export"][..], &["<DIR>", "--mcap"][..]),
        (&["export", "run"], &["required", "--mcap", "--parquet"]),
        (&["export", "--mcap"], &["required", "<DIR>"]),
        (&["export", "run", "--mcpa"], &["'--mcpa'", "'--mcap'"]),
        (&["export", "run", "--csv"], &["'--csv'"]),
        (
            &["export", "nowhere", "--mcap"],
            &["nowhere is not a run folder: cannot read nowhere/run.json: No such file"],
        ),
        (
            &["export", "run", "--parquet"],
            &["--log off", "--log full"],
        ),
        (
            &["export", "run", "--mcap=no/such/folder.mcap"],
            &["cannot write no/such/folder.mcap: No such file or directory (os error 2)"],
        ),
        (
            &["export", "run", "--mcap=taken.mcap"],
            &["cannot write taken.mcap: Is a directory (os error 21)"],
        ),
    ] {
        let line = refusal(&lab, arguments, 2);
        for text in texts {
            assert!(line.contains(text), "no '{text}' for {arguments:?}: {line}");
        }
        assert!(line.starts_with("alliance"), "{line}");
        assert_eq!(files(&lab, "run"), before, "{arguments:?}");
    }
    assert!(files(&lab, "").iter().all(|name| !name.starts_with('.')));
}

#[test]
fn a_run_that_this_program_does_not_reproduce_has_no_recording() {
    let lab = Lab::new();
    lab.mission("run", &["--limit", "2", "--in-process", "--mcap"])
        .expect(1);
    let before = bytes(&lab, "run/run.mcap");
    let run = lab.path("run/run.json");
    let text = std::fs::read_to_string(&run).unwrap();
    let hash = lab.log("run").run.hash.unwrap();
    std::fs::write(&run, text.replace(&hash, "0123456789abcdef")).unwrap();
    let files_before = files(&lab, "run");
    let line = refusal(&lab, &["export", "run", "--mcap"], 1);
    assert!(
        line.starts_with(
            "alliance export: run/run.mcap: this program does not reproduce the logged run exactly"
        ),
        "{line}"
    );
    assert!(before == bytes(&lab, "run/run.mcap"));
    assert_eq!(files(&lab, "run"), files_before);
    // The export of tables does not depend on a replay.
    lab.run(&["export", "run", "--parquet"]).expect(0);
}

#[test]
fn a_run_whose_recording_cannot_be_written_fails_at_its_end() {
    let lab = Lab::new();
    std::fs::create_dir_all(lab.path("run/run.mcap")).unwrap();
    let finished = lab.mission("run", &["--limit", "2", "--mcap"]).expect(3);
    let last = finished.stderr.lines().last().unwrap();
    assert_eq!(
        last,
        "alliance run: --mcap: cannot write run/run.mcap: Is a directory (os error 21)"
    );
    // The run folder is complete.
    assert!(finished.stderr.contains("time-limit: "));
    assert!(lab.log("run").run.hash.is_some());
}
