//! Reports and pages of large logs need less than 1 GB of memory.

use std::fs::File;
use std::process::Command;

use alliance_tests::harness::{Lab, alliance};
use alliance_tests::operator::peak_memory;

/// The limit of a report and of a page, KiB.
const LIMIT_KIB: u64 = 1_000_000_000 / 1024;

/// Writes a report of the folder `run` with this limit of memory, KiB. A larger request for memory aborts the process.
/// Returns stderr.
#[track_caller]
fn report_within(lab: &Lab, kib: u64) -> String {
    let script = format!("ulimit -d {kib}; exec \"$0\" report run --out report");
    let output = Command::new("sh")
        .args(["-c", &script])
        .arg(alliance())
        .current_dir(lab.path(""))
        .output()
        .unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "within {kib} KiB: {stderr}");
    stderr
}

/// A table of 200 MB needs five times as much, which is the limit. Longer tables are not read.
#[test]
fn a_report_needs_at_most_five_times_the_size_of_its_log() {
    let lab = Lab::new();
    let mission = "space-greedy --limit 40 --log compact --in-process";
    lab.mission("run", mission).expect(1);
    let names = lab.names("run").into_iter();
    let tables = names.filter(|name| name.ends_with(".csv"));
    let bytes: usize = tables
        .map(|name| lab.bytes(&format!("run/{name}")).len())
        .sum();
    assert!(bytes > 30_000_000, "{bytes} bytes");
    // The program needs memory for itself, too.
    let kib = (5 * bytes as u64 + 100_000_000) / 1024;
    let notes = report_within(&lab, kib);
    assert!(!notes.contains("replayed"), "{notes}");
}

/// The tables are sparse files: they need no space on the disk.
#[test]
fn tables_of_gigabytes_are_not_read() {
    let lab = Lab::new();
    let mission = "l-alliance-abstract --limit 2 --log compact --in-process";
    lab.mission("run", mission).expect(1);
    for table in ["motivations.csv", "allocation.csv"] {
        let path = lab.path("run").join(table);
        let file = File::options().append(true).create(true).open(path);
        file.unwrap().set_len(2_000_000_000).unwrap();
    }
    let notes = report_within(&lab, LIMIT_KIB);
    assert!(notes.contains("so it was replayed"), "{notes}");
    let mut watch = lab.start("watch run");
    watch.wait_for_stderr("http://");
    let peak_mib = peak_memory(watch.pid()).unwrap();
    assert!(peak_mib * 1024.0 < LIMIT_KIB as f64, "{peak_mib} MiB");
}
