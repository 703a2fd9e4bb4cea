//! Changes of texts, and their drawings.

use serde_json::{Value, json};

use super::{EditRequest, edit};

const TEXT: &str = "# Mine.
name = \"mine\" # the name

# Behind the door.
[[obstacles]]
x_m = 5   # left
y_m = 4.0
width_m = 1
height_m = 0.5

[waste] # two spills
spill_radius_m = 0.7

# The team.
[[robots]]
name = \"blue\"
side_sensor = true
start = { x_m = 1.0, y_m = 2.0, heading_deg = 90 } # at the door

[[robots]]
name = \"gold\"
";

fn ask(request: &Value) -> Value {
    let request: EditRequest = serde_json::from_value(request.clone()).unwrap();
    edit(request)
}

fn of_text(text: &str, change: &Value) -> Value {
    ask(&json!({"choice": {"file": {"name": "mine.toml", "text": text}}, "change": change}))
}

#[track_caller]
fn changed(text: &str, change: &Value) -> String {
    let answer = of_text(text, change);
    let text = answer["text"].as_str();
    text.unwrap_or_else(|| panic!("{answer}")).to_owned()
}

/// Asserts that a change replaces one part of a text.
#[track_caller]
fn assert_replaced(change: &Value, old: &str, new: &str) {
    assert_eq!(TEXT.matches(old).count(), 1, "{old}");
    assert_eq!(changed(TEXT, change), TEXT.replace(old, new));
}

fn items(answer: &Value, kind: &str) -> Vec<Value> {
    let items = answer["drawing"]["items"].as_array().unwrap().iter();
    items.filter(|item| item["kind"] == kind).cloned().collect()
}

#[test]
fn a_number_changes_alone() {
    let set = |kind: &str, index: usize, values: Value| json!({"set": {"kind": kind, "index": index, "values": values}});
    assert_replaced(
        &set("obstacle", 0, json!({"x_m": 6.25, "y_m": 4})),
        "x_m = 5   #",
        "x_m = 6.25   #",
    );
    assert_replaced(
        &set("robot", 0, json!({"x_m": 3, "y_m": 2.5, "heading_deg": 45})),
        "{ x_m = 1.0, y_m = 2.0, heading_deg = 90 } #",
        "{ x_m = 3.0, y_m = 2.5, heading_deg = 45 } #",
    );
    assert_replaced(
        &set("robot", 1, json!({"x_m": 3, "y_m": 2.5})),
        "name = \"gold\"\n",
        "name = \"gold\"\nstart = { x_m = 3.0, y_m = 2.5 }\n",
    );
    // A quarter and half of the room of 12 m by 9 m.
    assert_replaced(
        &set("deposit", 0, json!({"x_m": 3, "y_m": 4.5})),
        "spill_radius_m = 0.7\n",
        "spill_radius_m = 0.7\n\n[waste.deposit]\nx_fraction = 0.25\ny_fraction = 0.5\n",
    );
}

#[test]
fn a_change_of_a_default_item_states_its_list() {
    let set = json!({"set": {"kind": "spill", "index": 1, "values": {"x_m": 3, "y_m": 4.5}}});
    assert_replaced(
        &set,
        "spill_radius_m = 0.7\n",
        "spill_radius_m = 0.7\n\n[[waste.spills]]\nname = \"top\"\nitems = 12\nx_fraction = 0.33333334\n\
         y_fraction = 0.6666667\n\n[[waste.spills]]\nname = \"bottom\"\nitems = 12\nx_fraction = 0.25\ny_fraction = 0.5\n",
    );
    let add = json!({"add": {"kind": "robot", "values": {"x_m": 3, "y_m": 4}}});
    let text = changed("", &add);
    let blocks = text.matches("[[robots]]").count();
    assert_eq!(blocks, 4, "{text}");
    assert!(
        text.ends_with("name = \"r1\"\nside_sensor = false\nstart = { x_m = 3.0, y_m = 4.0 }\n"),
        "{text}"
    );
    // A change that is none draws the same start of the run.
    let poses =
        |text: &str| of_text(text, &Value::Null)["drawing"]["view"]["robots"][0]["pose"].clone();
    assert_eq!(poses(&text), poses(""));
}

