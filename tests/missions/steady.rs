//! The allocation of memory in steady state: a tick without events reuses the memory of earlier ticks.

use alliance_tests::runs::{self, log_of, run};
use missions::observe::data::{OBSERVE, ObserveSection};
use missions::service::data::SERVICE;
use missions::waste::data::{WasteSection, family};
use std::collections::BTreeSet;

use run_log::{EventRow, LogLevel};
use scenario::time::SimTime;
use scenario::{Scenario, Setup};

/// The number of ticks before the measurement. By then all robots have sent and received each kind of message.
const WARM: u64 = 1_200;
const END: u64 = 3_000;

/// Resolves a scenario up to the end of the measurement.
fn until_end(mut scenario: Scenario) -> Setup {
    scenario.limit_s = SimTime(END * scenario.step_ms).as_secs_f64();
    runs::setup(scenario, 1)
}

/// Returns the ticks that have a row in events.csv.
fn ticks_with_events(setup: &Setup) -> BTreeSet<u64> {
    let rows: Vec<EventRow> = log_of(run(setup.clone(), LogLevel::Full).1).rows().unwrap();
    let step_ms = setup.scenario.step_ms;
    rows.iter().map(|row| row.t_ms.0 / step_ms).collect()
}

/// In the larger teams each robot has some teammates in radio range. The service missions have more work than the test
/// needs. Targets appear and disappear often, so only ticks without such a change count.
#[test]
fn a_tick_without_events_allocates_no_memory() {
    for (robots, spills) in [(3, 2), (30, 20)] {
        for allocator in ["alliance", "l-alliance", "ble", "murdoch"] {
            let mut scenario = family(robots, spills);
            WasteSection::of_mut(&mut scenario).border_known = true;
            scenario.allocator = Some(allocator.to_owned());
            assert_steady(robots, until_end(scenario));
        }
    }
    for (robots, points) in [(3, 20), (30, 200)] {
        for allocator in ["alliance", "l-alliance", "nearest"] {
            let mut scenario = SERVICE.family(robots, points).unwrap();
            scenario.allocator = Some(allocator.to_owned());
            assert_steady(robots, until_end(scenario));
        }
    }
    for (robots, targets) in [(3, 3), (30, 10)] {
        let mut scenario = OBSERVE.family(robots, targets).unwrap();
        let duration_s = SimTime((END + 1) * scenario.step_ms).as_secs_f64();
        let section: &mut ObserveSection = scenario.mission.values_mut().unwrap();
        section.duration_s = duration_s;
        assert_steady(robots, until_end(scenario));
    }
    assert_steady(12, until_end(missions::push::data::family(12, 6)));
}

fn assert_steady(robots: usize, setup: Setup) {
    let name = format!("{robots} robots, {:?}", setup.scenario.allocator);
    let event_ticks = ticks_with_events(&setup);
    let mut team = runs::team(setup, LogLevel::Off);
    let (mut quiet, mut allocating) = (0, Vec::new());
    for tick in 0..END {
        let measured = allocation_counter::measure(|| _ = team.tick().unwrap());
        if tick < WARM || event_ticks.contains(&tick) {
            continue;
        }
        quiet += 1;
        if measured.count_total > 0 {
            allocating.push((tick, measured.count_total));
        }
    }
    assert!(quiet > 500, "{name}: {quiet} ticks without events");
    // New messages reuse the memory of old ones, which must grow when a robot learns of more places.
    let are_few = allocating.len() * 20 <= quiet;
    assert!(are_few, "{name}: of {quiet} ticks: {allocating:?}");
}
