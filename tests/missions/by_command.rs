//! `alliance run`, start to end.

use crate::harness::Lab;

#[test]
fn the_default_mission_completes_and_every_item_is_delivered() {
    let lab = Lab::new();
    let finished = lab.mission("run", &["--json"]).expect(0);
    let result: serde_json::Value = serde_json::from_str(&finished.stdout).unwrap();
    assert_eq!(result["outcome"], "complete");
    assert_eq!(result["unscripted"], false);
    assert_eq!(result["result"]["items"]["delivered"], 24);
}
