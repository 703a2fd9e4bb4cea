//! The run folder: each documented file, header line and key.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::harness::Lab;

const HEADERS: [(&str, &str); 6] = [
    (
        "motivations.csv",
        "t_ms,robot,behavior_set,task,motivation,impatience,sensory_feedback,activity_suppression,impatience_reset,acquiescence,state",
    ),
    (
        "messages.csv",
        "t_ms,receiver,sender,incarnation,seq,kind,state,since_ms,behavior_set,task,progress,sent_ms,fate",
    ),
    ("events.csv", "t_ms,kind,robot,subject,reason,detail"),
    (
        "poses.csv",
        "t_ms,robot,x_m,y_m,heading_rad,speed_m_s,carrying,behavior_set,energy",
    ),
    (
        "mission.csv",
        "t_ms,items_in_spills,items_carried,items_on_floor,items_delivered,last_report_ms",
    ),
    ("ticks.csv", "t_ms,tick,robot,section,hash"),
];

fn names(lab: &Lab, folder: &str) -> BTreeSet<String> {
    let entries = std::fs::read_dir(lab.path(folder)).unwrap();
    entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect()
}

fn set(names: &[&str]) -> BTreeSet<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn keys(object: &Value) -> BTreeSet<String> {
    object.as_object().unwrap().keys().cloned().collect()
}

fn json(lab: &Lab, file: &str) -> Value {
    serde_json::from_slice(&std::fs::read(lab.path(file)).unwrap()).unwrap()
}

#[test]
fn a_run_folder_has_the_documented_files_and_headers() {
    let lab = Lab::new();
    lab.mission("run", &["--limit", "5"]).expect(1);
    let tables = HEADERS.map(|(table, _)| table);
    let mut files = set(&tables);
    files.extend(set(&["run.json", "host.json", "inputs.jsonl", "logs"]));
    assert_eq!(names(&lab, "run"), files);
    assert_eq!(
        names(&lab, "run/logs"),
        set(&["world.log", "blue.log", "gold.log", "green.log"])
    );
    for (table, header) in HEADERS {
        let text = std::fs::read_to_string(lab.path("run").join(table)).unwrap();
        assert_eq!(text.lines().next(), Some(header), "{table}");
        assert!(text.lines().count() > 1, "{table} has no row");
    }
}

#[test]
fn run_json_has_the_documented_keys() {
    let lab = Lab::new();
    lab.mission("run", &["--limit", "5", "--seed", "4"])
        .expect(1);
    let run = json(&lab, "run/run.json");
    assert_eq!(
        keys(&run),
        set(&[
            "version",
            "log",
            "hash",
            "outcome",
            "unscripted",
            "result",
            "seed",
            "scenario",
            "alliance"
        ])
    );
    assert_eq!(run["seed"], 4);
    assert_eq!(run["outcome"], "time-limit");
    assert_eq!(run["scenario"]["limit_s"], 5.0);
    let alliance = &run["alliance"];
    assert_eq!(
        keys(alliance),
        set(&["threshold", "step_ms", "switches", "robots"])
    );
    assert_eq!(keys(&alliance["robots"]), set(&["blue", "gold", "green"]));
    for (rank, robot) in ["blue", "gold", "green"].into_iter().enumerate() {
        let robot = &alliance["robots"][robot];
        assert_eq!(keys(robot), set(&["rank", "sets"]));
        assert_eq!(robot["rank"], rank);
        let mut sets = set(&[
            "find-locations-wander",
            "move-spill(top)",
            "move-spill(bottom)",
            "report-progress",
        ]);
        if rank == 0 {
            sets.insert("find-locations-methodical".to_owned());
        }
        assert_eq!(keys(&robot["sets"]), sets);
        for values in robot["sets"].as_object().unwrap().values() {
            assert_eq!(
                keys(values),
                set(&[
                    "task",
                    "broadcast_rate_hz",
                    "ceased_after_s",
                    "fast_impatience",
                    "slow_impatience",
                    "willing_to_affect_s",
                    "before_yielding_s",
                    "before_giving_up_s",
                ])
            );
            for by_teammate in ["slow_impatience", "willing_to_affect_s"] {
                assert_eq!(keys(&values[by_teammate]).len(), 2, "its two teammates");
            }
        }
    }
}

/// A parameter file as in the thesis (Fig. 3.4), with keys for a robot and a behavior set that this team lacks.
const PARAMETERS: &str = "\
threshold = 80

broadcastRate.report-progress = 2
timeAllowedTillCeased.report-progress = 7
timeWillingToAffect.gold.report-progress = 40
slowImpatience.gold.report-progress = 0.5
slowImpatience.gold.blue.report-progress = 0.25
fastImpatience.report-progress = 8
fastImpatience.green.report-progress = 9
timeBeforeYielding.report-progress = 55
timeBeforeGivingUp.report-progress = 66
fastImpatience.violet.report-progress = 3
slowImpatience.violet.report-progress = 0.5
timeBeforeYielding.sing = 5
";

#[test]
fn a_parameter_file_applies_and_its_unknown_keys_are_listed_once() {
    let lab = Lab::new();
    std::fs::write(lab.path("team.properties"), PARAMETERS).unwrap();
    let finished = lab
        .mission("run", &["--limit", "5", "--params", "team.properties"])
        .expect(1);
    let alliance = &json(&lab, "run/run.json")["alliance"];
    assert_eq!(alliance["threshold"], 80.0);
    for robot in ["blue", "gold", "green"] {
        let values = &alliance["robots"][robot]["sets"]["report-progress"];
        assert_eq!(values["broadcast_rate_hz"], 2.0, "{robot}");
        assert_eq!(values["ceased_after_s"], 7.0, "{robot}");
        assert_eq!(
            values["fast_impatience"],
            if robot == "green" { 9.0 } else { 8.0 }
        );
        assert_eq!(values["before_yielding_s"], 55.0, "{robot}");
        assert_eq!(values["before_giving_up_s"], 66.0, "{robot}");
        if robot != "gold" {
            assert_eq!(values["willing_to_affect_s"]["gold"], 40.0, "{robot}");
            let slow = if robot == "blue" { 0.25 } else { 0.5 };
            assert_eq!(values["slow_impatience"]["gold"], slow, "{robot}");
        }
    }
    for skipped in [
        "fastImpatience.violet.report-progress (line 12)",
        "slowImpatience.violet.report-progress (line 13)",
        "timeBeforeYielding.sing (line 14)",
    ] {
        assert_eq!(
            finished.stderr.matches(skipped).count(),
            1,
            "{skipped} in:\n{}",
            finished.stderr
        );
    }
    assert_eq!(
        finished.stderr.matches("(line ").count(),
        3,
        "{}",
        finished.stderr
    );
}
