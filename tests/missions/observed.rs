//! Observation of a live world: metrics for Prometheus, health, and logs as JSON. None changes a byte of the run.

use std::net::TcpListener;

use alliance_tests::harness::{Lab, wait_until};
use serde_json::Value;

use crate::page::get;

/// Returns the present value of a metric, or `None` while nothing answers.
fn metric(port: u16, name: &str) -> Option<f64> {
    let (status, text) = get(port, "/metrics")?;
    assert_eq!(status, 200, "{text}");
    let mut lines = text.lines().filter_map(|line| line.split_once(' '));
    let (_, value) = lines.find(|(found, _)| *found == name)?;
    value.parse().ok()
}

/// Asserts that each line is a JSON object with time, level and run, of one of these processes. No key comes twice.
#[track_caller]
fn assert_json_lines(text: &str, processes: &[&str]) {
    assert!(!text.is_empty());
    for line in text.lines() {
        let event: Value = serde_json::from_str(line).unwrap_or_else(|_| panic!("{line}"));
        assert!(event["timestamp"].is_string(), "{line}");
        assert!(event["level"].is_string(), "{line}");
        let process = event["process"].as_str().unwrap();
        assert!(processes.contains(&process), "{line}");
        assert!(event["run"].is_string(), "{line}");
        assert_eq!(line.matches("\"run\":").count(), 1, "{line}");
    }
}

#[test]
fn metrics_and_json_logs_change_no_byte() {
    let lab = Lab::new();
    lab.write(
        "day.toml",
        "faults.timeline = [{ fault.drop = { p = 0.3 } }]",
    );
    lab.mission("plain", "day.toml --limit 30").expect(1);
    let free = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = free.local_addr().unwrap().port();
    let metrics = format!("--metrics 127.0.0.1:{port}");
    let refusal = lab.refusal(format!("run {metrics}"));
    assert!(refusal.contains("--metrics 127.0.0.1:"), "{refusal}");
    assert!(refusal.contains("use a free address"), "{refusal}");
    drop(free);
    // The options of a run need different addresses.
    let refusal = lab.refusal(format!("run {metrics} --foxglove=127.0.0.1:{port}"));
    assert!(refusal.contains("--metrics 127.0.0.1:"), "{refusal}");
    let refusal = lab.refusal(format!("run {metrics} --port {port}"));
    assert!(refusal.contains(&format!("--port {port}: ")), "{refusal}");

    let run = "run day.toml --limit 30 --no-page --paused --speed max --out observed";
    let mut launcher = lab.start(format!("{run} {metrics} --log-format json"));
    launcher.wait_for_stderr("process ids: ");
    let reads = |name: &str, expected: f64| metric(port, name) == Some(expected);
    wait_until("three agents", || reads("alliance_agents_present", 3.0));
    lab.run("clock step 400").expect(0);
    wait_until("400 ticks", || reads("alliance_ticks_total", 400.0));
    assert!(reads("alliance_stalls_total", 0.0));
    assert_eq!(get(port, "/healthz"), Some((200, "ok\n".to_owned())));
    let dropped = metric(port, "alliance_messages_dropped_total");
    assert!(dropped.is_some_and(|dropped| dropped > 0.0), "{dropped:?}");
    lab.run("clock speed max").expect(0);
    lab.run("clock resume").expect(0);
    let finished = launcher.wait().expect(1);

    let [plain, observed] = ["plain", "observed"].map(|run| lab.log(run).run.hash);
    assert_eq!(plain, observed);
    assert_json_lines(&finished.stderr, &["launcher"]);
    let world = lab.text("observed/logs/world.log");
    assert_json_lines(&world, &["world", "gateway"]);
    // The agents left after the end of the run.
    assert!(!world.contains("agent lost"), "{world}");
    for robot in ["blue", "gold", "green"] {
        assert_json_lines(&lab.text(&format!("observed/logs/{robot}.log")), &[robot]);
    }
}

#[test]
fn failures_are_errors_in_json_logs() {
    let lab = Lab::new();
    for arguments in [
        "run nowhere.toml",
        "cluster ros nowhere",
        "cluster foxglove nowhere",
    ] {
        let finished = lab.run(format!("{arguments} --log-format json")).expect(2);
        let event: Value = serde_json::from_str(&finished.stderr).unwrap();
        assert_eq!(event["level"], "ERROR", "{event}");
    }

    let arguments = "--limit 5 --speed max --ros --ros-router tcp/127.0.0.1:9 --log-format json";
    lab.mission("run", arguments).expect(1);
    let text = lab.text("run/logs/ros.topics.log");
    assert_json_lines(&text, &["ros"]);
    let last: Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    let message = last["message"].as_str().unwrap();
    assert!(
        message.contains("no zenoh router has answered"),
        "{message}"
    );
    assert_eq!(last["level"], "ERROR", "{last}");
}
