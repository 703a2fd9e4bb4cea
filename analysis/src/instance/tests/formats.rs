//! Each format as a scenario. Numbers were computed by hand from the texts.

use missions::service::data::points;

use super::*;
use crate::instance::formats::Format;
use crate::instance::model::Instance;

fn scenario_text(converted: &Converted) -> &str {
    &converted.written.text
}

#[test]
fn a_solomon_file_becomes_points_with_windows() {
    insta::assert_snapshot!(scenario_text(&imported("small4.txt", SOLOMON)));
}

#[test]
fn a_vrplib_file_takes_the_vehicles_from_its_name() {
    let converted = imported("tiny.vrp", VRPLIB);
    insta::assert_snapshot!(scenario_text(&converted));
    let fleet = with_robots("tiny.vrp", VRPLIB, 3).unwrap();
    assert_eq!(fleet.scenario.robots.len(), 3);
}

#[test]
fn a_cordeau_file_has_vehicles_at_each_depot() {
    let converted = imported("pr.txt", CORDEAU);
    insta::assert_snapshot!(scenario_text(&converted));
    let three = with_robots("pr.txt", CORDEAU, 3).unwrap();
    assert_eq!(three.scenario.robots.len(), 3);
}

#[test]
fn a_sadcher_file_becomes_tasks_with_skills() {
    insta::assert_snapshot!(scenario_text(&imported("p1.json", SADCHER)));
}

#[test]
fn a_csv_file_has_tasks_and_robots() {
    insta::assert_snapshot!(scenario_text(&imported("rows.csv", CSV)));
    let tabs = CSV.replace(',', "\t");
    let semicolons = CSV.replace(',', ";");
    for text in [
        tabs,
        semicolons,
        format!("\u{feff}{CSV}"),
        CSV.replace('\n', "\r\n"),
    ] {
        assert_eq!(
            imported("rows.csv", &text).loaded.instance,
            imported("rows.csv", CSV).loaded.instance
        );
    }
}

#[test]
fn json_and_yaml_have_the_same_layout() {
    insta::assert_snapshot!(scenario_text(&imported("two.json", JSON)));
    let as_yaml = "\
name: two
speed_m_s: 0.4
tasks:
  - {id: a, x_m: -2.5, y_m: 3, work_s: 8, opens_s: 30, deadline_s: 90}
  - id: b
    x_m: 3
    y_m: 2
    work_s: 4
    kind: arm
    priority: 2
robots:
  - {id: blue, x_m: 0, y_m: 0}
";
    let (json, yaml) = (imported("two.json", JSON), imported("two.yaml", as_yaml));
    assert_eq!(json.loaded.instance, yaml.loaded.instance);
    assert_eq!(yaml.loaded.task_lines, [4, 5]);
    assert_eq!(json.loaded.task_lines, [5, 6]);
    // JSON is YAML, too.
    let by_yaml = Format::Yaml
        .read(Source {
            name: "two.json",
            text: JSON,
        })
        .unwrap();
    assert_eq!(
        by_yaml.instance,
        Format::Json
            .read(Source {
                name: "",
                text: JSON
            })
            .unwrap()
            .instance
    );
}

#[test]
fn a_list_of_tasks_needs_a_number_of_robots() {
    let converted = with_robots("list.yaml", YAML, 2).unwrap();
    insta::assert_snapshot!(scenario_text(&converted));
    let json = r#"[{"id": "a", "x_m": 4, "y_m": 3.5, "work_s": 8}]"#;
    assert_eq!(
        with_robots("list.json", json, 2)
            .unwrap()
            .scenario
            .robots
            .len(),
        2
    );
}

#[test]
fn the_format_follows_from_name_and_content() {
    for (name, text, format) in [
        ("a.txt", SOLOMON, Format::Vrplib),
        ("a.txt", VRPLIB, Format::Vrplib),
        ("pr01", CORDEAU, Format::Vrplib),
        ("a.json", SADCHER, Format::Sadcher),
        ("a", SADCHER, Format::Sadcher),
        ("a.json", JSON, Format::Json),
        ("a", JSON, Format::Json),
        ("a.csv", CSV, Format::Csv),
        ("a", CSV, Format::Csv),
        ("a.yml", YAML, Format::Yaml),
    ] {
        assert_eq!(Format::guess(Source { name, text }), Ok(format), "{name}");
    }
}

/// The largest instances that the contract names.
#[test]
fn a_thousand_tasks_and_a_hundred_robots_are_accepted() {
    let mut text = String::from("type,id,x_m,y_m,work_s,opens_s,deadline_s\n");
    for robot in 0..100 {
        text += &format!("robot,r{robot},{},{},,,\n", robot % 10 + 1, robot / 10 + 1);
    }
    for task in 0..1000 {
        let (x, y) = (task % 40, task / 40);
        text += &format!(
            "task,t{task},{},{},{},{},{}\n",
            12 + 4 * x,
            2 + 4 * y,
            5 + task % 7,
            task,
            task + 500
        );
    }
    let converted = imported("large.csv", &text);
    assert_eq!(points(&converted.scenario, 1).len(), 1000);
    assert_eq!(converted.scenario.robots.len(), 100);
}

#[test]
fn an_instance_is_its_own_json() {
    for (name, text) in [("p1.json", SADCHER), ("rows.csv", CSV), ("two.json", JSON)] {
        let instance = imported(name, text).loaded.instance;
        let json = serde_json::to_string(&instance).unwrap();
        assert_eq!(
            serde_json::from_str::<Instance>(&json).unwrap(),
            instance,
            "{name}"
        );
    }
}
