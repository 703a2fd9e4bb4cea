//! The notebook example draws the values of the log.

use std::collections::BTreeMap;

use alliance_tests::harness::Lab;
use alliance_tests::python::python;
use alliance_tests::testkit::in_repository;
use run_log::MotivationRow;

use super::read;

#[test]
fn figure_4_9_shows_the_motivations_of_the_log() {
    let Some(python) = python(&["matplotlib", "pandas", "pyarrow"]) else {
        return;
    };
    let lab = Lab::new();
    let mission = "thesis-no-interruption --limit 150 --in-process";
    lab.mission("run", mission).expect(1);
    lab.run("export run --parquet").expect(0);
    let example = in_repository("docs/examples/fig_4_9.py");
    let arguments = [example.to_str().unwrap(), "run", "figure.png"];
    let drawn = read(&lab, &python, "read_figure.py", &arguments);
    let drawn: BTreeMap<String, Vec<(f64, f64)>> = serde_json::from_value(drawn).unwrap();

    let mut logged: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    for row in lab.log("run").rows::<MotivationRow>().unwrap() {
        if row.behavior_set == "move-spill(top)" {
            let point = (row.t_ms.as_secs_f64(), row.motivation);
            logged.entry(row.robot).or_default().push(point);
        }
    }
    assert_eq!(drawn, logged);
    assert_eq!(drawn["gold"].len(), 3000);
    let mut motivations = drawn["gold"].iter().map(|(_, motivation)| *motivation);
    assert!(motivations.any(|motivation| motivation == 100.0));
    let picture = lab.bytes("figure.png");
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 20_000);
}
