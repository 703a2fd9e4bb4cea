//! The general crates are independent of the missions: terms of the waste mission occur only in its own folder.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

const TERMS: [&str; 6] = [
    "waste",
    "spill",
    "deposit",
    "report_site",
    "report site",
    "clean-up",
];

/// The files that may contain these terms.
const EXCEPTIONS: [&str; 3] = [
    // What a person places in the room, for all missions.
    "playground/src/edit/kinds.rs",
    // The key `waste_range_m` is older than the second mission.
    "scenario/src/lib.rs",
    "scenario/src/validate.rs",
];

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let is_test = ["tests", "tests.rs", "tampered.rs", "snapshots"].contains(&name.as_str());
        if path.is_dir() && !is_test && name != "vendor" {
            files(&path, found);
        } else if path.is_file() && !is_test && name != "README.md" {
            found.push(path);
        }
    }
}

#[test]
fn no_file_outside_the_missions_crate_uses_a_term_of_the_waste_mission() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut all = Vec::new();
    for folder in [
        "terminal/src",
        "scenario/src",
        "proto/src",
        "run-log/src",
        "cluster/src",
        "world-server/src",
        "robot-agent/src",
        "observation/src",
        "playground/src",
        "analysis/src",
        "launch/src",
        "launch/page",
    ] {
        files(&root.join(folder), &mut all);
    }
    assert!(all.len() > 300, "{}", all.len());
    let mut with_terms = BTreeSet::new();
    for path in all {
        let text = fs::read_to_string(&path).unwrap_or_default().to_lowercase();
        // Tests may use any mission.
        let code = text.split("mod tests {").next().unwrap_or_default();
        if TERMS.iter().any(|term| code.contains(term)) {
            let name = path.strip_prefix(&root).unwrap();
            with_terms.insert(name.to_string_lossy().into_owned());
        }
    }
    assert_eq!(with_terms, EXCEPTIONS.map(str::to_owned).into());
}
