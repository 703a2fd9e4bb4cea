//! Compares every row of motivations.csv with the independent calculation of `alliance_tests::recompute` from the
//! received messages in the log.

use alliance_tests::fault_fuzzer::{self, Coverage, Fuzz};
use alliance_tests::recompute::{Comparison, compare, recompute};
use alliance_tests::runs::{builtin, log_of, parse, run, setup, vocabulary};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use run_log::{EventRow, LogLevel, MessageRow, MotivationRow};
use scenario::{HistoryOrigin, Preset, Setup, StepOrder, SwitchSection};

const PRESETS: [Preset; 3] = [Preset::Thesis, Preset::Par98, Preset::Team];
const ORDERS: [StepOrder; 2] = [StepOrder::Simultaneous, StepOrder::InOrder];

/// Messages arrive late, in another order and twice.
const LINKS: &str = "[[faults.timeline]]\nfault.delay = { delay_s = 0.2, jitter_s = 1.0 }\n\
    [[faults.timeline]]\nfault.duplicate = { p = 0.2 }\n\
    [[faults.timeline]]\nfault.reorder = { p = 0.2 }\n";

/// Returns all built-in scenarios with ALLIANCE and every preset, in turn with both step orders, and with random
/// switches. Large teams run for a shorter time.
fn all_setups(limit_s: f64, seed: u64) -> Vec<Setup> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut flag = || Some(rng.random_bool(0.5));
    let known = vocabulary();
    let names = known.builtins().map(|builtin| builtin.name);
    let all = names.flat_map(|name| PRESETS.map(|preset| (name, preset)));
    all.zip(ORDERS.into_iter().cycle())
        .map(|((name, preset), order)| {
            let mut scenario = builtin(name);
            let is_large = scenario.robots.len() > 10;
            scenario.limit_s = if is_large { limit_s / 50.0 } else { limit_s };
            scenario.allocator = None;
            scenario.alliance.preset = preset;
            let origin = flag().map(|is_late| match is_late {
                true => HistoryOrigin::Progress,
                false => HistoryOrigin::MissionStart,
            });
            scenario.alliance.switches = SwitchSection {
                waiting: flag(),
                waiting_counts: flag(),
                wish_when_suppressed: flag(),
                reset_stops_active: flag(),
                history_origin: origin,
                arbitration: flag(),
                release_message: flag(),
                idle_heartbeat: flag(),
                ..SwitchSection::default()
            };
            scenario.faults.timeline = parse(LINKS).faults.timeline;
            scenario.step_order = Some(order);
            setup(scenario, seed)
        })
        .collect()
}

#[track_caller]
fn assert_no_mismatch(comparison: &Comparison, of: &str) {
    assert!(comparison.rows > 0, "{of} has no rows");
    let (rows, mismatches) = (comparison.rows, &comparison.mismatches);
    let (count, first) = (mismatches.len(), mismatches.first());
    assert_eq!(count, 0, "of {rows} rows of {of}, first: {first:#?}");
}

fn name_of(setup: &Setup) -> String {
    let preset = setup.scenario.alliance.preset;
    let (name, order) = (&setup.scenario.name, setup.step_order.as_str());
    format!("{name} with {preset:?}, {order}, seed {}", setup.seed)
}

#[test]
fn every_motivation_row_agrees_under_crashes_stalls_and_link_faults() {
    let mut resets = 0;
    let mut counts = ["gone", "joined", "stalled", "back", "lost"].map(|kind| (kind, 0));
    let setups = all_setups(120.0, 2);
    let runs = setups.len();
    for (seed, setup) in (1..).zip(setups) {
        let name = name_of(&setup);
        let fuzz = Fuzz {
            seed,
            ticks: u64::MAX,
            calm: 0.9,
            loss: 0.2,
        };
        let recorder = fault_fuzzer::run(&setup, fuzz, &mut Coverage::new());
        let log = log_of(recorder.unwrap());
        assert_no_mismatch(&recompute(&log).unwrap(), &name);

        let events: Vec<EventRow> = log.rows().unwrap();
        for (kind, count) in &mut counts {
            *count += usize::from(events.iter().any(|row| row.kind == *kind));
        }
        let rows = log.each_row::<MotivationRow>().map(|row| row.unwrap());
        resets += rows.filter(|row| !row.impatience_reset).count();
    }
    // Short runs may lack some events.
    let are_many = counts.iter().all(|(_, count)| 4 * count > 3 * runs);
    assert!(are_many, "{counts:?} of {runs}");
    assert!(resets > 300, "{resets}");
}

/// The comparison must detect errors, otherwise it proves nothing.
#[test]
fn a_wrong_row_and_a_missing_message_are_detected() {
    let setup = all_setups(100.0, 1).swap_remove(0);
    let alliance = setup.alliance.clone();
    let log = log_of(run(setup, LogLevel::Full).1);
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
        // The calculation continues with its own values.
        assert_eq!(mismatches.len(), 1);
        assert_eq!(mismatches[0].calculated, motivations[1234]);
    }

    let first = messages.iter().position(|row| row.state == "executing");
    let mut rest = messages.clone();
    rest.remove(first.unwrap());
    let mismatches = compare(&alliance, &motivations, &rest, &events).mismatches;
    assert!(!mismatches.is_empty());
}
