//! Waste missions in many random rooms: `cargo run --release -p alliance-tests --example rooms -- [FIRST [LAST]]`.
//!
//! Prints each room that was not completed within three times the median duration, and a summary.

use alliance_tests::closed_loop::{Mission, run};
use alliance_tests::rooms::random_room;
use proto::tick::Outcome;

fn main() {
    let mut arguments = std::env::args()
        .skip(1)
        .filter_map(|argument| argument.parse().ok());
    let first: u64 = arguments.next().unwrap_or(1);
    let last = arguments.next().unwrap_or(200);
    let missions: Vec<(u64, Mission)> = (first..=last)
        .map(|seed| (seed, run(random_room(seed), seed, |_, _, _| ())))
        .collect();
    let mut times: Vec<f64> = missions
        .iter()
        .map(|(_, mission)| mission.took.as_secs_f64())
        .collect();
    times.sort_by(f64::total_cmp);
    let median = times[times.len() / 2];
    let mut passed = 0;
    for (seed, mission) in &missions {
        if mission.outcome == Outcome::Complete && mission.took.as_secs_f64() <= 3.0 * median {
            passed += 1;
        } else {
            println!(
                "room {seed}: {} after {}, {:?}",
                mission.outcome.as_str(),
                mission.took,
                mission.items
            );
        }
    }
    println!(
        "{passed} of {} within three times the median of {median:.0} s; longest {:.0} s",
        missions.len(),
        times[times.len() - 1]
    );
}
