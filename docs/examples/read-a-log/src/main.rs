//! Prints the number of events of each robot and kind in a run folder.
//!
//! `cargo run -p read-a-log -- runs/latest`

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use missions::Registry;
use run_log::{EventRow, RunLog};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "runs/latest".to_owned());
    for ((robot, kind), times) in counts(Path::new(&folder))? {
        println!("{robot:<12} {kind:<20} {times}");
    }
    Ok(())
}

/// Counts the rows of events.csv by robot and kind.
fn counts(folder: &Path) -> Result<BTreeMap<(String, String), usize>, Box<dyn Error>> {
    let log = RunLog::open(folder, &Registry::current().vocabulary())?;
    let mut counts = BTreeMap::new();
    for event in log.rows::<EventRow>()? {
        *counts.entry((event.robot, event.kind)).or_default() += 1;
    }
    Ok(counts)
}
