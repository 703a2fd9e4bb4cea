//! Runs the program of this crate by processes with a kill and in one process, then replays, reports, exports and
//! shows it on a page.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const SCENARIO: &str = include_str!("../visit.toml");

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("visit.toml"), SCENARIO).unwrap();
    folder
}

fn command(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_own-mission"));
    command.current_dir(folder).env("XDG_RUNTIME_DIR", folder);
    command
}

fn own_mission(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let run = command(folder).args(arguments).output().unwrap();
    let output =
        String::from_utf8_lossy(&run.stdout).into_owned() + &String::from_utf8_lossy(&run.stderr);
    (run.status.code(), output)
}

fn read(folder: &Path, file: &str) -> String {
    fs::read_to_string(folder.join(file)).unwrap_or_default()
}

#[test]
fn all_places_are_visited_without_gold_and_all_run_modes_write_the_same_bytes() {
    let folder = folder("visit");
    let (listed, all) = own_mission(&folder, &["list", "missions"]);
    assert!(
        listed == Some(0) && all.contains("visit") && all.contains("waste"),
        "{all}"
    );
    let (_, described) = own_mission(&folder, &["list", "missions", "visit"]);
    assert!(described.contains("reach_m = 0.3"), "{described}");

    let (status, output) = own_mission(
        &folder,
        &["run", "--no-page", "--out", "many", "visit.toml"],
    );
    assert_eq!(status, Some(0), "{output}");
    assert!(output.contains("6 of 6 visited"), "{output}");
    let events = read(&folder, "many/events.csv");
    let visits = |robot: &str| {
        events
            .lines()
            .filter(|line| line.contains(&format!(",visited,{robot},")))
            .count()
    };
    assert_eq!(
        visits("blue") + visits("gold") + visits("green"),
        6,
        "{events}"
    );
    let killed = events
        .lines()
        .find(|line| line.contains(",gone,gold,"))
        .expect("gold is killed");
    let after = events.lines().skip_while(|line| *line != killed);
    assert!(
        !after.clone().any(|line| line.contains(",visited,gold,")),
        "{events}"
    );
    assert!(
        after.filter(|line| line.contains(",visited,")).count() >= 2,
        "the other robots must take over: {events}"
    );

    let (status, output) = own_mission(
        &folder,
        &[
            "run",
            "--in-process",
            "--check",
            "--out",
            "one",
            "visit.toml",
        ],
    );
    assert_eq!(status, Some(0), "{output}");
    for file in [
        "motivations.csv",
        "events.csv",
        "poses.csv",
        "messages.csv",
        "mission.csv",
        "ticks.csv",
        "run.json",
    ] {
        assert!(
            read(&folder, &format!("many/{file}")) == read(&folder, &format!("one/{file}")),
            "{file} differs"
        );
    }
    assert!(read(&folder, "one/mission.csv").starts_with("t_ms,visited,left\n0,0,6\n"));
    let (status, output) = own_mission(&folder, &["replay", "many"]);
    assert_eq!(status, Some(0), "{output}");
    let (status, output) = own_mission(&folder, &["report", "many"]);
    assert_eq!(status, Some(0), "{output}");
    assert!(
        read(&folder, "many/report/report.html").contains("visited"),
        "{output}"
    );
    let (status, output) = own_mission(&folder, &["export", "many", "--mcap", "--parquet"]);
    assert_eq!(status, Some(0), "{output}");
    check_page(&folder);
}

/// Checks that the page of the finished run is served.
fn check_page(folder: &Path) {
    let mut view = command(folder)
        .args(["watch", "many"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(view.stderr.take().unwrap())
        .lines()
        .map_while(Result::ok);
    let link = lines.find_map(|line| {
        line.split_whitespace()
            .find(|word| word.starts_with("http://"))
            .map(str::to_owned)
    });
    let link = link.expect("`watch` must print its link");
    let rest = link.strip_prefix("http://").unwrap();
    let (address, path) = rest.split_at(rest.find('/').unwrap());
    let mut stream = TcpStream::connect(address).unwrap();
    write!(
        stream,
        "GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n"
    )
    .unwrap();
    let mut page = String::new();
    let _ = stream.read_to_string(&mut page);
    view.kill().unwrap();
    view.wait().unwrap();
    assert!(
        page.starts_with("HTTP/1.1 200") || page.starts_with("HTTP/1.1 30"),
        "{page}"
    );
}

#[test]
fn every_allocator_completes_the_mission() {
    let folder = folder("allocators");
    for allocator in ["alliance", "nearest", "first-come", "random", "static"] {
        let run = [
            "run",
            "--in-process",
            "--allocator",
            allocator,
            "--log",
            "off",
            "--out",
            allocator,
            "visit.toml",
        ];
        let (status, output) = own_mission(&folder, &run);
        // `static` never reassigns the tasks of a crashed robot.
        let expected = if allocator == "static" {
            Some(1)
        } else {
            Some(0)
        };
        assert_eq!(status, expected, "{allocator}: {output}");
    }
}

#[test]
fn a_mistake_in_the_mission_section_gives_one_line() {
    let folder = folder("mistakes");
    for (right, wrong, line) in [
        (
            "x_m = 3.0",
            "x_m = 99.0",
            "bad.toml:7: visit.places[0].x_m: 99 is out of range; it must be at least 0 and at most 12 m",
        ),
        (
            "[visit]",
            "[visit]\nreach = 1",
            "bad.toml:6: visit.reach: unknown key; did you mean 'reach_m'?",
        ),
        (
            "[visit]",
            "[vist]",
            "bad.toml:5: vist: unknown key; did you mean 'visit'?",
        ),
        ("[visit]", "[waste]\n[visit]", "a scenario has one mission"),
    ] {
        fs::write(folder.join("bad.toml"), SCENARIO.replacen(right, wrong, 1)).unwrap();
        let (status, output) =
            own_mission(&folder, &["run", "--no-page", "--out", "bad", "bad.toml"]);
        assert_eq!(status, Some(2), "{output}");
        assert!(
            output.contains(line) && output.lines().count() == 1,
            "{output}"
        );
        assert!(
            !folder.join("bad").exists(),
            "a refused scenario must not create a run folder"
        );
    }
}
