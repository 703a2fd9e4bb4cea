//! The standing campaigns, `alliance sweep campaigns/faults.toml` and those of other missions: a fixed part of each, and how they
//! tell what they find.

use std::fs;
use std::path::Path;

use crate::harness::Lab;

/// Every so many-th run of a campaign.
const SHARD: &str = "0/400";

/// Each campaign, and how many runs its part has.
const CAMPAIGNS: [(&str, usize); 4] = [
    ("faults", 50),
    ("service", 25),
    ("push", 25),
    ("observe", 25),
];

fn plan(campaign: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let file = root.join(format!("campaigns/{campaign}.toml"));
    file.to_str().unwrap().to_owned()
}

#[test]
fn nothing_that_must_hold_is_violated_in_a_fixed_part_of_the_campaign() {
    let lab = Lab::new();
    for (campaign, runs) in CAMPAIGNS {
        let plan = plan(campaign);
        let said = lab.run(&["sweep", &plan, "--shard", SHARD, "--out", campaign]);
        let said = said.expect(0).stderr;
        assert!(
            said.contains(&format!("all {runs} runs are done")),
            "{said}"
        );
        assert!(!lab.path(campaign).join("failures").exists());
    }
}

#[test]
fn a_run_of_the_campaign_is_repeated_by_the_command_that_is_printed() {
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
