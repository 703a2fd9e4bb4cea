//! Compares every row of motivations.csv with the independent calculation of `alliance_tests::recompute` from the
//! received messages in the log.

use missions::Registry;
use run_log::RunFile;
use std::collections::BTreeSet;
use std::path::Path;

use alliance_tests::mishaps::{self, Rates};
use alliance_tests::recompute::{Comparison, compare, recompute};
use in_process::Team as InProcess;
use run_log::recorder::Recorder;
use run_log::{Document, EventRow, LogLevel, MemoryLog, MessageRow, MotivationRow, RunLog};
use scenario::{Preset, Scenario, Setup, StepOrder};

const PRESETS: [Preset; 3] = [Preset::Thesis, Preset::Par98, Preset::Team];
const ORDERS: [StepOrder; 2] = [StepOrder::Simultaneous, StepOrder::InOrder];

/// Returns all built-in scenarios with ALLIANCE, every preset and every step order. Large teams run for a shorter
/// time.
fn all_setups(limit_s: f64, seed: u64) -> Vec<Setup> {
    let mut setups = Vec::new();
    for builtin in Registry::built_in().vocabulary().builtins() {
        for preset in PRESETS {
            for order in ORDERS {
                let mut scenario = Scenario::parse(
                    builtin.name,
                    builtin.text,
                    &Registry::built_in().vocabulary(),
                )
                .unwrap();
                let is_large = scenario.robots.len() > 10;
                scenario.limit_s = if is_large { limit_s / 25.0 } else { limit_s };
                scenario.allocator = None;
                scenario.alliance.preset = preset;
                scenario.step_order = Some(order);
                setups.push(Setup::resolve(scenario, seed, None).unwrap().setup);
            }
        }
    }
    setups
}

pub fn log_of(recorder: Recorder<MemoryLog>) -> RunLog {
    let memory = recorder.into_sink();
    let run = RunFile::parse(
        memory.documents[&Document::Run].as_bytes(),
        &Registry::built_in().vocabulary(),
    )
    .unwrap();
    RunLog::from_tables(Path::new("memory"), run, memory.tables)
}

#[track_caller]
fn assert_no_mismatch(comparison: &Comparison, of: &str) {
    assert!(comparison.rows > 0, "{of} has no rows");
    assert!(
        comparison.mismatches.is_empty(),
        "{} of {} rows of {of} differ, the first of them: {:#?}",
        comparison.mismatches.len(),
        comparison.rows,
        comparison.mismatches[0]
    );
}

fn name_of(setup: &Setup) -> String {
    let alliance = &setup.scenario.alliance;
    format!(
        "{} with {:?}, {}, seed {}",
        setup.scenario.name,
        alliance.preset,
        setup.step_order.as_str(),
        setup.seed
    )
}

#[test]
fn every_motivation_row_of_every_scenario_preset_and_step_order_agrees() {
    for setup in all_setups(150.0, 1) {
        let name = name_of(&setup);
        let team = InProcess::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
        let (_, recorder) = team.run().unwrap();
        assert_no_mismatch(&recompute(&log_of(recorder)).unwrap(), &name);
    }
}

#[test]
fn every_motivation_row_agrees_under_crashes_stalls_and_message_loss() {
    let rates = Rates {
        loss: 0.2,
        death: 0.002,
        stall: 0.002,
        back: 0.01,
        order: 0.0,
    };
    for (seed, setup) in (1..).zip(all_setups(400.0, 2)) {
        let name = name_of(&setup);
        let log = log_of(mishaps::run(&setup, rates, seed).unwrap());
        assert_no_mismatch(&recompute(&log).unwrap(), &name);

        // The run must contain all these events.
        let events: Vec<EventRow> = log.rows().unwrap();
        let kinds: BTreeSet<&str> = events.iter().map(|row| row.kind.as_str()).collect();
        for kind in ["gone", "joined", "stalled", "back", "lost"] {
            assert!(kinds.contains(kind), "no '{kind}' in {name}");
        }
        let joins = events.iter().filter(|row| row.kind == "joined").count();
        assert!(joins > setup.scenario.robots.len(), "{name}");
    }
}

/// The comparison must detect errors, otherwise it proves nothing.
#[test]
fn a_wrong_row_and_a_missing_message_are_detected() {
    let setup = all_setups(100.0, 1).swap_remove(0);
    let alliance = setup.alliance.clone();
    let team = InProcess::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
    let log = log_of(team.run().unwrap().1);
    let motivations: Vec<MotivationRow> = log.rows().unwrap();
    let messages: Vec<MessageRow> = log.rows().unwrap();
    let events: Vec<EventRow> = log.rows().unwrap();

    type Change = fn(&mut MotivationRow);
    let changes: [Change; 5] = [
        |row| row.motivation += 1e-12,
        |row| row.impatience /= 2.0,
        |row| row.activity_suppression ^= true,
        |row| row.impatience_reset ^= true,
        |row| row.acquiescence ^= true,
    ];
    for change in changes {
        let mut rows = motivations.clone();
        change(&mut rows[1234]);
        let mismatches = compare(&alliance, &rows, &messages, &events).mismatches;
        assert_eq!(
            mismatches.len(),
            1,
            "the calculation continues with its own values"
        );
        assert_eq!(mismatches[0].calculated, motivations[1234]);
    }

    let first = messages.iter().position(|row| row.state == "executing");
    let mut rest = messages.clone();
    rest.remove(first.unwrap());
    assert!(
        !compare(&alliance, &motivations, &rest, &events)
            .mismatches
            .is_empty()
    );
}
