//! Bad files: one line each, with the file and the line.

use super::*;

/// Returns the error for a text with a part replaced.
fn refusal(name: &str, text: &str, old: &str, new: &str) -> String {
    assert!(text.contains(old), "{old}");
    let broken = text.replacen(old, new, 1);
    let refused = import(name, &broken, &Options::default())
        .unwrap_err()
        .to_string();
    assert_eq!(refused.lines().count(), 1, "{refused}");
    format!("{old:?} -> {new:?}\n    {refused}\n")
}

fn refusals(name: &str, text: &str, changes: &[(&str, &str)]) -> String {
    let lines = changes
        .iter()
        .map(|(old, new)| refusal(name, text, old, new));
    lines.collect()
}

#[test]
fn bad_vehicle_routing_files_are_refused() {
    let solomon = refusals(
        "small4.txt",
        SOLOMON,
        &[
            ("  2         50", "  two       50"),
            ("  2         50", "  0         50"),
            ("  2         50", "  1000000000000 50"),
            (
                "    1      45         68         10",
                "    1      45         68         ten",
            ),
            (
                "    4      20         50         20         100      200         10",
                "    4      20",
            ),
            ("         50       150 ", "        250       150 "),
            ("    2      45 ", "    1      45 "),
            (
                "    0      40         50          0          0       300          0",
                "",
            ),
            ("CUSTOMER", "CUSTOMERS"),
        ],
    );
    let vrplib = refusals(
        "tiny.vrp",
        VRPLIB,
        &[
            ("DIMENSION : 4", "DIMENSION : 5"),
            ("CAPACITY : 10", "CAPACITY : ten"),
            ("CAPACITY : 10", "CAPACITY"),
            ("3 49 49", "3 49"),
            ("3 49 49", "2 49 49"),
            ("3 49 49", "3 49 nan"),
            ("3 3\n", "9 3\n"),
            ("\n1\n-1", "\n7\n-1"),
            ("NODE_COORD_SECTION", "EDGE_WEIGHT_SECTION"),
            ("NAME : tiny-n4-k2", "NAME : tiny"),
            ("DEMAND_SECTION\n1 0\n2 7\n3 3\n4 5\n", ""),
            ("4 5\n", ""),
            ("CAPACITY : 10\n", ""),
            ("TYPE : CVRP", "TYPE : VRPTW"),
        ],
    );
    let cordeau = refusals(
        "pr.txt",
        CORDEAU,
        &[
            ("6 2 3 2\n", "1 2 3 2\n"),
            ("6 2 3 2\n", "6 2 4 2\n"),
            ("6 2 3 2\n", "6 2 2 2\n"),
            ("3 51.64 5.47 21 16 1 2 1 2 389 483", "3 51.64"),
        ],
    );
    insta::assert_snapshot!(solomon + &vrplib + &cordeau);
}

#[test]
fn bad_json_and_yaml_files_are_refused() {
    let json = refusals(
        "two.json",
        JSON,
        &[
            ("\"work_s\": 8", "\"work_s\": \"8\""),
            ("\"work_s\": 8", "\"work_min\": 8"),
            ("\"work_s\": 8, ", ""),
            ("\"id\": \"b\"", "\"id\": \"a\""),
            ("\"id\": \"b\"", "\"id\": \"\""),
            ("\"y_m\": 3,", "\"y_m\": 3"),
            ("\"opens_s\": 30", "\"opens_s\": 95"),
            ("\"deadline_s\": 90", "\"deadline_s\": -1"),
            ("\"priority\": 2", "\"after\": [\"b\"]"),
            ("\"priority\": 2", "\"after\": [\"A\"]"),
            ("\"y_m\": 0", "\"y_cm\": 0"),
            ("\"y_m\": 0", "\"skills\": {\"arms\": 1}"),
            ("\"blue\"", "\"my robot\""),
            ("\"blue\"", "\"world\""),
            ("\"speed_m_s\": 0.4", "\"speed_m_s\": 0"),
            ("\"name\": \"two\"", "\"names\": \"two\""),
        ],
    );
    let yaml = refusals(
        "list.yaml",
        YAML,
        &[
            ("x_m: 4", "x_m: four"),
            ("  y_m: 3.5\n", ""),
            ("deliver_to: [2, 2]", "deliver_to: [2]"),
            ("deliver_to: [2, 2]}", "deliver_to: [2, 2]"),
            ("x_m: 4", "x_m: 4"),
        ],
    );
    insta::assert_snapshot!(json + &yaml);
}

#[test]
fn bad_sadcher_files_are_refused() {
    let lines = refusals(
        "p1.json",
        SADCHER,
        &[
            ("[1, 0], [1, 1]]", "[1, 0], [1]]"),
            ("[0, 0], [1, 0]", "[0, 0], [2, 0]"),
            ("[0, 50, 60, 70.0, 0]", "[0, 50, 60, 0]"),
            ("[1, 3]", "[1, 9]"),
            ("[1, 3]", "[1, 3], [3, 1]"),
            ("    [90, 90],\n", "    [90],\n"),
            ("[1, 0], [1, 1]],", "[1, 0], [1, 0]],"),
            ("\"T_t\"", "\"T_x\""),
        ],
    );
    insta::assert_snapshot!(lines);
}

#[test]
fn bad_csv_files_are_refused() {
    let lines = refusals(
        "rows.csv",
        CSV,
        &[
            ("x_m", "x_cm"),
            ("work_s", "work_min"),
            (",work_s", ""),
            ("value", "id"),
            ("c1,4,5.5,10", "c1,4,,10"),
            ("c1,4,5.5,10", "c1,4,5.5,ten"),
            ("c1,4,5.5,10", "c1,4,5.5,-10"),
            ("c1,4,5.5,10", "c1,inf,5.5,10"),
            ("task,c2", "tusk,c2"),
            ("arm=2,,c1", "arm=two,,c1"),
            ("arm=2,,c1", "leg=2,,c1"),
            ("arm=2,,c1", "arm=2,,c4"),
            ("arm=2,,c1", "arm=2,,c3"),
            ("arm=2,,c1,,", "arm=2,,c1"),
            ("arm=2,,c1,,", "arm=2,,c1,arm,"),
            ("robot,blue,1,1,,", "robot,blue,1,1,5,"),
            ("robot,blue,1,1", "robot,blue,1,"),
            ("robot,gold", "robot,blue"),
            ("camera=0.5", "camera=-0.5"),
        ],
    );
    insta::assert_snapshot!(lines);
}

#[test]
fn files_without_robots_or_with_too_many_statements_are_refused() {
    let robots = Options {
        robots: Some(3),
        ..Options::default()
    };
    let cases = [
        import("list.yaml", YAML, &Options::default()),
        import("two.json", JSON, &robots),
        import("notes.txt", "hello\n", &robots),
        import("empty.csv", "id,x_m,y_m,work_s\n", &robots),
        import("empty.json", "", &robots),
        import("empty.json", "[]", &robots),
        import("empty.yaml", "", &robots),
    ];
    let lines = cases.map(|case| format!("{}\n", case.unwrap_err()));
    insta::assert_snapshot!(lines.concat());
}
