//! A tick in which robots just go on with their work does not allocate (issue "One process, thousands of runs", item 4):
//! what a step needs is there from the step before.

use missions::observe::data::{OBSERVE, ObserveSection};
use missions::service::data::SERVICE;
use missions::waste::data::{WasteSection, family};
use std::collections::BTreeSet;

use alliance_proto::log::{EventRow, LogLevel, Memory};
use alliance_proto::scenario::Setup;
use alliance_proto::time::SimTime;
use in_process::Team;

use crate::negotiation::NEGOTIATORS;
use crate::recompute::log_of;

/// Ticks before the first that counts: by then everybody has said and heard everything once.
const WARM: u64 = 1_200;
/// The last.
const END: u64 = 4_000;

fn setup(robots: usize, spills: usize, allocator: &str) -> Setup {
    let mut scenario = family(robots, spills);
    WasteSection::of_mut(&mut scenario).border_known = true;
    scenario.allocator = Some(allocator.to_owned());
    scenario.limit_s = (SimTime(END * scenario.step_ms)).as_secs_f64();
    Setup::resolve(scenario, 1, None).unwrap().setup
}

/// The ticks in which something happens that has a row in events.csv.
fn eventful(setup: &Setup) -> BTreeSet<u64> {
    let team = Team::new(setup.clone(), LogLevel::Full, Memory::default()).unwrap();
    let rows: Vec<EventRow> = log_of(team.run().unwrap().1).rows().unwrap();
    let step_ms = setup.scenario.step_ms;
    rows.iter().map(|row| row.t_ms.0 / step_ms).collect()
}

#[test]
fn a_tick_without_events_asks_for_no_memory() {
    // Of the larger team everybody hears some and nobody all.
    for (robots, spills) in [(3, 2), (30, 20)] {
        for allocator in ["alliance", "l-alliance"].into_iter().chain(NEGOTIATORS) {
            steady(robots, setup(robots, spills, allocator));
        }
    }
}

/// Service, with work for longer than is looked at.
#[test]
fn a_tick_of_service_without_events_asks_for_no_memory() {
    for (robots, points) in [(3, 20), (30, 200)] {
        for allocator in ["alliance", "l-alliance", "nearest"] {
            let mut scenario = SERVICE.family(robots, points).unwrap();
            scenario.allocator = Some(allocator.to_owned());
            scenario.limit_s = (SimTime(END * scenario.step_ms)).as_secs_f64();
            steady(robots, Setup::resolve(scenario, 1, None).unwrap().setup);
        }
    }
}

/// Targets come into sight and go all the time: it is for ticks in which none does.
#[test]
fn a_tick_of_observe_in_which_nothing_comes_into_sight_asks_for_no_memory() {
    for (robots, targets) in [(3, 3), (30, 10)] {
        let mut scenario = OBSERVE.family(robots, targets).unwrap();
        let section: &mut ObserveSection = scenario.mission.values_mut().unwrap();
        section.duration_s = (SimTime((END + 1) * scenario.step_ms)).as_secs_f64();
        scenario.limit_s = (SimTime(END * scenario.step_ms)).as_secs_f64();
        steady(robots, Setup::resolve(scenario, 1, None).unwrap().setup);
    }
}

/// Robots at their ends of bars, in turns.
#[test]
fn pushing_asks_for_no_memory() {
    let mut scenario = missions::push::data::family(12, 6);
    scenario.limit_s = (SimTime(END * scenario.step_ms)).as_secs_f64();
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    steady(12, setup);
}

fn steady(robots: usize, setup: Setup) {
    let allocator = setup.scenario.allocator.clone();
    let eventful = eventful(&setup);
    let mut team = Team::new(setup, LogLevel::Off, Memory::default()).unwrap();
    let (mut quiet, mut asking) = (0_u64, Vec::new());
    for tick in 0..END {
        let asked = allocation_counter::measure(|| {
            team.tick().unwrap();
        });
        if tick < WARM || eventful.contains(&tick) {
            continue;
        }
        quiet += 1;
        if asked.count_total > 0 {
            asking.push((tick, asked.count_total));
        }
    }
    assert!(
        quiet > 500,
        "{allocator:?}, {robots} robots: {quiet} ticks without events"
    );
    // Messages are written into the memory of old ones, which has to grow where somebody knows of more places than before.
    assert!(
        asking.len() as u64 * 20 <= quiet,
        "{allocator:?}, {robots} robots: of {quiet} ticks without events {} ask for memory: {:?}",
        asking.len(),
        &asking[..asking.len().min(20)]
    );
}
