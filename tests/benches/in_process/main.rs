//! Robot steps per second on one core in one process, for 3 to 10,000 robots.
//!
//! The reference is the world alone: the same bodies, sensors and physics without controllers, radio and log. Other
//! groups measure each allocator and other missions.
//!
//! `cargo bench -p alliance-tests --bench in_process [-- robots/100]`, `allocators` or `missions`; results:
//! BENCHMARKS.md.

// A benchmark uses the real clock and stops at the first error.
#![allow(clippy::disallowed_methods, clippy::unwrap_used)]

mod report;
mod run;
mod world;

use std::time::Duration;

use criterion::{Criterion, SamplingMode, Throughput};
use missions::Registry;
use run_log::LogLevel;

use run::Run;
use world::World;

/// Team sizes. Each team has two spills for every three robots.
const ROBOTS: [usize; 5] = [3, 10, 100, 1_000, 10_000];

/// Team sizes of the allocator group, without a log.
const ALLOCATOR_TEAMS: [usize; 4] = [3, 10, 30, 100];

/// The team size of the missions group, without a log.
const MISSION_TEAM: usize = 100;

/// The log levels of each team, in addition to the world alone.
const LEVELS: [LogLevel; 3] = [LogLevel::Off, LogLevel::Summary, LogLevel::Full];

/// The number of ticks of one iteration: one second of the mission, in which each robot broadcasts once.
///
/// In a large team most robots broadcast in the same few ticks, which take longer than the others.
const ROUND: u64 = 20;

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(3))
        .configure_from_args();
    for robots in ROBOTS {
        let mut group = criterion.benchmark_group(format!("robots/{robots}"));
        group.throughput(Throughput::Elements(robots as u64 * ROUND));
        // All samples have the same length, so that late samples count as much as early ones.
        group.sampling_mode(SamplingMode::Flat);
        group.bench_function("world", |bencher| {
            let mut world = World::new(robots);
            bencher.iter_custom(|rounds| world.time(rounds * ROUND));
        });
        for level in LEVELS {
            group.bench_function(level.as_str(), |bencher| {
                let mut run = Run::new(run::setup(robots), level);
                bencher.iter_custom(|rounds| run.time(rounds * ROUND));
            });
        }
        group.finish();
    }
    let known = Registry::built_in().vocabulary();
    for robots in ALLOCATOR_TEAMS {
        let mut group = criterion.benchmark_group(format!("allocators/{robots}"));
        group.throughput(Throughput::Elements(robots as u64 * ROUND));
        group.sampling_mode(SamplingMode::Flat);
        for allocator in &known.allocators {
            group.bench_function(allocator.name, |bencher| {
                let mut run = Run::new(run::with_allocator(robots, allocator.name), LogLevel::Off);
                bencher.iter_custom(|rounds| run.time(rounds * ROUND));
            });
        }
        group.finish();
    }
    let mut group = criterion.benchmark_group(format!("missions/{MISSION_TEAM}"));
    group.throughput(Throughput::Elements(MISSION_TEAM as u64 * ROUND));
    group.sampling_mode(SamplingMode::Flat);
    let missions = [
        ("service", run::service(MISSION_TEAM)),
        ("push", run::push(MISSION_TEAM)),
        ("observe", run::observe(MISSION_TEAM)),
    ];
    for (mission, setup) in &missions {
        group.bench_function(*mission, |bencher| {
            let mut run = Run::new(setup.clone(), LogLevel::Off);
            bencher.iter_custom(|rounds| run.time(rounds * ROUND));
        });
    }
    group.finish();
    criterion.final_summary();
    report::print(&ROBOTS);
    let names = known.allocators.iter().map(|allocator| allocator.name);
    report::print_each("allocators", &names.collect::<Vec<_>>(), &ALLOCATOR_TEAMS);
    report::print_each("missions", &missions.map(|(name, _)| name), &[MISSION_TEAM]);
}
