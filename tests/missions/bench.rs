//! `alliance bench`: a result of the suite v1 by the program, its check, and refusals.

use alliance_tests::harness::Lab;

/// The number of runs of the suite for each allocator.
const RUNS: usize = 180;

#[test]
fn a_result_has_the_hashes_of_single_runs_and_is_checked() {
    let lab = Lab::new();
    lab.write(
        "page.md",
        "Before.\n<!-- bench v1 -->\n<!-- end -->\nAfter.\n",
    );
    let command = "bench v1 --allocator nearest-silent --out own --table page.md";
    lab.run(command)
        .expect(0)
        .shows("check    alliance bench check own/result.json");
    let result = lab.json("own/result.json");
    let runs = result["runs"].as_array().unwrap();
    assert_eq!(runs.len(), RUNS);
    let first = ["mission", "faults", "allocator"].map(|key| runs[0][key].as_str().unwrap());
    assert_eq!(first, ["clean-up", "none", "nearest-silent"]);
    let single =
        "run waste-cleanup --in-process --allocator nearest-silent --seed 1 --limit 1200 --out one";
    lab.run(single).expect(0);
    assert_eq!(lab.json("one/run.json")["hash"], runs[0]["hash"]);

    // A second command finds all runs in the journal, and writes the same bytes.
    let (before, page) = (lab.bytes("own/result.json"), lab.text("page.md"));
    lab.run(command).expect(0).shows("180 of them done before");
    assert_eq!(lab.bytes("own/result.json"), before);
    assert_eq!(lab.text("page.md"), page);
    let row = page
        .lines()
        .find(|line| line.starts_with("| `nearest-silent` |"));
    assert!(
        row.is_some() && page.starts_with("Before.\n") && page.ends_with("\nAfter.\n"),
        "{page}"
    );

    lab.run("bench check own/result.json")
        .expect(0)
        .shows("suite v1, 1 allocator: 2 of 180 runs repeated, 0 differ");

    // Forgeries of the file; a forger who also updates the digest is a unit test.
    let forged = |place: &str, value: serde_json::Value, expected: &str| {
        let mut forged = result.clone();
        *forged.pointer_mut(place).unwrap() = value;
        lab.write("forged.json", forged.to_string());
        let line = lab.refusal("bench check forged.json");
        assert!(line.contains(expected), "{line}");
    };
    let changed = "the result was changed after the runs";
    forged("/runs/7/value", 1.5.into(), changed);
    forged("/runs/7/hash", "0123456789abcdef".into(), changed);
    forged(
        "/runs/7/seed",
        9.into(),
        "runs[7] is (clean-up, killed, nearest-silent, seed 9), but v1 has",
    );
    forged(
        "/suite",
        "v0".into(),
        "forged.json: there is no suite 'v0'; did you mean 'v1'?",
    );
    forged(
        "/build",
        "0123456789abcdef".into(),
        "check it with the program that made it",
    );
    forged(
        "/runs/7/outcome",
        "won".into(),
        "this is no result of alliance bench: unknown variant `won`",
    );
}

#[test]
fn mistakes_give_one_line_and_create_no_files() {
    let lab = Lab::new();
    lab.write("page.md", "No markers.\n");
    for (arguments, expected) in [
        ("bench v2", "there is no suite 'v2'; did you mean 'v1'?"),
        (
            "bench v1 --allocator neerest",
            "there is no allocator 'neerest'; did you mean 'nearest'?",
        ),
        (
            "bench v1 --table page.md",
            "page.md: there are no lines <!-- bench v1 --> and <!-- end -->",
        ),
        ("bench check none.json", "none.json"),
        (
            "bench check page.md",
            "page.md: this is no result of alliance bench: expected",
        ),
        (
            "bench check page.md --share 0",
            "use a number above 0, up to 100",
        ),
    ] {
        let line = lab.refusal(arguments);
        assert!(line.contains(expected), "{line}");
    }
    assert!(!lab.exists("bench"));
}