#[test]
fn items_are_added_and_deleted() {
    let add = json!({"add": {"kind": "obstacle", "values": {"x_m": 8, "y_m": 1, "width_m": 2, "height_m": 0.25}}});
    assert_replaced(
        &add,
        "height_m = 0.5\n",
        "height_m = 0.5\n\n[[obstacles]]\nx_m = 8.0\ny_m = 1.0\nwidth_m = 2.0\nheight_m = 0.25\n",
    );
    let delete = |kind: &str, index: usize| json!({"delete": {"kind": kind, "index": index}});
    assert_replaced(&delete("robot", 1), "\n[[robots]]\nname = \"gold\"\n", "");
    let without = changed(TEXT, &delete("obstacle", 0));
    assert!(
        without.contains("# The team.") && !without.contains("obstacles"),
        "{without}"
    );
    // The comment above the list stays.
    let with_two = changed(TEXT, &add);
    let second = changed(&with_two, &delete("obstacle", 0));
    assert!(
        second.contains("# Behind the door.\n[[obstacles]]\nx_m = 8.0"),
        "{second}"
    );
}

#[test]
fn lists_in_one_line_stay_in_one_line() {
    let text = "robots = [{ name = 'a', side_sensor = true }, { name = 'b' }] # all\nwaste = { border_known = true }\n";
    let add = json!({"add": {"kind": "robot", "values": {"x_m": 3, "y_m": 4}}});
    let start = "start = { x_m = 3.0, y_m = 4.0 }";
    let added = format!("{{ name = 'b' }}, {{ name = \"r1\", {start} }}] # all");
    assert_eq!(
        changed(text, &add),
        text.replace("{ name = 'b' }] # all", &added)
    );
    let add = json!({"add": {"kind": "spill", "values": {"x_m": 3, "y_m": 4.5}}});
    let with_spill = changed(text, &add);
    assert_eq!(with_spill.lines().count(), 2, "{with_spill}");
    assert_eq!(items(&of_text(&with_spill, &Value::Null), "spill").len(), 3);
    let delete = json!({"delete": {"kind": "robot", "index": 1}});
    assert_eq!(changed(text, &delete), text.replace(", { name = 'b' }", ""));
}

#[test]
fn blocks_of_several_robots_are_one_item() {
    let text = "[kinds.scout]\nside_sensor = true\nstart = { x_m = 6.0, y_m = 4.0 }\n[[robots]]\nkind = \"scout\"\ncount = 4\n\
                [[robots]]\nname = \"b\"\n";
    let drawn = of_text(text, &Value::Null);
    let robots = items(&drawn, "robot");
    assert_eq!(robots.len(), 2);
    assert_eq!(robots[0]["label"], "robots scout1 to scout4");
    assert_eq!(robots[0]["outlines"].as_array().unwrap().len(), 4);
    assert_eq!(
        (&robots[0]["x_m"], &robots[0]["y_m"]),
        (&json!(6.0), &json!(4.0))
    );
    let set = json!({"set": {"kind": "robot", "index": 0, "values": {"x_m": 7, "y_m": 4}}});
    let moved = text.replace(
        "count = 4\n",
        "count = 4\nstart = { x_m = 7.0, y_m = 4.0 }\n",
    );
    assert_eq!(changed(text, &set), moved);
}

#[test]
fn every_builtin_scenario_is_drawn_and_each_item_can_be_set_to_its_own_place() {
    let list = crate::gallery::choices();
    for name in list["scenarios"].as_array().unwrap() {
        let choice = json!({"scenario": name["name"]});
        let answer = ask(&json!({"choice": choice}));
        let all = answer["drawing"]["items"].as_array();
        let all = all.unwrap_or_else(|| panic!("{name}: {answer}"));
        // One item of each kind: large teams take long.
        let mut last = Value::Null;
        for item in all {
            if item["kind"] == last {
                continue;
            }
            last = item["kind"].clone();
            // A block without a start may not fit as a square.
            if item["outlines"].as_array().unwrap().len() > 1 {
                continue;
            }
            let values = json!({"x_m": item["x_m"], "y_m": item["y_m"]});
            let set =
                json!({"set": {"kind": item["kind"], "index": item["index"], "values": values}});
            let after = ask(&json!({"choice": choice, "change": set}));
            let same = after["drawing"]["items"].as_array();
            let same = same.unwrap_or_else(|| panic!("{name} {item}: {after}"));
            assert_eq!(same.len(), all.len(), "{name} {item}");
        }
        let drawn = answer["drawing"]["view"]["obstacles"]
            .as_array()
            .unwrap()
            .len();
        assert_eq!(
            items(&answer, "obstacle").len() + items(&answer, "zone").len(),
            drawn,
            "{name}"
        );
    }
}

