//! The robots and the faults of several tests, and readers of the folders that commands write.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use run_log::{RunLog, RunOutcome, TickRow};
use scenario::fault::{Fault, Order};

/// The hash of the default mission with seed 1.
pub const DEFAULT_HASH: &str = "cf2fc051d99e95cf";

/// The robots of the default mission, by rank.
pub const ROBOTS: [&str; 3] = ["blue", "gold", "green"];

/// Kills gold during its work, without a restart.
pub const KILL: &str = "[[faults.timeline]]\nat_s = 100.0\nfault.kill = \"gold\"\n";
/// Kills gold during its work and restarts it after 60 s.
pub const RESTART: &str =
    "[[faults.timeline]]\nat_s = 100.0\nfor_s = 60.0\nfault.kill = \"gold\"\n";
/// Separates green from the other two robots for 60 s.
pub const PARTITION: &str = "[[faults.timeline]]\nat_s = 60.0\nfor_s = 60.0\n\
     fault.partition = { groups = [[\"blue\", \"gold\"], [\"green\"]] }\n";

/// Returns a fault that drops this share of all messages.
#[must_use]
pub fn loss(share: f64) -> String {
    format!("[[faults.timeline]]\nat_s = 0.0\nfault.drop = {{ p = {share:?} }}\n")
}

/// Returns a loss of 30 % of all messages and a kill of `victim` at `at_s`.
#[must_use]
pub fn loss_and_kill(victim: &str, at_s: f64) -> Vec<Order> {
    let loss = toml::from_str("fault.drop = { p = 0.3 }\nat_s = 0.0").unwrap();
    let kill = Order {
        at_s: Some(at_s),
        ..Order::now(Fault::Kill(victim.to_owned()))
    };
    vec![loss, kill]
}

/// A row of a CSV table by column name.
pub type Row = BTreeMap<String, String>;

/// Returns the rows of a CSV table.
///
/// # Panics
///
/// If the text is no CSV table.
#[must_use]
pub fn rows(text: &[u8]) -> Vec<Row> {
    csv::Reader::from_reader(text)
        .deserialize()
        .map(|row| row.expect("a row has a cell for each column"))
        .collect()
}

/// Returns the bytes of each file in a folder and its subfolders, by path below the folder.
///
/// # Panics
///
/// If the folder cannot be read.
#[must_use]
pub fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("the folder is readable") {
        let path = entry.expect("the folder is readable").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if path.is_dir() {
            let below = files(&path).into_iter();
            found.extend(below.map(|(file, bytes)| (format!("{name}/{file}"), bytes)));
        } else {
            let bytes = fs::read(&path).expect("the file is readable");
            found.insert(name.into_owned(), bytes);
        }
    }
    found
}

/// Returns the files of a folder except journals, whose rows are in the order in which runs end.
#[must_use]
pub fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = files(folder);
    files.retain(|name, _| !name.ends_with(".jsonl"));
    files
}

/// Returns the number of complete rows in the journals of a folder. The first line of a journal is no row.
#[must_use]
pub fn journal_rows(folder: &Path) -> usize {
    let lines = |text: &[u8]| text.iter().filter(|byte| **byte == b'\n').count();
    let journals = fs::read_dir(folder).into_iter().flatten();
    let journals = journals.map(|entry| entry.unwrap().path());
    let journals = journals.filter(|path| path.extension().is_some_and(|end| end == "jsonl"));
    journals
        .map(|path| lines(&fs::read(path).unwrap()).saturating_sub(1))
        .sum()
}

/// Checks that the log of a run with a killed world is readable and complete up to a tick.
#[track_caller]
pub fn assert_whole_up_to_a_tick(log: &RunLog) {
    assert_eq!(log.run.outcome, RunOutcome::Running);
    let last = log.last.as_ref().unwrap().tick;
    assert!(last > 0);
    let rows = log.rows::<TickRow>().unwrap().into_iter();
    let ticks: BTreeSet<u64> = rows
        .filter(|row| row.section == "run")
        .map(|row| row.tick)
        .collect();
    let missing: Vec<u64> = (0..=last).filter(|tick| !ticks.contains(tick)).collect();
    assert_eq!(missing, Vec::<u64>::new(), "ticks up to {last}");
}

/// Returns the number in a cell.
///
/// # Panics
///
/// If the cell contains no number.
#[must_use]
#[track_caller]
pub fn number(row: &Row, column: &str) -> f64 {
    let cell = &row[column];
    cell.parse()
        .unwrap_or_else(|_| panic!("{column} is '{cell}'"))
}

/// Returns the contents of the tracked files with an ending, without the tests if they are sources.
#[must_use]
pub fn tracked(ending: &str) -> Vec<String> {
    let root = in_repository("");
    let output = Command::new("git")
        .args(["ls-files", ending])
        .current_dir(&root)
        .output();
    let Ok(output) = output else {
        return Vec::new();
    };
    let names = String::from_utf8_lossy(&output.stdout);
    let is_test = |name: &str| {
        ["tests/", "benches/", "fuzz/", "examples/", "testkit/"]
            .iter()
            .any(|part| name.starts_with(part) || name.contains(&format!("/{part}")))
            || name.ends_with("/tests.rs")
            || name.ends_with("_tests.rs")
    };
    let wanted = names
        .lines()
        .filter(|name| ending == "*.md" || !is_test(name));
    wanted
        .filter_map(|name| fs::read_to_string(root.join(name)).ok())
        .collect()
}

/// Returns the path of a file of the repository.
#[must_use]
pub fn in_repository(path: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    root.join(path)
}

/// Returns the path of a plan in the folder `campaigns`.
#[must_use]
pub fn campaign(name: &str) -> String {
    let plan = in_repository(&format!("campaigns/{name}.toml"));
    plan.display().to_string()
}
