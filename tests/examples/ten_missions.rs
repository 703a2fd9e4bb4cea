//! Rows of ten missions with wrong initial estimates: `cargo run --release -p alliance-tests --example ten_missions`.
//!
//! Prints the tables of docs/allocators/l-alliance.md.

use alliance_tests::ten_missions::{error, mission, ten, wrong_by};
use scenario::Profile;

/// The number of rows of ten missions. The first row has the seeds 1 to 10.
const ROWS: usize = 20;

fn main() {
    let begins = [
        ("nothing", Profile::default()),
        ("a tenth", wrong_by(0.1)),
        ("ten times", wrong_by(10.0)),
    ];
    let reference: Vec<f64> = (1..=10 * ROWS as u64)
        .map(|seed| mission("", seed, Profile::default()).took_s)
        .collect();
    println!("alliance: {:.0?}", &reference[..10]);
    let lines = learning("IV");
    let each: Vec<f64> = (1..=10)
        .map(|seed| mission(&lines, seed, Profile::default()).took_s)
        .collect();
    println!("l-alliance, each from nothing: {each:.0?}");
    let reference_profile = &ten(&lines, 1, Profile::default())[9].learned;
    for (name, begin) in &begins {
        let done = ten(&lines, 1, begin.clone());
        let took_s: Vec<f64> = done.iter().map(|mission| mission.took_s).collect();
        println!("l-alliance, from {name}: {took_s:.0?}");
        if !begin.is_empty() {
            let known = [begin]
                .into_iter()
                .chain(done.iter().map(|mission| &mission.learned));
            let errors: Vec<f64> = known.map(|known| error(known, reference_profile)).collect();
            println!("  wrong by {errors:.1?}");
        }
    }
    println!("slower than alliance in the first to the tenth mission, %, mean of {ROWS} rows");
    for strategy in ["I", "II", "III", "IV"] {
        let lines = learning(strategy);
        for (name, begin) in &begins {
            let mut slower = [0.0; 10];
            for (row, reference) in reference.chunks(10).enumerate() {
                let done = ten(&lines, 10 * row as u64 + 1, begin.clone());
                for (place, (mission, of_s)) in done.iter().zip(reference).enumerate() {
                    slower[place] += 100.0 * (mission.took_s / of_s - 1.0) / ROWS as f64;
                }
            }
            println!("{strategy} from {name}: {slower:+.1?}");
        }
    }
}

fn learning(strategy: &str) -> String {
    format!("allocator = \"l-alliance\"\n[allocators.l-alliance]\nstrategy = \"{strategy}\"\n")
}
