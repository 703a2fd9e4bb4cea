//! What cannot be exported is refused in one line, and leaves everything as it was.

use super::{bytes, files};
use crate::harness::Lab;

/// What the command says, in one line, when it ends with this status.
#[track_caller]
fn refusal(lab: &Lab, arguments: &[&str], status: i32) -> String {
    let said = lab.run(arguments).expect(status).stderr;
    assert_eq!(said.lines().count(), 1, "{said}");
    said.trim_end().to_owned()
}

#[test]
fn arguments() {
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
            &["nowhere is not the folder of a run: cannot read nowhere/run.json: No such file"],
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
        let said = refusal(&lab, arguments, 2);
        for text in texts {
            assert!(said.contains(text), "no '{text}' for {arguments:?}: {said}");
        }
        assert!(said.starts_with("alliance"), "{said}");
        assert_eq!(files(&lab, "run"), before, "{arguments:?}");
    }
    assert!(files(&lab, "").iter().all(|name| !name.starts_with('.')));
}

#[test]
fn a_run_that_this_program_does_not_repeat_has_no_recording() {
    let lab = Lab::new();
    lab.mission("run", &["--limit", "2", "--in-process", "--mcap"])
        .expect(1);
    let before = bytes(&lab, "run/run.mcap");
    let run = lab.path("run/run.json");
    let text = std::fs::read_to_string(&run).unwrap();
    let hash = lab.log("run").run.hash.unwrap();
    std::fs::write(&run, text.replace(&hash, "0123456789abcdef")).unwrap();
    let files_before = files(&lab, "run");
    let said = refusal(&lab, &["export", "run", "--mcap"], 1);
    assert!(
        said.starts_with(
            "alliance export: run/run.mcap: this program does not repeat the logged run exactly"
        ),
        "{said}"
    );
    assert!(before == bytes(&lab, "run/run.mcap"));
    assert_eq!(files(&lab, "run"), files_before);
    // Its tables are what they are.
    lab.run(&["export", "run", "--parquet"]).expect(0);
}

#[test]
fn a_run_whose_recording_cannot_be_written_has_failed_at_its_end() {
    let lab = Lab::new();
    std::fs::create_dir_all(lab.path("run/run.mcap")).unwrap();
    let finished = lab.mission("run", &["--limit", "2", "--mcap"]).expect(3);
    let last = finished.stderr.lines().last().unwrap();
    assert_eq!(
        last,
        "alliance run: --mcap: cannot write run/run.mcap: Is a directory (os error 21)"
    );
    // The run itself is there.
    assert!(finished.stderr.contains("time-limit: "));
    assert!(lab.log("run").run.hash.is_some());
}
