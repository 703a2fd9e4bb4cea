//! The standing campaigns, such as `alliance sweep campaigns/faults.toml`: a fixed part of each, and the command that
//! repeats a run.

use std::fs;
use std::path::Path;

use alliance_tests::harness::Lab;

/// The part of a campaign: every 1,000th run.
const SHARD: &str = "0/1000";

/// Each campaign with the number of runs in its part.
const CAMPAIGNS: [(&str, usize); 4] = [
    ("faults", 20),
    ("service", 10),
    ("push", 10),
    ("observe", 10),
];

fn plan(campaign: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let file = root.join(format!("campaigns/{campaign}.toml"));
    file.to_str().unwrap().to_owned()
}

#[test]
fn a_fixed_part_of_each_campaign_has_no_invariant_violation() {
    let lab = Lab::new();
    for (campaign, runs) in CAMPAIGNS {
        let plan = plan(campaign);
        let stderr = lab.run(&["sweep", &plan, "--shard", SHARD, "--out", campaign]);
        let stderr = stderr.expect(0).stderr;
        assert!(stderr.contains(&format!("{runs} runs done")), "{stderr}");
        assert!(!lab.path(campaign).join("failures").exists());
    }
}

#[test]
fn the_printed_command_repeats_a_run_of_the_campaign() {
    let lab = Lab::new();
    let printed = lab
        .run(&["sweep", &plan("faults"), "--scenario", "12"])
        .expect(0);
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
