//! Runs the program of this crate by processes with a kill and in one process, then replays it and writes the report.

use std::fs;
use std::path::Path;
use std::process::Command;

/// Gold's process is killed with SIGKILL after 100 s.
const SCENARIO: &str = "allocator = \"greedy\"\nlimit_s = 1200.0\n\
    [[faults.timeline]]\nat_s = 100.0\nfault.kill = \"gold\"\n";

fn own_allocator(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_own-allocator"));
    let run = command
        .args(arguments)
        .current_dir(folder)
        .env("XDG_RUNTIME_DIR", folder)
        .output()
        .unwrap();
    let output =
        String::from_utf8_lossy(&run.stdout).into_owned() + &String::from_utf8_lossy(&run.stderr);
    (run.status.code(), output)
}

#[test]
fn greedy_continues_without_gold_and_all_run_modes_write_the_same_bytes() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("own-allocator");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("kill.toml"), SCENARIO).unwrap();
    let (listed, all) = own_allocator(&folder, &["list", "allocators"]);
    assert!(listed == Some(0) && all.contains("greedy"), "{all}");

    let run = ["run", "--no-page", "--out", "many", "kill.toml"];
    let (status, output) = own_allocator(&folder, &run);
    assert_eq!(status, Some(0), "{output}");
    assert!(output.contains("24 of 24 items delivered"), "{output}");
    let (status, output) = own_allocator(
        &folder,
        &["run", "--in-process", "--out", "one", "kill.toml"],
    );
    assert_eq!(status, Some(0), "{output}");
    for file in [
        "allocation.csv",
        "events.csv",
        "poses.csv",
        "messages.csv",
        "mission.csv",
        "ticks.csv",
        "run.json",
    ] {
        let read = |run: &str| fs::read(folder.join(run).join(file)).ok();
        assert!(read("many") == read("one"), "{file} differs");
    }
    let (status, output) = own_allocator(&folder, &["replay", "many"]);
    assert_eq!(status, Some(0), "{output}");
    let (status, output) = own_allocator(&folder, &["report", "many"]);
    assert_eq!(status, Some(0), "{output}");
    assert!(folder.join("many/report/report.html").exists(), "{output}");
}