#[test]
fn each_kind_of_a_mission_can_be_added() {
    let bars = "[push]\nlength_m = 2.0\n[[push.bars]]\nx_m = 3.0\ny_m = 6.0\ngoal_x_m = 9.0\n\
                [[robots]]\nname = \"red\"\n[[robots]]\nname = \"blue\"\n";
    for choice in [
        json!({"scenario": "waste-cleanup"}),
        json!({"scenario": "janitorial"}),
        json!({"file": {"name": "bars.toml", "text": bars}}),
    ] {
        let before = ask(&json!({"choice": choice}));
        for new in before["drawing"]["kinds"].as_array().unwrap() {
            // Chargers need energy, which these scenarios do not simulate.
            if new["kind"] == "charger" {
                continue;
            }
            let place = json!({"x_m": 6.0, "y_m": 1.5});
            let add =
                json!({"add": {"kind": new["kind"], "variant": new["variant"], "values": place}});
            let after = ask(&json!({"choice": choice, "change": add}));
            assert_eq!(after["problem"], Value::Null, "{choice} {new}");
            let kind = new["kind"].as_str().unwrap();
            let found = items(&after, kind);
            assert_eq!(
                found.len(),
                items(&before, kind).len() + 1,
                "{choice} {new}"
            );
            let last = found.last().unwrap();
            assert_eq!(
                (&last["x_m"], &last["y_m"]),
                (&json!(6.0), &json!(1.5)),
                "{last}"
            );
        }
    }
}

#[test]
fn a_problem_has_its_line_and_changes_nothing() {
    let problem = |text: &str, change: Value| {
        let answer = of_text(text, &change);
        assert_eq!(answer["text"], text);
        assert_eq!(answer["drawing"], Value::Null);
        let line = answer["problem"]["line"].clone();
        (answer["problem"]["text"].as_str().unwrap().to_owned(), line)
    };
    let (text, line) = problem("limit_s = 9\nrobot = 3", Value::Null);
    assert!(text.starts_with("mine.toml:2: robot: "), "{text}");
    assert_eq!(line, 2);
    let (text, line) = problem("limit_s = = 9", Value::Null);
    assert!(text.starts_with("mine.toml:1: "), "{text}");
    assert_eq!(line, 1);
    let set = |kind: &str, index: usize, values: Value| json!({"set": {"kind": kind, "index": index, "values": values}});
    for (change, start) in [
        (
            set("robot", 0, json!({"x_m": 20, "y_m": 2})),
            "mine.toml:18: robots[0].start.x_m: ",
        ),
        (
            set("robot", 7, json!({"x_m": 2, "y_m": 2})),
            "the drawing has no robot; ",
        ),
        (
            set("robot", 0, json!({"speed_m_s": 2})),
            "the drawing has no number 'speed_m_s' of a robot; ",
        ),
        (set("ghost", 0, json!({})), "the drawing has no ghost; "),
        (
            json!({"delete": {"kind": "deposit", "index": 0}}),
            "the deposit cannot be deleted; move it",
        ),
    ] {
        let (text, _) = problem(TEXT, change);
        assert!(text.starts_with(start), "{text}");
    }
    let one = "[[robots]]\nname = 'a'\nside_sensor = true";
    let (text, _) = problem(one, json!({"delete": {"kind": "robot", "index": 0}}));
    assert_eq!(
        text,
        "the last robot cannot be deleted; add another one first"
    );
}
