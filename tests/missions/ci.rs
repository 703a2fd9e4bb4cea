//! The check before a merge (.ci/run).

use std::process::Command;

use alliance_tests::testkit::in_repository;

/// Runs the functions of the script with other parts. Returns the exit status and stdout.
fn check(parts: &str) -> (Option<i32>, String) {
    let path = in_repository(".ci/run");
    let script = std::fs::read_to_string(&path).unwrap();
    let (functions, _) = script.split_once("\npart format").unwrap();
    let script = format!("{functions}\n{parts}\n");
    let output = Command::new("bash")
        .args(["-c", &script])
        .arg(&path)
        .output()
        .unwrap();
    let stdout = String::from_utf8(output.stdout).unwrap();
    (output.status.code(), stdout)
}

#[test]
fn the_last_lines_list_the_parts_that_did_not_run() {
    let (status, all) = check("part first true");
    assert_eq!(status, Some(0), "{all}");
    assert!(all.ends_with("\nall checks passed\n"), "{all}");
    let left_out = "leave_out 'the second'\npart first true";
    let (status, others) = check(left_out);
    assert_eq!(status, Some(0), "{others}");
    let last = "\nnot run: the second\nall other checks passed\n";
    assert!(others.ends_with(last), "{others}");
    let (status, failed) = check(&format!("{left_out}\npart third false"));
    assert_eq!(status, Some(1), "{failed}");
    let last = "\nnot run: the second\nfailed with status 1\n";
    assert!(failed.ends_with(last), "{failed}");
}

/// Without the program or its database, the check of the advisories is listed.
#[test]
fn advisories_are_checked_or_listed() {
    let (status, output) = check("CARGO_TARGET_DIR=/nowhere\npart deny deny || true");
    assert_eq!(status, Some(0), "{output}");
    assert!(
        output.contains("\nnot run: advisories, because"),
        "{output}"
    );
}
