//! The standing campaign, `alliance sweep campaigns/faults.toml`: a fixed part of it, and how it tells what it finds.

use std::fs;
use std::path::Path;

use crate::harness::Lab;

/// Every so many-th run of the campaign.
const SHARD: &str = "0/400";

fn plan() -> String {
    campaign("faults.toml")
}

fn campaign(name: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let file = root.join("campaigns").join(name);
    file.to_str().unwrap().to_owned()
}

#[test]
fn nothing_that_must_hold_is_violated_in_a_fixed_part_of_the_campaign() {
    let lab = Lab::new();
    let said = lab
        .run(&["sweep", &plan(), "--shard", SHARD, "--out", "part"])
        .expect(0)
        .stderr;
    assert!(said.contains("all 50 runs are done"), "{said}");
    assert!(!lab.path("part/failures").exists());
}

/// The same of bars, `alliance sweep campaigns/push.toml`.
#[test]
fn nothing_is_violated_in_a_fixed_part_of_the_campaign_of_push() {
    let lab = Lab::new();
    let plan = campaign("push.toml");
    let said = lab
        .run(&["sweep", &plan, "--shard", SHARD, "--out", "part"])
        .expect(0)
        .stderr;
    assert!(said.contains("all 25 runs are done"), "{said}");
    assert!(!lab.path("part/failures").exists());
}

#[test]
fn a_run_of_the_campaign_is_repeated_by_the_command_that_is_printed() {
    let lab = Lab::new();
    let printed = lab.run(&["sweep", &plan(), "--scenario", "12"]).expect(0);
    fs::write(lab.path("run-12.toml"), &printed.stdout).unwrap();
    let (_, again) = printed.stderr.split_once(": alliance ").unwrap();
    assert_eq!(
        again.trim_end(),
        "run run-12.toml --seed 13 --in-process --check"
    );
    let mut again: Vec<&str> = again.split_whitespace().collect();
    again.push("--json");
    let result = lab.run(&again);
    assert!(!result.stderr.contains("violated"), "{}", result.stderr);
}
