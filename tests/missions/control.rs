//! The control topic through `alliance fault`, `clock` and `status` on a live run.

use std::fs::DirBuilder;
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};

use alliance_tests::harness::{Finished, Lab, wait_until};
use alliance_tests::operator::{announced, gateway_of, hash};
use alliance_tests::team::Team;
use nix::sys::signal::Signal;
use run_log::EventRow;
use serde_json::Value;

/// Returns the only line that the command printed.
#[track_caller]
fn line(finished: &Finished) -> &str {
    let line = finished.stderr.strip_suffix('\n').unwrap();
    assert!(!line.contains('\n'), "{line}");
    assert_eq!(finished.stdout, "");
    line
}

#[test]
fn a_live_run_is_paused_faulted_listed_and_healed_by_command() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, &["--speed", "2x", "--limit", "60"]);
    team.wait_for_row("events.csv", &[",activated,"]);
    let alliance = |command: &str| lab.run(&command.split(' ').collect::<Vec<_>>());

    let paused = alliance("clock pause").expect(0);
    let run = format!(" [run {}]", team.id);
    assert!(
        line(&paused).ends_with(&format!(": paused{run}")),
        "{}",
        paused.stderr
    );

    let drop = "drop --from green --to all --p 0.3";
    let armed = alliance(&format!("fault {drop} --for 60s --id noise")).expect(0);
    let tick = line(&armed)
        .strip_prefix(&format!("noise: {drop} from tick "))
        .and_then(|rest| rest.split(' ').next()?.parse::<u64>().ok());
    let t_s = tick.unwrap() as f64 * 0.05;
    let end = format!(" ({t_s:.3} s) for 60 s{run}");
    assert!(line(&armed).ends_with(&end), "{}", armed.stderr);

    let late = lab
        .run(&["fault", "mute", "gold", "--when", "gold dies", "--json"])
        .expect(0);
    assert_eq!(late.stderr, "");
    let late = &late.json()["armed"];
    let id = late["id"].as_str().unwrap();
    assert_eq!((&late["tick"], &late["t_ms"]), (&Value::Null, &Value::Null));

    // Refused orders do not count as faults.
    let unknown = alliance("fault kill glod").expect(2);
    assert_eq!(
        line(&unknown),
        "alliance fault: fault.kill: the scenario has no robot 'glod'; did you mean 'gold'? (there are blue, gold, green)"
    );
    let again = alliance("fault pause gold --id noise").expect(2);
    assert!(line(&again).starts_with("alliance fault: "));

    let listed = alliance("fault list --json").expect(0).json();
    let faults = listed["faults"].as_array().unwrap();
    let ids: Vec<_> = faults.iter().map(|fault| fault["id"].as_str()).collect();
    assert_eq!(ids, [Some("noise"), Some(id)]);
    let table = alliance("fault list").expect(0).stderr;
    let row = format!("\nnoise  {drop} --for 60s ");
    assert!(table.contains(&row), "{table}");
    let status = alliance("status").expect(0).stderr;
    let pid = team.pid("blue").to_string();
    for part in [
        " of 24 items delivered, items in spills ",
        "paused",
        "\nblue ",
        &pid,
        "  active",
        "gold dies",
    ] {
        assert!(status.contains(part), "no '{part}' in:\n{status}");
    }
    // Without a terminal the table of faults may be wider.
    let tables = status.lines().skip_while(|line| !line.starts_with("robot"));
    let tables = tables.take_while(|line| !line.starts_with("id "));
    let widths = tables.map(|line| line.chars().count());
    assert!(widths.max() <= Some(80), "{status}");

    let cleared = alliance("fault clear noise").expect(0);
    assert!(line(&cleared).starts_with("cleared noise from tick "));
    let over = alliance("fault clear noise").expect(2);
    assert_eq!(
        line(&over),
        "alliance fault: the fault 'noise' has already ended"
    );
    let resumed = alliance("clock speed max --json").expect(0).json();
    assert_eq!(resumed["clock"]["speed"], Value::Null);
    let resumed = alliance("clock resume").expect(0);
    assert!(
        line(&resumed).ends_with(&format!(": as fast as possible{run}")),
        "{}",
        resumed.stderr
    );
    team.wait().expect(1);

    let gone = alliance("status").expect(3);
    assert_eq!(
        line(&gone),
        "alliance status: no run is live; start one with `alliance run` or `alliance cluster world`"
    );
}

