//! The playground: the simulator as a WebAssembly module has the hashes of the native program.

mod edited;
pub mod page;

use std::ffi::OsStr;
use std::path::PathBuf;
use std::process::Command;

use alliance_tests::harness::{Lab, alliance};
use alliance_tests::needs::cannot_run;
use alliance_tests::runs::{builtin, vocabulary};
use alliance_tests::testkit::{DEFAULT_HASH, in_repository};
use analysis::random_mission::faults::{RandomFaults, timeline};
use in_process::Team;
use playground::choice::Choice;
use proto::control::{ControlCommand, Reply};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use run_log::recorder::{Folder, Sink};
use run_log::{LogLevel, MemoryLog};
use scenario::fault::Order;
use serde_json::{Value, json};

/// The largest team of the comparison.
const ROBOTS_MAX: usize = 100;

/// The simulated time of a run of the comparison, s.
const LIMIT_S: f64 = 20.0;

/// A run with orders of a person, by tick.
struct Run {
    choice: Value,
    orders: Vec<(u64, ControlCommand)>,
}

impl Run {
    fn plan(&self) -> Value {
        json!({"choice": self.choice, "orders": self.orders})
    }

    /// Returns the result of the native program, as of `hashes.mjs`.
    fn result(&self) -> Value {
        self.result_in(MemoryLog::default())
    }

    fn result_in(&self, sink: impl Sink) -> Value {
        let choice: Choice = serde_json::from_value(self.choice.clone()).unwrap();
        let played = play(&choice, &self.orders, sink);
        let beside = choice.second().map(|second| {
            let orders = self.orders_beside(&played.replies);
            play(&second, &orders, MemoryLog::default()).hash
        });
        json!({"hash": played.hash, "beside": beside, "replies": played.replies, "ticks": played.ticks})
    }

    /// Returns the orders that reach the second run: those that the first one accepts, with the ids of their faults there.
    fn orders_beside(&self, replies: &[Reply]) -> Vec<(u64, ControlCommand)> {
        let accepted = self.orders.iter().zip(replies);
        let orders = accepted.filter_map(|((at, command), reply)| match (command, reply) {
            (ControlCommand::Fault(order), Reply::Armed(armed)) => {
                let id = Some(armed.id.clone());
                let order = Order {
                    id,
                    ..order.clone()
                };
                Some((*at, ControlCommand::Fault(order)))
            }
            (command, Reply::Cleared(_)) => Some((*at, command.clone())),
            _ => None,
        });
        orders.collect()
    }
}

/// The end of a native run, and the replies to its orders.
struct Played {
    hash: String,
    replies: Vec<Reply>,
    ticks: u64,
}

fn play(choice: &Choice, orders: &[(u64, ControlCommand)], sink: impl Sink) -> Played {
    let setup = choice.setup().unwrap();
    let mut team = Team::new(setup, LogLevel::Full, sink).unwrap();
    let mut orders = orders.iter().peekable();
    let mut replies = Vec::new();
    let outcome = loop {
        let tick = team.simulation().tick();
        while let Some((_, command)) = orders.next_if(|(at, _)| *at <= tick) {
            replies.push(give(&mut team, command));
        }
        if let Some(outcome) = team.tick().unwrap() {
            break outcome;
        }
    };
    // The run may be over before the last orders, which it then refuses.
    replies.extend(orders.map(|(_, command)| give(&mut team, command)));
    let (ticks, hash) = (team.simulation().tick(), team.hash());
    team.end(outcome).unwrap();
    Played {
        hash,
        replies,
        ticks,
    }
}

/// Gives a command to a run, as a person does.
fn give(team: &mut Team<impl Sink>, command: &ControlCommand) -> Reply {
    let reply = match command {
        ControlCommand::Fault(order) => team.order(order.clone()).map(Reply::Armed),
        ControlCommand::Clear(id) => team.clear(id.as_deref()).map(Reply::Cleared),
        _ => unreachable!("a plan contains faults only"),
    };
    reply.unwrap_or_else(|error| Reply::Refused(error.to_string()))
}

/// A person gives orders while a run goes on. Its log repeats them.
#[test]
fn the_log_repeats_orders_by_hand() {
    let lab = Lab::new();
    for (index, run) in runs().iter().enumerate().step_by(9) {
        let out = format!("run-{index}");
        let sink = Folder::create(lab.path(&out)).unwrap();
        let result = run.result_in(sink);
        assert_eq!(lab.log(&out).run.hash.as_deref(), result["hash"].as_str());
        lab.assert_repeated(&out);
    }
}

