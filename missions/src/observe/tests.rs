//! Teams without processes.

use scenario::Scenario;

use crate::Registry;

pub(super) fn scenario(lines: &str) -> Scenario {
    let text = format!("[observe]\n{lines}\n");
    match Scenario::parse("o.toml", &text, &Registry::built_in().vocabulary()) {
        Ok(scenario) => scenario,
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn observe_satisfies_the_laws_of_every_mission() {
    for policy in ["fixed", "random", "local", "a-cmommt"] {
        let text = format!("[observe]\nn = 8\nduration_s = 40\npolicy = '{policy}'\n");
        crate::testkit::check_mission(super::MISSION, &text);
    }
}
