//! A finished run on the page: every tick equals the log.

use alliance_tests::harness::Lab;
use alliance_tests::team::Team;
use alliance_tests::testkit::ROBOTS;
use nix::sys::signal::Signal;
use run_log::{MissionRow, MotivationRow, PoseRow};
use serde_json::{Value, json};

use super::client::{Page, watch};

fn views(page: &Page) -> Vec<Value> {
    let ticks = page.get("/api/run")["log"]["ticks"].as_u64().unwrap();
    let mut views = Vec::new();
    while (views.len() as u64) <= ticks {
        let path = format!("/api/views?from={}&count=1000", views.len());
        let Value::Array(more) = page.get(&path) else {
            panic!("{path}");
        };
        assert!(!more.is_empty());
        views.extend(more);
    }
    views
}

#[test]
fn every_tick_is_shown_as_logged() {
    let lab = Lab::new();
    // The run has a kill, an obstacle and message loss.
    let faults = "
        [faults]
        timeline = [
            { fault.kill = 'gold', at_s = 20.0, for_s = 5.0 },
            { fault.obstacle = { x_m = 6.0, y_m = 4.0, width_m = 0.5, height_m = 1.0 }, at_s = 30.0, for_s = 10.0 },
            { fault.drop = { p = 0.3 }, at_s = 10.0, for_s = 30.0 },
        ]
    ";
    lab.write("day.toml", faults);
    lab.mission("run", "day.toml --limit 70").expect(1);
    let log = lab.log("run");
    let (process, page) = watch(&lab, "run");
    let about = page.get("/api/run");
    assert_eq!(about["mode"], "log");
    for (key, expected) in [
        ("outcome", json!("time-limit")),
        ("warning", Value::Null),
        ("hash", json!(log.run.hash)),
        ("duration_ms", json!(70_000)),
    ] {
        assert_eq!(about["log"][key], expected, "{key}");
    }

    let views = views(&page);
    assert_eq!(views.len(), 1401);
    let at = |t_ms: u64, robot: &str| {
        let rank = ROBOTS.iter().position(|name| *name == robot);
        &views[t_ms as usize / 50]["robots"][rank.unwrap()]
    };
    let number = |value: &Value| value.as_f64().unwrap() as f32;
    for row in log.rows::<PoseRow>().unwrap() {
        let shown = at(row.t_ms.0, &row.robot);
        let (place, heading) = (&shown["pose"]["position"], &shown["pose"]["heading_rad"]);
        let pose = [&place[0], &place[1], heading].map(number);
        assert_eq!(pose, [row.x_m, row.y_m, row.heading_rad], "{row:?}");
        assert_eq!(!shown["carrying"].is_null(), row.carrying, "{row:?}");
    }
    let sets: Vec<Value> = about["catalog"]["sets"].as_array().unwrap().clone();
    for row in log.rows::<MotivationRow>().unwrap() {
        // A view is between two ticks and has the motivations of the previous one.
        let robot = at(row.t_ms.0 + 50, &row.robot);
        let seen = robot["sets"].as_array().unwrap().iter().find(|seen| {
            let set = seen["motivation"]["set"].as_u64().unwrap();
            sets[set as usize]["name"] == row.behavior_set
        });
        // A robot that crashed in this tick has no motivations.
        let Some(seen) = seen else {
            assert_eq!((row.robot.as_str(), row.t_ms.0), ("gold", 20_000));
            continue;
        };
        assert_eq!(seen["motivation"]["motivation"], row.motivation, "{row:?}");
        let state = seen["motivation"]["state"].as_str().unwrap().to_lowercase();
        assert_eq!(state, row.state, "{row:?}");
    }
    let columns = about["mission"]["columns"].as_array().unwrap();
    for row in log.rows::<MissionRow>().unwrap() {
        let shown = views[row.t_ms.0 as usize / 50 + 1]["mission"].as_array();
        let shown = shown.unwrap().iter().zip(columns);
        let shown = shown.map(|(value, column)| {
            let name = column["name"].as_str().unwrap();
            (name.to_owned(), value.as_f64())
        });
        assert_eq!(shown.collect::<Vec<_>>(), row.values, "{row:?}");
    }
    let labels = views[0]["marks"].as_array().unwrap().iter();
    let labels: Vec<&Value> = labels.map(|mark| &mark["label"]).collect();
    let expected = ["report site", "deposit", "spill (top)", "spill (bottom)"];
    assert_eq!(labels, expected);
    let obstacles = |t_s: usize| views[t_s * 20 + 1]["obstacles"].as_array().unwrap().len();
    assert_eq!((obstacles(29), obstacles(31), obstacles(41)), (0, 1, 0));
    assert_eq!(at(22_000, "gold")["state"], "dead");
    let dropped = |from: usize, to: usize| {
        let messages = views[from..to].iter();
        let messages = messages.flat_map(|view| view["messages"].as_array().unwrap());
        let deliveries = messages.map(|message| &message["reception"]["delivery"]);
        deliveries.filter(|delivery| *delivery == "Dropped").count()
    };
    assert_eq!(dropped(0, 200), 0);
    assert!(dropped(200, 800) > 0);
    assert_eq!(dropped(805, 1401), 0);

    // The page has the rows of the log, and what it finds about losses.
    let events = page.get("/api/events");
    let is_found = |event: &&Value| event["kind"] == "took-over" || event["kind"] == "detected";
    let found = events.as_array().unwrap().iter().filter(is_found).count();
    let lines = lab.text("run/events.csv").lines().count();
    assert_eq!(events.as_array().unwrap().len() - found, lines - 1);
    // A thinned range, and ranges up to and beyond the end.
    let thinned = page.get("/api/views?from=100&count=3&step=50");
    let thinned = thinned.as_array().unwrap().iter();
    let ticks: Vec<&Value> = thinned.map(|view| &view["tick"]).collect();
    assert_eq!(ticks, [100, 150, 200]);
    for (from, expected) in [(1400, &views[1400..]), (9_999_999, &[])] {
        let range = page.get(&format!("/api/views?from={from}&count=10"));
        assert_eq!(range, json!(expected));
    }
    process.signal(Signal::SIGINT);
    process.wait().expect(0);
}

#[test]
fn the_log_of_a_killed_world_is_shown_up_to_its_last_complete_tick() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, "--speed 20x --log summary");
    team.wait_for_row("events.csv", &[",position-update,"]);
    team.signal("world", Signal::SIGKILL);
    team.wait().expect(3);
    let last = lab.log("run").last.unwrap();
    let (process, page) = watch(&lab, "run");
    let log = &page.get("/api/run")["log"];
    assert_eq!(log["outcome"], "running");
    assert_eq!(log["ticks"], last.tick + 1);
    assert_eq!(log["warning"], Value::Null);
    assert_eq!(views(&page).len() as u64, last.tick + 2);
    process.signal(Signal::SIGINT);
    process.wait().expect(0);
}

#[test]
fn a_missing_run_gives_one_line() {
    let lab = Lab::new();
    let nothing = lab.refusal("watch ./nowhere");
    let reason = "alliance watch: ./nowhere is not the folder of a run: ";
    assert!(nothing.starts_with(reason), "{nothing}");
    let no_run = lab.run("watch").expect(3);
    assert_eq!(
        no_run.stderr,
        "alliance watch: no run is live; start one with `alliance run` or `alliance cluster world`\n"
    );
}