/// Returns the file of the module. Without it the test fails, or is skipped and listed.
fn module() -> Option<PathBuf> {
    let target = alliance().ancestors().nth(2).unwrap().to_owned();
    let module = target.join("wasm32-unknown-unknown/browser/playground.wasm");
    if module.exists() {
        return Some(module);
    }
    let how = "no module of the playground: run `rustup target add wasm32-unknown-unknown` and `playground/build --module`";
    cannot_run(how);
    None
}

/// Returns all built-in scenarios with at most [`ROBOTS_MAX`] robots, each with three seeds and with faults by hand, and the
/// complete default mission. One of the three has a second run beside it.
fn runs() -> Vec<Run> {
    let mut runs = vec![Run {
        choice: json!({}),
        orders: Vec::new(),
    }];
    for name in vocabulary().builtins().map(|builtin| builtin.name) {
        let mut scenario = builtin(name);
        if scenario.robots.len() > ROBOTS_MAX {
            continue;
        }
        for seed in 1..=3 {
            let faults = RandomFaults {
                min: 4,
                max: 8,
                until_s: LIMIT_S,
            };
            scenario.limit_s = LIMIT_S;
            let step_ms = scenario.step_ms;
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let orders = timeline(&faults, &scenario, &mut random);
            // A person gives the order at its time. Some wait for an event.
            let by_hand = |mut order: Order| {
                let at = order.at().map_or(0, |at| at.0.div_ceil(step_ms));
                order.at_s = None;
                (at, ControlCommand::Fault(order))
            };
            let mut orders: Vec<_> = orders.into_iter().map(by_hand).collect();
            let all_clear = (LIMIT_S * 900.0) as u64 / step_ms;
            orders.push((all_clear, ControlCommand::Clear(None)));
            orders.sort_by_key(|(at, _)| *at);
            let mut choice =
                json!({"scenario": name, "seed": seed.to_string(), "limit_s": LIMIT_S});
            if seed == 2 {
                choice["beside"] = json!("nearest");
            }
            runs.push(Run { choice, orders });
        }
    }
    runs
}

/// Compares the results of the module with those of the native program.
#[track_caller]
fn compare(runs: &[Run], found: &Value) {
    let found = found.as_array().unwrap();
    assert_eq!(found.len(), runs.len());
    let mut armed = 0;
    for (run, found) in runs.iter().zip(found) {
        let expected = run.result();
        assert_eq!(*found, expected, "{}", run.choice);
        let replies = expected["replies"].as_array().unwrap().iter();
        armed += replies.filter(|reply| reply.get("armed").is_some()).count();
    }
    assert_eq!(found[0]["hash"], DEFAULT_HASH);
    assert!(found.iter().any(|run| run["beside"].is_string()));
    assert!(armed >= 2 * runs.len(), "only {armed} faults were armed");
}

/// Runs a script with the module in Node.js. Returns the JSON value that it prints, or `None` without module or Node.js.
fn in_node(script: &str, argument: impl AsRef<OsStr>) -> Option<Value> {
    let output = Command::new("node")
        .arg(in_repository("tests/missions/playground").join(script))
        .arg(module()?)
        .arg(in_repository("launch/page/source/worker.js"))
        .arg(argument)
        .output();
    let Ok(output) = output else {
        cannot_run("no Node.js: install Node.js 20");
        return None;
    };
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

#[test]
fn the_module_has_the_hashes_of_the_native_program() {
    let lab = Lab::new();
    let runs = runs();
    let plan: Vec<Value> = runs.iter().map(Run::plan).collect();
    lab.write("plan.json", json!(plan).to_string());
    if let Some(found) = in_node("node.mjs", lab.path("plan.json")) {
        compare(&runs, &found);
    }
}

/// Each growth of the memory may take a browser milliseconds, and a team's first messages need much memory.
#[test]
fn the_messages_of_a_large_team_do_not_grow_the_memory() {
    let text = "room = { width_m = 80, height_m = 60 }\n[waste]\nborder_known = true\n\
                [[robots]]\nname = \"r\"\nside_sensor = true\ncount = 300\n";
    let choice = json!({"file": {"name": "team.toml", "text": text}});
    if let Some(found) = in_node("memory.mjs", choice.to_string()) {
        assert_eq!(found["start"], found["end"]);
    }
}
