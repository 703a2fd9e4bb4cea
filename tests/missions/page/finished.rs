//! A finished run on the page: every tick equals the log.

use alliance_tests::harness::{Lab, Process};
use alliance_tests::team::Team;
use nix::sys::signal::Signal;
use run_log::{MissionRow, MotivationRow, PoseRow};
use serde_json::Value;

use super::client::Page;

fn view(lab: &Lab) -> (Process, Page) {
    let mut view = lab.start(&["watch", "run"]);
    view.wait_for_stderr("/#");
    let page = Page::from_output(&view.stderr());
    (view, page)
}

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
    std::fs::write(
        lab.path("day.toml"),
        "[[faults.timeline]]\nfault.kill = 'gold'\nat_s = 20.0\nfor_s = 5.0\n\
         [[faults.timeline]]\nfault.obstacle = { x_m = 6.0, y_m = 4.0, width_m = 0.5, height_m = 1.0 }\nat_s = 30.0\nfor_s = 10.0\n\
         [[faults.timeline]]\nfault.drop = { p = 0.3 }\nat_s = 10.0\nfor_s = 30.0\n",
    )
    .unwrap();
    lab.mission("run", &["day.toml", "--limit", "70"]).expect(1);
    let log = lab.log("run");
    let (process, page) = view(&lab);
    let about = page.get("/api/run");
    assert_eq!(about["mode"], "log");
    assert_eq!(about["log"]["outcome"], "time-limit");
    assert_eq!(about["log"]["warning"], Value::Null);
    assert_eq!(about["log"]["hash"], log.run.hash.clone().unwrap());
    assert_eq!(about["log"]["duration_ms"], 70_000);

    let views = views(&page);
    assert_eq!(views.len(), 1401);
    let at = |t_ms: u64, robot: &str| {
        let rank = ["blue", "gold", "green"]
            .iter()
            .position(|name| *name == robot);
        &views[t_ms as usize / 50]["robots"][rank.unwrap()]
    };
    for pose in log.rows::<PoseRow>().unwrap() {
        let shown = at(pose.t_ms.0, &pose.robot);
        let place = &shown["pose"]["position"];
        let number = |value: &Value| value.as_f64().unwrap() as f32;
        assert_eq!(
            (
                number(&place[0]),
                number(&place[1]),
                number(&shown["pose"]["heading_rad"])
            ),
            (pose.x_m, pose.y_m, pose.heading_rad),
            "{pose:?}"
        );
        assert_eq!(!shown["carrying"].is_null(), pose.carrying, "{pose:?}");
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
        let shown: Vec<(String, Option<f64>)> = views[row.t_ms.0 as usize / 50 + 1]["mission"]
            .as_array()
            .unwrap()
            .iter()
            .zip(columns)
            .map(|(value, column)| (column["name"].as_str().unwrap().to_owned(), value.as_f64()))
            .collect();
        assert_eq!(shown, row.values, "{row:?}");
    }
    let labels: Vec<&Value> = views[0]["marks"]
        .as_array()
        .unwrap()
        .iter()
        .map(|mark| &mark["label"])
        .collect();
    assert_eq!(
        labels,
        ["report site", "deposit", "spill (top)", "spill (bottom)"]
    );
    let obstacles = |t_s: usize| views[t_s * 20 + 1]["obstacles"].as_array().unwrap().len();
    assert_eq!((obstacles(29), obstacles(31), obstacles(41)), (0, 1, 0));
    assert_eq!(at(22_000, "gold")["state"], "dead");
    let deliveries = |from: usize, to: usize| {
        let messages = views[from..to]
            .iter()
            .flat_map(|view| view["messages"].as_array().unwrap());
        messages
            .filter(|message| message["reception"]["delivery"] == "Dropped")
            .count()
    };
    assert_eq!(deliveries(0, 200), 0);
    assert!(deliveries(200, 800) > 0);
    assert_eq!(deliveries(805, 1401), 0);

    let events = page.get("/api/events");
    let lines = std::fs::read_to_string(lab.path("run/events.csv")).unwrap();
    assert_eq!(events.as_array().unwrap().len(), lines.lines().count() - 1);
    // A thinned range, and ranges up to and beyond the end.
    let thinned = page.get("/api/views?from=100&count=3&step=50");
    let ticks: Vec<&Value> = thinned
        .as_array()
        .unwrap()
        .iter()
        .map(|view| &view["tick"])
        .collect();
    assert_eq!(ticks, [100, 150, 200]);
    assert_eq!(
        page.get("/api/views?from=1400&count=10"),
        Value::Array(views[1400..].to_vec())
    );
    assert_eq!(
        page.get("/api/views?from=9999999&count=10"),
        Value::Array(Vec::new())
    );
    process.signal(Signal::SIGINT);
    process.wait().expect(0);
}

#[test]
fn the_log_of_a_killed_world_is_shown_up_to_its_last_complete_tick() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, &["--speed", "20x", "--log", "summary"]);
    team.wait_for_row("events.csv", &[",position-update,"]);
    team.signal("world", Signal::SIGKILL);
    team.wait().expect(3);
    let last = lab.log("run").last.unwrap();
    let (process, page) = view(&lab);
    let about = page.get("/api/run");
    assert_eq!(about["log"]["outcome"], "running");
    assert_eq!(about["log"]["ticks"], last.tick + 1);
    assert_eq!(about["log"]["warning"], Value::Null);
    assert_eq!(views(&page).len() as u64, last.tick + 2);
    process.signal(Signal::SIGINT);
    process.wait().expect(0);
}

#[test]
fn a_missing_run_gives_one_line() {
    let lab = Lab::new();
    let nothing = lab.run(&["watch", "./nowhere"]).expect(2);
    assert!(
        nothing
            .stderr
            .starts_with("alliance watch: ./nowhere is not the folder of a run: "),
        "{}",
        nothing.stderr
    );
    assert_eq!(nothing.stderr.lines().count(), 1);
    let no_run = lab.run(&["watch"]).expect(3);
    assert_eq!(
        no_run.stderr,
        "alliance watch: no run is live; start one with `alliance run` or `alliance cluster world`\n"
    );
}