/// Orders take effect in the very tick of a paused clock, in the order in which they are given.
#[test]
fn a_paused_clock_steps_and_applies_orders_at_once() {
    let lab = Lab::new();
    let query = |command: &str| {
        let words: Vec<&str> = command.split(' ').chain(["--json"]).collect();
        lab.run(&words).expect(0).json()
    };
    let mut team = Team::start(&lab, &["--speed", "20x", "--limit", "60"]);
    team.wait_for_row("poses.csv", &["5000,"]);
    let paused = query("clock pause")["clock"]["tick"].as_u64().unwrap();
    let status = || query("status")["status"].clone();
    let now = || status()["tick"].as_u64().unwrap();
    // The current tick may end, but no other one begins.
    let paused_tick = now();
    assert!(paused_tick <= paused + 1);

    let armed = query("fault obstacle 6 4 0.5 0.5 --id box")["armed"].clone();
    assert_eq!(armed["tick"].as_u64(), Some(paused_tick));
    let faults = status()["faults"].clone();
    assert_eq!(
        (&faults[0]["id"], &faults[0]["phase"]),
        (&"box".into(), &"in-force".into())
    );
    query("fault mute blue --id first");
    query("fault clear first");
    let over = query("fault list")["faults"][1].clone();
    assert_eq!(
        (&over["id"], &over["phase"]),
        (&"first".into(), &"over".into())
    );
    assert_eq!(now(), paused_tick, "the clock must not move");
    query("clock step 3");
    wait_until("three steps", || now() == paused_tick + 3);
    query("clock speed max");
    assert_eq!(now(), paused_tick + 3, "a new speed must not end the pause");
    query("clock resume");
    team.wait().expect(1);

    let log = lab.log("run");
    let events = log.rows::<EventRow>().unwrap();
    let applied = events.iter().find(|row| row.kind == "applied").unwrap();
    assert_eq!(applied.t_ms.0, paused_tick * 50);
    assert_eq!(applied.detail, "obstacle 6 4 0.5 0.5");
    assert!(!log.run.unscripted);
    lab.run(&["replay", "run"]).expect(0);
}

#[test]
fn a_world_without_a_launcher_refuses_process_faults() {
    let lab = Lab::new();
    let kill = "name = \"kills\"\n[[faults.timeline]]\nfault.kill = \"gold\"\n";
    std::fs::write(lab.path("kills.toml"), kill).unwrap();
    assert_eq!(
        lab.refusal(&["cluster", "world", "kills.toml", "--out", "none"]),
        "world: scenario 'kills': its fault 'kill gold' needs a launcher; start it with `alliance run`\n"
    );
    assert!(!lab.path("none").exists());
}

/// The announcement of a crashed world is ignored, even if another process has its process id now.
#[test]
fn an_announcement_is_valid_only_for_its_process() {
    let lab = Lab::new();
    let folder = lab.path("runtime/alliance");
    DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(&folder)
        .unwrap();
    let pid = std::process::id();
    let stale = format!(
        r#"{{"run": "gone", "endpoint": "tcp/127.0.0.1:9", "pid": {pid}, "token": "t", "started": 1}}"#
    );
    std::fs::write(folder.join("gone.json"), stale).unwrap();
    let status = lab.run(&["status"]).expect(3);
    assert!(
        status.stderr.contains("no run is live"),
        "{}",
        status.stderr
    );
}

