//! The program of this crate, as its user runs it: by processes, one of them killed, in one process, again, and as a report.

use std::fs;
use std::path::Path;
use std::process::Command;

/// Gold's process is killed with SIGKILL after 100 s.
const SCENARIO: &str = "allocator = \"greedy\"\nlimit_s = 1200.0\n\
    [[faults.timeline]]\nat_s = 100.0\nfault.kill = \"gold\"\n";

fn own_allocator(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_own-allocator"));
    let run = command.args(arguments).current_dir(folder).env("XDG_RUNTIME_DIR", folder).output().unwrap();
    let said = String::from_utf8_lossy(&run.stdout).into_owned() + &String::from_utf8_lossy(&run.stderr);
    (run.status.code(), said)
}

#[test]
fn greedy_carries_on_without_gold_and_every_way_of_running_it_gives_the_same_bytes() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("own-allocator");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("kill.toml"), SCENARIO).unwrap();
    let (listed, all) = own_allocator(&folder, &["allocators"]);
    assert!(listed == Some(0) && all.contains("greedy"), "{all}");

    let run = ["run", "--no-page", "--out", "many", "kill.toml"];
    let (status, said) = own_allocator(&folder, &run);
    assert_eq!(status, Some(0), "{said}");
    assert!(said.contains("24 of 24 items delivered"), "{said}");
    let (status, said) = own_allocator(&folder, &["run", "--in-process", "--out", "one", "kill.toml"]);
    assert_eq!(status, Some(0), "{said}");
    for file in ["allocation.csv", "events.csv", "poses.csv", "messages.csv", "mission.csv", "ticks.csv", "run.json"] {
        let read = |run: &str| fs::read(folder.join(run).join(file)).ok();
        assert!(read("many") == read("one"), "{file} differs");
    }
    let (status, said) = own_allocator(&folder, &["replay", "many"]);
    assert_eq!(status, Some(0), "{said}");
    let (status, said) = own_allocator(&folder, &["report", "many"]);
    assert_eq!(status, Some(0), "{said}");
    assert!(folder.join("many/report/report.html").exists(), "{said}");
}
