//! The control topic through `alliance fault`, `clock` and `status` on a live run.

use std::fs::DirBuilder;
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};

use nix::sys::signal::Signal;
use serde_json::Value;

use crate::gateway;
use crate::harness::{Finished, Lab};
use crate::hostile::{announced, hash};
use crate::team::Team;

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

/// Two of the three points of `spare` are ordered while the run is paused. What cannot be done is refused at once.
#[test]
fn an_order_that_must_fail_is_refused_at_once() {
    let lab = Lab::new();
    let scenario = "limit_s = 20\nroom = { width_m = 10, height_m = 10 }\n\
        obstacles = [{ x_m = 6, y_m = 6, width_m = 2, height_m = 2 }]\n\
        [service]\nspare = 2\n[[service.kinds]]\nname = 't'\nwork_s = { min = 5, max = 5 }\n\
        [[service.points]]\nkind = 't'\nx_m = 8.5\ny_m = 2\n\
        [[robots]]\nname = 'a'\nstart = { x_m = 1, y_m = 1 }\n\
        [[robots]]\nname = 'b'\nstart = { x_m = 1, y_m = 2 }\n\
        [[robots]]\nname = 'c'\nabsent = true\n";
    std::fs::write(lab.path("burst.toml"), scenario).unwrap();
    let mut run = lab.start(&["run", "burst.toml", "--paused", "--no-page", "--out", "run"]);
    announced(&lab);
    let fault = |words: &str| {
        let words: Vec<&str> = std::iter::once("fault").chain(words.split(' ')).collect();
        lab.run(&words)
    };
    let refused = |words: &str, why: &str| {
        let answer = fault(words).expect(2);
        assert_eq!(line(&answer), format!("alliance fault: {why}"), "{words}");
    };
    refused(
        "point 5 5 7",
        "fault.point.kind: there is no kind '7'; did you mean 't'? (there is only 't')",
    );
    refused("point 7 7", "fault.point: no robot can work at (7, 7)");
    refused(
        "move-robot a 7 7",
        "fault.move-robot: the place is outside the border, on a solid obstacle or on another robot",
    );
    refused(
        "move-robot a 1 2",
        "fault.move-robot: the place is outside the border, on a solid obstacle or on another robot",
    );
    refused("remove c", "fault.remove: the robot is not in the mission");
    refused(
        "restart c",
        "fault.restart: the robot is not in the mission",
    );
    fault("point 5 5").expect(0);
    fault("point 4 5 t").expect(0);
    refused(
        "point 3 5 --kind t",
        "fault.point: all 2 tasks of service.spare are in use",
    );
    lab.run(&["clock", "speed", "max"]).expect(0);
    lab.run(&["clock", "resume"]).expect(0);
    run.wait_for_stderr("faults  2 of 2");
    run.wait();
    let events = std::fs::read_to_string(lab.path("run/events.csv")).unwrap();
    assert!(!events.contains(",failed,"), "{events}");
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
    for pid in [world.pid(), gateway::of(&world)] {
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
