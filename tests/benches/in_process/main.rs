//! Robot steps per second in one process: on one core for 3 to 10,000 robots and for each allocator, and on all cores for
//! large teams.
//!
//! The reference is the world alone: the same bodies, sensors and physics without controllers, radio and log.
//!
//! `cargo bench -p alliance-tests --bench in_process [-- robots/100]`, `allocators`, `points` or `threads`; results:
//! BENCHMARKS.md.

// A benchmark uses the real clock and stops at the first error.
#![allow(clippy::disallowed_methods, clippy::unwrap_used)]

#[path = "../lockstep/figures.rs"]
mod figures;
mod points;
mod subject;

use std::num::NonZeroUsize;
use std::thread::available_parallelism;
use std::time::Duration;

use alliance_tests::runs::allocators;
use mimalloc::MiMalloc;
use missions::service::data::CostMeasure;
use run_log::LogLevel;
use scenario::Scenario;

use figures::{Figures, print};
use subject::{Run, World, setup};

/// The memory allocator of the program.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

/// Team sizes. Each team has two spills for every three robots.
const ROBOTS: [usize; 5] = [3, 10, 100, 1_000, 10_000];

/// Team sizes of the allocators, without a log.
const ALLOCATOR_TEAMS: [usize; 2] = [3, 100];

/// Team sizes with one thread and with one per core.
const LARGE_TEAMS: [usize; 3] = [300, 1_000, 10_000];

/// The number of samples of a measurement, and the least duration of a sample.
const SAMPLES: usize = 10;
const LEAST: Duration = Duration::from_millis(300);

/// The number of ticks of one round: one second of the mission, in which each robot broadcasts once.
///
/// In a large team most robots broadcast in the same few ticks, which take longer than the others.
const ROUND: u64 = 20;

/// Returns thousands of robot steps per second. `time` runs ticks and returns their duration.
fn steps(robots: usize, mut time: impl FnMut(u64) -> Duration) -> Figures {
    let mut figures = Figures::default();
    let once_s = time(ROUND).as_secs_f64();
    let rounds = (LEAST.as_secs_f64() / once_s).ceil() as u64;
    for _ in 0..SAMPLES {
        let ticks = rounds * ROUND;
        let steps = (ticks * robots as u64) as f64;
        figures.push(steps / time(ticks).as_secs_f64() / 1e3);
    }
    figures
}

/// Prints the ratio of the rates with one thread and with one per core, in turns, and the serial share s of the work that
/// follows from Amdahl's law, `ratio = 1 / (s + (1 - s) / cores)`.
fn compare_threads(name: &str, robots: usize, level: LogLevel) {
    let cores = available_parallelism().map_or(1, NonZeroUsize::get);
    let setup = setup(robots, Scenario::DEFAULT_ALLOCATOR);
    let mut runs = [1, cores].map(|threads| Run::new(setup.clone(), level, threads));
    let ticks = ROUND * (20_000 / robots as u64).max(1);
    let (mut ratios, mut serial) = (Figures::default(), Figures::default());
    for _ in 0..SAMPLES {
        let [alone, together] = runs.each_mut().map(|run| {
            let duration = run.time(ticks).min(run.time(ticks));
            duration.as_secs_f64()
        });
        let (ratio, cores) = (alone / together, cores as f64);
        ratios.push(ratio);
        serial.push((cores / ratio - 1.0) / (cores - 1.0).max(1.0));
    }
    println!("{name}: {cores} threads / 1 thread {ratios}, serial share {serial}");
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let filter = arguments.find(|argument| !argument.starts_with("--"));
    let mut results = Vec::new();
    let mut measure = |name: String, measured: &dyn Fn() -> Figures| {
        if filter.as_ref().is_none_or(|filter| name.contains(filter)) {
            results.push((name, measured()));
        }
    };
    for robots in ROBOTS {
        measure(format!("robots/{robots}, world alone"), &|| {
            let mut world = World::new(robots);
            steps(robots, |ticks| world.time(ticks))
        });
        for level in [LogLevel::Off, LogLevel::Summary, LogLevel::Full] {
            let name = format!("robots/{robots}, log {}", level.as_str());
            measure(name, &|| {
                let mut run = Run::new(setup(robots, Scenario::DEFAULT_ALLOCATOR), level, 1);
                steps(robots, |ticks| run.time(ticks))
            });
        }
    }
    for robots in ALLOCATOR_TEAMS {
        for allocator in allocators() {
            measure(format!("allocators/{robots}, {allocator}"), &|| {
                let mut run = Run::new(setup(robots, allocator), LogLevel::Off, 1);
                steps(robots, |ticks| run.time(ticks))
            });
        }
    }
    for (class, change) in points::CLASSES {
        for costs in [CostMeasure::Line, CostMeasure::Path] {
            // Costs by path differ only with walls.
            if costs == CostMeasure::Path && !["walls", "all"].contains(&class) {
                continue;
            }
            measure(
                format!("points/{class}, costs by {costs:?}").to_lowercase(),
                &|| {
                    let setup = points::setup(class, change, costs);
                    let mut run = Run::new(setup, LogLevel::Off, 1);
                    steps(points::ROBOTS, |ticks| run.time(ticks))
                },
            );
        }
    }
    for robots in LARGE_TEAMS {
        for level in [LogLevel::Off, LogLevel::Full] {
            let name = format!("threads/{robots}, log {}", level.as_str());
            if filter.as_ref().is_none_or(|filter| name.contains(filter)) {
                compare_threads(&name, robots, level);
            }
        }
    }
    println!("\nthousand robot-steps per second and core\n");
    print(
        results
            .iter()
            .map(|(name, figures)| (name.clone(), figures)),
    );
}
