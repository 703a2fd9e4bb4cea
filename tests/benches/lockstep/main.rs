//! Real processes in lockstep: the rate against the limit of the bus, the cost of a stopped agent, and the cost of
//! local attackers.
//!
//! `cargo bench -p alliance-tests --bench lockstep -- [--agents 3,10] [--rounds 3] [--only rates|stop|hostile]
//! [--minutes 5]`; results: BENCHMARKS.md.

// A benchmark uses the real clock and stops at the first error.
#![allow(clippy::disallowed_methods, clippy::unwrap_used)]

mod bare;
mod figures;
mod hostile;
mod mission;
mod rates;
mod real;
mod stop;

use std::time::Duration;

use clap::{Parser, ValueEnum};

/// Measure runs by real processes.
#[derive(Parser)]
struct Options {
    /// Team sizes, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "3,10")]
    agents: Vec<usize>,
    /// Number of repetitions of each measurement
    #[arg(long, default_value_t = 3)]
    rounds: usize,
    /// Simulated duration of a run, in seconds
    #[arg(long, default_value_t = 1000.0)]
    limit: f64,
    /// Duration of an agent's stop, in minutes
    #[arg(long, default_value_t = 1.0 / 3.0)]
    minutes: f64,
    /// The only benchmark to run (default: all)
    #[arg(long)]
    only: Option<Part>,
    /// Ignored; `cargo bench` adds it
    #[arg(long, hide = true)]
    bench: bool,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Part {
    Rates,
    Stop,
    Hostile,
}

fn main() {
    cluster::session::prepare_process();
    let options = Options::parse();
    let wanted = |part| options.only.is_none_or(|only| only == part);
    if wanted(Part::Rates) {
        rates::default_mission(options.rounds);
        for agents in &options.agents {
            rates::measure(*agents, options.rounds, options.limit);
        }
    }
    if wanted(Part::Stop) {
        let stop = Duration::from_secs_f64(60.0 * options.minutes);
        stop::measure(options.rounds, stop);
    }
    if wanted(Part::Hostile) {
        hostile::measure(options.rounds, options.limit);
    }
}
