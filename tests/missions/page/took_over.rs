//! Takeovers of random runs with kills and pauses: the lines of `alliance run`, the events of the page and the report state
//! the same ones (docs/book/results.md, section "Takeovers").

use alliance_tests::harness::Lab;
use analysis::report::{History, Metrics};
use nix::sys::signal::Signal;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::client::watch;

/// Time, ms, robot, task, lost robot, and the time since its loss in words.
type TakenOver = (u64, String, String, String, String);

fn random_scenario(seed: u64) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut text = "limit_s = 250.0\n".to_owned();
    for _ in 0..8 {
        let robot = ["blue", "gold", "green"][random.random_range(0..3)];
        let kind = ["kill", "kill", "pause"][random.random_range(0..3)];
        let at_s = 40.0 + 0.05 * f64::from(random.random_range(0..4000));
        let for_s = [0.1, 1.0, 5.0, 5.05, 10.0, 20.0][random.random_range(0..6)];
        text += &format!(
            "[[faults.timeline]]\nfault.{kind} = '{robot}'\nat_s = {at_s:.2}\nfor_s = {for_s}\n"
        );
    }
    text
}

/// Returns the printed takeovers: with `takes over` the lines during the run, with `took over` those of the result.
fn printed(stderr: &str, verb: &str) -> Vec<TakenOver> {
    let lines = stderr.lines().filter_map(|line| {
        let (at, rest) = line.split_once(" s: ")?;
        let (robot, rest) = rest.split_once(&format!(" {verb} "))?;
        let (task, rest) = rest.split_once(" from ")?;
        let (from, delay) = rest.split_once(", ")?;
        let at_ms = (at.parse::<f64>().ok()? * 1000.0).round() as u64;
        let [robot, task, from, delay] = [robot, task, from, delay].map(ToOwned::to_owned);
        Some((at_ms, robot, task, from, delay))
    });
    lines.collect()
}

fn on_page(lab: &Lab, run: &str) -> Vec<TakenOver> {
    let (process, page) = watch(lab, run);
    let events = page.get("/api/events");
    process.signal(Signal::SIGINT);
    process.wait().expect(0);
    let events = events.as_array().unwrap().iter();
    let takeovers = events.filter(|event| event["kind"] == "took-over");
    let takeovers = takeovers.map(|event| {
        let [robot, task, from, delay] = ["robot", "subject", "reason", "detail"]
            .map(|field| event[field].as_str().unwrap().to_owned());
        (event["t_ms"].as_u64().unwrap(), robot, task, from, delay)
    });
    takeovers.collect()
}

fn in_report(lab: &Lab, run: &str) -> Vec<TakenOver> {
    let log = lab.log(run);
    let history = History::read(&log).unwrap();
    let name = |rank: usize| history.robots[rank].name.clone();
    let takeovers = Metrics::compute(&history, &log.run).takeovers.into_iter();
    let lost = takeovers.filter(|takeover| takeover.cause.is_loss());
    let lost = lost.map(|takeover| {
        let task = history.catalog.task_name(takeover.task).to_owned();
        let losses = ["gone", "stalled"].map(|kind| {
            let mut losses = history.events_of(kind);
            losses.any(|event| {
                event.t_ms == takeover.idle_since && event.robot == name(takeover.from)
            })
        });
        let words = match losses {
            [true, _] => "its death",
            _ => "its last report",
        };
        let delay = format!("{:.2} s after {words}", takeover.latency().as_secs_f64());
        (
            takeover.at.0,
            name(takeover.robot),
            task,
            name(takeover.from),
            delay,
        )
    });
    lost.collect()
}

#[test]
fn lines_page_and_report_show_the_same_takeovers() {
    let lab = Lab::new();
    let mut count = 0;
    for (seed, allocator) in
        (0..).zip(["alliance", "first-come", "random", "cbba", "ble", "murdoch"])
    {
        let (file, out) = (format!("{seed}.toml"), format!("run-{seed}"));
        lab.write(&file, random_scenario(seed));
        let options = format!("{file} --in-process --seed {seed} --allocator {allocator}");
        let stderr = lab.mission(&out, &options).stderr;
        // During the run a takeover is printed when it is certain.
        let mut live = printed(&stderr, "takes over");
        live.sort_by_key(|takeover| takeover.0);
        let printed = printed(&stderr, "took over");
        assert_eq!(live, printed, "{options}");
        assert_eq!(printed, in_report(&lab, &out), "{options}");
        assert_eq!(printed, on_page(&lab, &out), "{options}");
        count += printed.len();
    }
    assert!(count >= 6, "{count} takeovers");
}
