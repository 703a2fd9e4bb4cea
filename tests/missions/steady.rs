//! The allocation of memory in steady state: a tick without events reuses the memory of earlier ticks.

use alliance_tests::runs::{self, log_of, run};
use missions::observe::data::{OBSERVE, ObserveSection};
use missions::service::data::SERVICE;
use missions::waste::data::{WasteSection, family};
use std::collections::BTreeSet;

use run_log::{EventRow, LogLevel};
use scenario::Setup;
use scenario::time::SimTime;

/// The number of ticks before the measurement. By then all robots have sent and received each kind of message.
const WARM: u64 = 1_200;
const END: u64 = 3_000;

fn setup(robots: usize, spills: usize, allocator: &str) -> Setup {
    let mut scenario = family(robots, spills);
    WasteSection::of_mut(&mut scenario).border_known = true;
    scenario.allocator = Some(allocator.to_owned());
    scenario.limit_s = (SimTime(END * scenario.step_ms)).as_secs_f64();
    runs::setup(scenario, 1)
}

/// Returns the ticks that have a row in events.csv.
fn ticks_with_events(setup: &Setup) -> BTreeSet<u64> {
    let rows: Vec<EventRow> = log_of(run(setup.clone(), LogLevel::Full).1).rows().unwrap();
    let step_ms = setup.scenario.step_ms;
    rows.iter().map(|row| row.t_ms.0 / step_ms).collect()
}

#[test]
fn a_tick_without_events_allocates_no_memory() {
    // In the larger team each robot has some teammates in radio range.
    for (robots, spills) in [(3, 2), (30, 20)] {
        for allocator in ["alliance", "l-alliance", "ble", "murdoch"] {
            assert_steady(robots, setup(robots, spills, allocator));
        }
    }
}

/// The service missions have more work than the test needs.
#[test]
fn a_service_tick_without_events_allocates_no_memory() {
    for (robots, points) in [(3, 20), (30, 200)] {
        for allocator in ["alliance", "l-alliance", "nearest"] {
            let mut scenario = SERVICE.family(robots, points).unwrap();
            scenario.allocator = Some(allocator.to_owned());
            scenario.limit_s = (SimTime(END * scenario.step_ms)).as_secs_f64();
            assert_steady(robots, runs::setup(scenario, 1));
        }
    }
}

/// Targets appear and disappear often, so only ticks without such a change count.
#[test]
fn an_observe_tick_without_events_allocates_no_memory() {
    for (robots, targets) in [(3, 3), (30, 10)] {
        let mut scenario = OBSERVE.family(robots, targets).unwrap();
        let section: &mut ObserveSection = scenario.mission.values_mut().unwrap();
        section.duration_s = (SimTime((END + 1) * scenario.step_ms)).as_secs_f64();
        scenario.limit_s = (SimTime(END * scenario.step_ms)).as_secs_f64();
        assert_steady(robots, runs::setup(scenario, 1));
    }
}

#[test]
fn a_push_tick_without_events_allocates_no_memory() {
    let mut scenario = missions::push::data::family(12, 6);
    scenario.limit_s = (SimTime(END * scenario.step_ms)).as_secs_f64();
    let setup = runs::setup(scenario, 1);
    assert_steady(12, setup);
}

fn assert_steady(robots: usize, setup: Setup) {
    let allocator = setup.scenario.allocator.clone();
    let event_ticks = ticks_with_events(&setup);
    let mut team = runs::team(setup, LogLevel::Off);
    let (mut quiet, mut allocating) = (0_u64, Vec::new());
    for tick in 0..END {
        let measured = allocation_counter::measure(|| {
            team.tick().unwrap();
        });
        if tick < WARM || event_ticks.contains(&tick) {
            continue;
        }
        quiet += 1;
        if measured.count_total > 0 {
            allocating.push((tick, measured.count_total));
        }
    }
    assert!(
        quiet > 500,
        "{allocator:?}, {robots} robots: {quiet} ticks without events"
    );
    // New messages reuse the memory of old ones, which must grow when a robot learns of more places.
    assert!(
        allocating.len() as u64 * 20 <= quiet,
        "{allocator:?}, {robots} robots: of {quiet} ticks without events {} allocate memory: {:?}",
        allocating.len(),
        &allocating[..allocating.len().min(20)]
    );
}