/// `alliance list runs` lists live runs, then run folders, newest first. It omits folders that are no runs.
#[test]
fn runs_are_listed_newest_first() {
    let lab = Lab::new();
    let none = lab.run(&["list", "runs"]).expect(0);
    assert!(
        none.stdout
            .starts_with("no live run, and no recorded run in runs;")
    );
    lab.mission("runs/first", &["--log", "off"]).expect(0);
    std::fs::create_dir(lab.path("runs/empty")).unwrap();
    std::fs::create_dir(lab.path("runs/broken")).unwrap();
    std::fs::write(lab.path("runs/broken/run.json"), "{").unwrap();
    let _team = Team::start(&lab, &["--paused"]);
    let id = announced(&lab).run;

    let listed = lab.run(&["list", "runs", "--json"]).expect(0);
    let listed: Vec<Value> = serde_json::from_str(&listed.stdout).unwrap();
    let of = |key: &str| {
        listed
            .iter()
            .map(|run| run[key].clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(of("run"), [&*id, "runs/broken", "runs/first"]);
    let broken = "run.json cannot be read";
    assert_eq!(of("state"), ["live, paused", broken, "complete"]);
    assert_eq!(listed[2]["hash"], hash(&lab, "runs/first"));
    assert_eq!(listed[2]["seed"], 1);
    let output = lab.run(&["list", "runs"]).expect(0).stdout;
    assert!(
        output.contains(&id) && output.contains("338.250 s"),
        "{output}"
    );
}

#[test]
fn status_watch_ends_with_its_run() {
    let lab = Lab::new();
    let none = lab.run(&["status", "--watch"]).expect(3);
    assert!(none.stderr.contains("no run is live"), "{}", none.stderr);
    let team = Team::start(&lab, &["--paused"]);
    announced(&lab);
    let mut watch = lab.start(&["status", "--watch", "1"]);
    watch.wait_for_stderr("paused");
    lab.run(&["clock", "speed", "max"]).expect(0);
    lab.run(&["clock", "resume"]).expect(0);
    let id = team.id.clone();
    team.wait().expect(0);
    let watched = watch.wait().expect(0);
    let over = format!("run {id} is over\n");
    assert!(watched.stderr.ends_with(&over), "{}", watched.stderr);
}

/// The folder for temporary files may belong to another user, or be no folder.
#[test]
fn without_a_private_runtime_folder_a_run_uses_the_home_folder() {
    let lab = Lab::new();
    let taken = format!("tmp/alliance-{}", nix::unistd::Uid::effective());
    std::fs::create_dir_all(lab.path(&taken)).unwrap();
    std::fs::write(lab.path("file"), "").unwrap();
    let at = |name: &str| lab.path(name).display().to_string();
    for (tmp, home) in [("tmp", "home"), ("file", "other-home")] {
        let (tmp, base) = (at(tmp), at(home));
        let variables = [("XDG_RUNTIME_DIR", ""), ("TMPDIR", &tmp), ("HOME", &base)];
        let mission = ["run", "--no-page", "--limit", "5", "--out", home];
        lab.start_with(&mission, &variables).wait().expect(1);
        assert!(lab.path(&format!("{home}/.cache/alliance")).is_dir());
    }
}

#[test]
fn without_any_runtime_folder_the_variable_for_it_is_named() {
    let lab = Lab::new();
    std::fs::write(lab.path("file"), "").unwrap();
    let file = lab.path("file").display().to_string();
    let variables = [("XDG_RUNTIME_DIR", ""), ("TMPDIR", &file), ("HOME", &file)];
    let status = lab.start_with(&["status"], &variables).wait().expect(3);
    let remedy = "; set XDG_RUNTIME_DIR to a folder in which only this user can write\n";
    assert!(status.stderr.ends_with(remedy), "{}", status.stderr);
}

/// A run uses a socket in a folder that is closed to other users, and no port. It removes the socket at its end. The
/// next command removes the socket of a killed world.
#[test]
fn other_users_cannot_reach_a_run() {
    let lab = Lab::new();
    let sockets = || {
        let files = std::fs::read_dir(lab.path("runtime/alliance")).unwrap();
        let names = files.map(|file| file.unwrap().file_name().into_string().unwrap());
        names.filter(|name| name.contains(".sock")).count()
    };
    let world = lab.start(&["cluster", "world", "--out", "killed"]);
    let run = announced(&lab);
    assert!(
        run.endpoint.starts_with("unixsock-stream/"),
        "{}",
        run.endpoint
    );
    for pid in [world.pid(), gateway_of(&world)] {
        assert_eq!(listening_ports(pid), 0);
    }
    // The team's and the operators' socket, each with a lock.
    assert_eq!(sockets(), 4);
    let folder = std::fs::metadata(lab.path("runtime/alliance")).unwrap();
    assert_eq!(folder.permissions().mode() & 0o777, 0o700);
    world.signal(Signal::SIGKILL);
    world.wait();
    lab.run(&["status"]).expect(3);
    assert_eq!(sockets(), 0);

    lab.mission("complete", &["--log", "off"]).expect(0);
    assert_eq!(sockets(), 0);
}

/// Returns the number of listening TCP sockets of a process.
fn listening_ports(pid: u32) -> usize {
    const LISTEN: &str = "0A";
    let files = std::fs::read_dir(format!("/proc/{pid}/fd")).unwrap();
    let files = files.filter_map(|file| std::fs::read_link(file.unwrap().path()).ok());
    let process_files: Vec<String> = files.map(|file| file.display().to_string()).collect();
    let tables =
        ["tcp", "tcp6"].map(|table| std::fs::read_to_string(format!("/proc/{pid}/net/{table}")));
    let tables = tables.map(Result::unwrap_or_default).concat();
    let rows = tables
        .lines()
        .map(|row| row.split_whitespace().collect::<Vec<_>>());
    let listening = rows.filter(|row| row.get(3) == Some(&LISTEN));
    let inodes = listening.filter_map(|row| Some(format!("socket:[{}]", row.get(9)?)));
    inodes.filter(|inode| process_files.contains(inode)).count()
}

/// The path of a socket has at most 107 bytes. A run in a deeper folder listens on a loopback port.
#[test]
fn a_run_with_a_long_socket_path_listens_on_a_loopback_port() {
    let lab = Lab::new();
    let deep = lab.path(&format!("runtime/{}", "deep/".repeat(20)));
    std::fs::create_dir_all(&deep).unwrap();
    let deep = deep.display().to_string();
    let mut world = lab.start_with(
        &["run", "--no-page", "--limit", "5", "--out", "run"],
        &[("XDG_RUNTIME_DIR", &deep)],
    );
    world.wait_for_stderr("process ids");
    world.wait().expect(1);
    let host = std::fs::read_to_string(lab.path("run/host.json")).unwrap();
    let host: serde_json::Value = serde_json::from_str(&host).unwrap();
    let endpoint = host["endpoint"].as_str().unwrap();
    assert!(endpoint.starts_with("tcp/127.0.0.1:"), "{endpoint}");
}
