//! The standing campaigns, such as `alliance sweep campaigns/faults.toml`: a fixed part of each, and the command that
//! repeats a run.

use alliance_tests::harness::{Lab, join};
use alliance_tests::testkit::campaign;

/// Each campaign with the number of runs in its part, which is every 1,000th run.
const CAMPAIGNS: [(&str, usize); 4] = [
    ("faults", 20),
    ("service", 10),
    ("push", 10),
    ("observe", 10),
];

#[test]
fn a_fixed_part_of_each_campaign_has_no_invariant_violation() {
    let lab = Lab::new();
    for (name, runs) in CAMPAIGNS {
        let plan = campaign(name);
        let part = ["sweep", &plan, "--shard", "0/1000", "--out", name];
        lab.run(part).expect(0).shows(&format!("{runs} runs done"));
        assert!(!lab.exists(&format!("{name}/failures")));
    }
}

#[test]
fn the_printed_command_repeats_a_run_of_the_campaign() {
    let lab = Lab::new();
    let plan = campaign("faults");
    let run_12 = ["sweep", &plan, "--scenario", "12"];
    let printed = lab.run(run_12).expect(0);
    lab.write("run-12.toml", &printed.stdout);
    let (_, again) = printed.stderr.split_once(": alliance ").unwrap();
    let expected = "run run-12.toml --seed 13 --in-process --check";
    assert_eq!(again.trim_end(), expected);
    let result = lab.run(join(again, "--json"));
    assert!(!result.stderr.contains("violated"), "{}", result.stderr);
}
