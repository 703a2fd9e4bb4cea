use std::fmt::Write as _;
use std::time::Duration;

use proto::tick::Outcome;

use super::*;
use crate::engine::Engine;

/// The columns of the table of runs in the book.
const HEAD: &str = "| run | what to see | source |\n| --- | --- | --- |\n";

/// The number of ticks between two views. Each view is a long text.
const TICKS_PER_VIEW: usize = 500;

/// A run as the page receives it.
#[derive(Default)]
struct Seen {
    view: Value,
    events: Vec<String>,
}

impl Seen {
    fn add(&mut self, frame: &str) {
        if frame.starts_with(r#"{"messages""#) {
            return;
        }
        let frame: Value = serde_json::from_str(frame).unwrap();
        if let Some(view) = frame.get("view") {
            self.view = view.clone();
        }
        for event in frame["events"].as_array().into_iter().flatten() {
            let word = |key: &str| event[key].as_str().unwrap().to_owned();
            let words = [word("robot"), word("kind"), word("subject")];
            self.events.push(words.join(" "));
        }
    }

    /// Returns the sum of the mission's columns of a kind.
    fn work(&self, about: &Value, kind: &str) -> f64 {
        let columns = about["mission"]["columns"].as_array().unwrap().iter();
        let values = columns.zip(self.view["mission"].as_array().unwrap());
        let wanted = values.filter(|(column, _)| column["kind"] == kind);
        wanted.filter_map(|(_, value)| value.as_f64()).sum()
    }

    fn check(&self, expected: &Expectation, about: &Value) {
        assert_eq!(self.view["outcome"], expected.outcome.as_str());
        for (kind, amount) in [
            ("done", expected.done),
            ("left", expected.left),
            ("expired", expected.expired),
        ] {
            if let Some(amount) = amount {
                assert_eq!(self.work(about, kind), amount, "{kind}");
            }
        }
        let mut events = self.events.iter();
        for wanted in &expected.events {
            let found = events.any(|event| event.starts_with(wanted));
            assert!(found, "no '{wanted}' in {:#?}", self.events);
        }
    }
}

/// Returns which run is ahead, as on the page (`launch/page/model/compare.js`).
fn ahead(runs: &[Seen; 2], about: &Value) -> usize {
    let end_ms = |run: &Seen| match run.view["outcome"] == Outcome::Complete.as_str() {
        true => run.view["now"].as_u64().unwrap(),
        false => u64::MAX,
    };
    let [first, second] = runs;
    let is_one_complete = end_ms(first).min(end_ms(second)) < u64::MAX;
    let work = |run: &Seen| run.work(about, "done");
    let order = match is_one_complete {
        true => end_ms(first).cmp(&end_ms(second)),
        false => work(second).total_cmp(&work(first)),
    };
    match order {
        std::cmp::Ordering::Less => 1,
        std::cmp::Ordering::Equal => 0,
        std::cmp::Ordering::Greater => 2,
    }
}

#[test]
fn each_run_keeps_its_promise() {
    let entries = toml::from_str::<Gallery>(FILE).unwrap().run;
    assert_eq!(entries.len(), 12);
    for entry in entries {
        println!("{}", entry.title);
        let mut engine = Engine::open(&entry.choice, Duration::ZERO).unwrap();
        let mut runs = [Seen::default(), Seen::default()];
        let mut is_over = false;
        while !is_over {
            for _ in 0..TICKS_PER_VIEW {
                is_over = engine.tick().unwrap().is_some();
            }
            for frame in engine.frames() {
                match frame.strip_prefix('+') {
                    Some(beside) => runs[1].add(beside),
                    None => runs[0].add(&frame),
                }
            }
        }
        assert_eq!(engine.orders().len(), entry.choice.orders.len());
        let count = 1 + usize::from(entry.choice.beside.is_some());
        assert_eq!(entry.expect.len(), count);
        for (run, expected) in runs.iter().zip(&entry.expect) {
            run.check(expected, engine.about());
        }
        assert_eq!(entry.ahead.is_some(), entry.choice.beside.is_some());
        if let Some(expected) = entry.ahead {
            assert_eq!(ahead(&runs, engine.about()), expected);
        }
    }
}

#[test]
fn the_book_lists_the_gallery() {
    let mut table = HEAD.to_owned();
    for Entry {
        title, see, source, ..
    } in gallery()
    {
        writeln!(table, "| {title} | {see} | {source} |").unwrap();
    }
    let page = include_str!("../../../docs/book/playground.md");
    assert!(page.contains(&table), "{table}");
}

#[test]
fn every_listed_scenario_and_allocator_can_be_chosen() {
    let list = choices();
    let names = |kind: &str| -> Vec<String> {
        let all = list[kind].as_array().unwrap().iter();
        all.map(|entry| entry["name"].as_str().unwrap().to_owned())
            .collect()
    };
    let vocabulary = Registry::current().vocabulary();
    assert_eq!(names("scenarios").len(), vocabulary.builtins().count());
    for name in names("scenarios") {
        let scenario = Some(name);
        let choice = Choice {
            scenario,
            ..Choice::default()
        };
        assert!(choice.setup().is_ok(), "{:?}", choice.scenario);
    }
    for name in names("allocators") {
        let allocator = Some(name);
        let choice = Choice {
            allocator,
            ..Choice::default()
        };
        let setup = choice.setup().unwrap();
        assert_eq!(setup.scenario.allocator, choice.allocator);
    }
}
