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

/// Asserts that each line is a JSON object with time, level and run, of one of these processes.
#[track_caller]
fn assert_json_lines(text: &str, processes: &[&str]) {
    assert!(!text.is_empty());
    for line in text.lines() {
        let event: Value = serde_json::from_str(line).unwrap_or_else(|_| panic!("{line}"));
        assert!(event["timestamp"].is_string(), "{line}");
        assert!(event["level"].is_string(), "{line}");
        let process = event["process"].as_str().unwrap();
        assert!(processes.contains(&process), "{line}");
        let is_world = process == "world";
        assert!(!is_world || event["run"].is_string(), "{line}");
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
    assert_json_lines(&lab.text("observed/logs/world.log"), &["world", "gateway"]);
    for robot in ["blue", "gold", "green"] {
        assert_json_lines(&lab.text(&format!("observed/logs/{robot}.log")), &[robot]);
    }
}
