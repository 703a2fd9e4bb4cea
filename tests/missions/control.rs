//! The control topic through `alliance fault`, `clock` and `status` on a live run.

use std::fs::DirBuilder;
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};

use alliance_tests::harness::{Finished, Lab, wait_until};
use alliance_tests::operator::{announced, gateway_of, hash};
use alliance_tests::runs::{self, Events};
use alliance_tests::team::Team;
use nix::sys::signal::Signal;
use run_log::{LogLevel, MemoryLog};
use serde_json::{Value, json};

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
    let mut team = Team::start(&lab, "--speed 2x --limit 60");
    team.wait_for_row("events.csv", &[",activated,"]);
    let run = format!(" [run {}]", team.id);
    let ends = |command: &str, end: &str| {
        let finished = lab.run(command).expect(0);
        assert!(line(&finished).ends_with(end), "{}", finished.stderr);
        finished
    };
    ends("clock pause", &format!(": paused{run}"));

    let drop = "drop --from green --to all --p 0.3";
    let armed = format!("fault {drop} --for 60s --id noise");
    let armed = ends(&armed, &format!(" for 60 s{run}"));
    let tick = line(&armed).strip_prefix(&format!("noise: {drop} from tick "));
    let tick = tick.and_then(|rest| rest.split(' ').next()?.parse::<u64>().ok());
    armed.shows(&format!(" ({:.3} s) for 60 s", tick.unwrap() as f64 * 0.05));

    let late = ["fault", "mute", "gold", "--when", "gold dies", "--json"];
    let late = lab.run(late).expect(0);
    assert_eq!(late.stderr, "");
    let late = &late.json()["armed"];
    assert_eq!((&late["tick"], &late["t_ms"]), (&Value::Null, &Value::Null));

    // Refused orders do not count as faults.
    let unknown = lab.run("fault kill glod").expect(2);
    assert_eq!(
        line(&unknown),
        "alliance fault: fault.kill: the scenario has no robot 'glod'; did you mean 'gold'? (there are blue, gold, green)"
    );
    let again = lab.run("fault pause gold --id noise").expect(2);
    assert!(line(&again).starts_with("alliance fault: "));

    let listed = lab.run("fault list --json").expect(0).json();
    let faults = listed["faults"].as_array().unwrap().iter();
    let ids: Vec<_> = faults.map(|fault| fault["id"].clone()).collect();
    assert_eq!(ids, [json!("noise"), late["id"].clone()]);
    let table = lab.run("fault list").expect(0);
    table.shows(&format!("\nnoise  {drop} --for 60s "));
    let status = lab.run("status").expect(0);
    let pid = team.pid("blue").to_string();
    for part in [
        " of 24 items delivered, items in spills ",
        "paused",
        "\nblue ",
        &pid,
        "  active",
        "gold dies",
    ] {
        status.shows(part);
    }
    // Without a terminal the table of faults may be wider.
    let tables = status.stderr.lines();
    let tables = tables.skip_while(|line| !line.starts_with("robot"));
    let tables = tables.take_while(|line| !line.starts_with("id "));
    let widths = tables.map(|line| line.chars().count());
    assert!(widths.max() <= Some(80), "{}", status.stderr);

    let cleared = lab.run("fault clear noise").expect(0);
    assert!(line(&cleared).starts_with("cleared noise from tick "));
    let over = lab.run("fault clear noise").expect(2);
    let ended = "alliance fault: the fault 'noise' has already ended";
    assert_eq!(line(&over), ended);
    let resumed = lab.run("clock speed max --json").expect(0).json();
    assert_eq!(resumed["clock"]["speed"], Value::Null);
    ends("clock resume", &format!(": as fast as possible{run}"));
    team.wait().expect(1);

    let gone = lab.run("status").expect(3);
    assert_eq!(
        line(&gone),
        "alliance status: no run is live; start one with `alliance run` or `alliance cluster world`"
    );
}

/// Returns a robot with one point to work on and an obstacle, and tasks for further points.
fn team_with_a_point(spare: usize) -> in_process::Team<MemoryLog> {
    let text = format!(
        "limit_s = 60\nroom = {{ width_m = 8, height_m = 8 }}\n\
         obstacles = [{{ x_m = 6, y_m = 6, width_m = 1, height_m = 1 }}]\n\
         [service]\nspare = {spare}\n[[service.kinds]]\nname = 't'\nwork_s = {{ min = 5, max = 5 }}\n\
         [[service.points]]\nkind = 't'\nx_m = 4\ny_m = 2\n[[robots]]\nname = 'a'\n"
    );
    runs::team(runs::setup(runs::parse(&text), 1), LogLevel::Off)
}

/// Orders by hand that cannot take effect in the run are refused with the reason.
#[test]
fn orders_that_cannot_take_effect_are_refused() {
    let mut team = team_with_a_point(1);
    let point = |x_m: f32, y_m: f32| json!({"fault": {"point": {"x_m": x_m, "y_m": y_m}}});
    let babble = |at_s: f64| json!({"fault": {"babble": "a"}, "at_s": at_s});
    let gripper = json!({"fault": {"actuator": {"robot": "a", "mode": "gripper"}}});
    for (order, expected) in [
        (
            point(6.5, 6.5),
            "fault.point: no robot can work at (6.5, 6.5); choose a place away from walls and obstacles",
        ),
        (point(3.0, 3.0), "armed"),
        (
            point(5.0, 3.0),
            "fault.point: 1 to add and 1 in use or reserved by earlier orders are more than service.spare, 1; \
             clear an order, or increase service.spare",
        ),
        (babble(59.9), "armed"),
        (
            babble(59.96),
            "at_s: 'babble a' is due at 60 s, not before the end of the run, 60 s; choose an earlier time",
        ),
        (
            babble(60.0),
            "at_s: 'babble a' is due at 60 s, not before the end of the run, 60 s; choose an earlier time",
        ),
        (
            gripper,
            "fault.actuator.mode: the robots of this mission have no gripper; choose another mode",
        ),
    ] {
        let answer = team.order(serde_json::from_value(order.clone()).unwrap());
        let answer = answer.map_or_else(|problem| problem.to_string(), |_| "armed".to_owned());
        assert_eq!(answer, expected, "{order}");
    }
}

/// Orders for later are refused at once if no state of the world can make them possible. Each armed point reserves a task
/// of `spare`, and a cleared one frees it.
#[test]
fn later_orders_that_must_fail_are_refused_at_once() {
    let mut team = team_with_a_point(2);
    let point = |x_m: f32, y_m: f32| json!({"point": {"x_m": x_m, "y_m": y_m}});
    let jump = json!({"move-robot": {"robot": "a", "x_m": 6.5, "y_m": 6.5}});
    let walled = "fault.point: no robot can work at (6.5, 6.5); choose a place away from walls and obstacles";
    let taken = |points: &str| {
        format!(
            "fault.point: {points} in use or reserved by earlier orders are more than service.spare, 2; clear an order, or increase service.spare"
        )
    };
    let mut order = |order: Value| {
        let answer = team.order(serde_json::from_value(order).unwrap());
        answer.map_or_else(|problem| problem.to_string(), |armed| armed.id)
    };
    for (trigger, value) in [("at_s", json!(30.0)), ("when", json!("any begins p0"))] {
        let inside = order(json!({"fault": point(6.5, 6.5), trigger: value}));
        assert_eq!(inside, walled, "{trigger}");
    }
    let inside = order(json!({"fault": jump, "at_s": 30.0}));
    let place = "the place is outside the border or on an obstacle of the scenario";
    let expected = format!("fault.move-robot: {place}; choose another place");
    assert_eq!(inside, expected);

    let at = json!({"fault": point(3.0, 3.0), "at_s": 30.0, "id": "first"});
    assert_eq!(order(at), "first");
    // At 40 and 50 s: the run ends before 60 s.
    let repeated = order(json!({"fault": point(3.0, 4.0), "at_s": 40.0, "every_s": 10.0}));
    assert_eq!(repeated, taken("2 to add and 1"));
    let when = json!({"fault": point(3.0, 5.0), "when": "any begins p0", "id": "second"});
    assert_eq!(order(when), "second");
    // A point now would take the task of an order that was acknowledged.
    let now = json!({"fault": point(5.0, 3.0), "id": "third"});
    assert_eq!(order(now.clone()), taken("1 to add and 2"));
    team.clear(Some("first")).unwrap();
    let answer = team.order(serde_json::from_value(now).unwrap());
    assert_eq!(answer.map(|armed| armed.id), Ok("third".to_owned()));
}

/// Orders take effect in the very tick of a paused clock, in the order in which they are given.
#[test]
fn a_paused_clock_steps_and_applies_orders_at_once() {
    let lab = Lab::new();
    let query = |command: &str| lab.run(format!("{command} --json")).expect(0).json();
    let mut team = Team::start(&lab, "--speed 20x --limit 60");
    team.wait_for_row("poses.csv", &["5000,"]);
    let paused = query("clock pause")["clock"]["tick"].as_u64().unwrap();
    let now = || query("status")["status"]["tick"].as_u64().unwrap();
    // The current tick may end, but no other one begins.
    let paused_tick = now();
    assert!(paused_tick <= paused + 1);

    let armed = query("fault obstacle 6 4 0.5 0.5 --id box");
    assert_eq!(armed["armed"]["tick"], paused_tick);
    query("fault mute blue --id first");
    query("fault clear first");
    let faults = query("fault list")["faults"].clone();
    let [obstacle, mute] = [&faults[0], &faults[1]];
    assert_eq!(
        (&obstacle["id"], &mute["id"]),
        (&json!("box"), &json!("first"))
    );
    assert_eq!(obstacle["phase"], "in-force");
    assert_eq!(mute["phase"], "over");
    assert_eq!(now(), paused_tick, "the clock must not move");
    query("clock step 3");
    wait_until("three steps", || now() == paused_tick + 3);
    query("clock speed max");
    assert_eq!(now(), paused_tick + 3, "a new speed must not end the pause");
    query("clock resume");
    team.wait().expect(1);

    let log = lab.log("run");
    let applied = &log.events("applied")[0];
    assert_eq!(applied.t_ms.0, paused_tick * 50);
    assert_eq!(applied.detail, "obstacle 6 4 0.5 0.5");
    assert!(!log.run.unscripted);
    lab.assert_repeated("run");
}

#[test]
fn a_world_without_a_launcher_refuses_process_faults() {
    let lab = Lab::new();
    let kill = "name = \"kills\"\n[[faults.timeline]]\nfault.kill = \"gold\"\n";
    lab.write("kills.toml", kill);
    assert_eq!(
        lab.refusal("cluster world kills.toml --out none"),
        "world: scenario 'kills': its fault 'kill gold' needs a launcher; start it with `alliance run`\n"
    );
    assert!(!lab.exists("none"));
}

/// `alliance list runs` lists live runs, then run folders, newest first. It omits folders that are no runs. The
/// announcement of a crashed world is ignored, even if another process has its process id now.
#[test]
fn runs_are_listed_newest_first() {
    let lab = Lab::new();
    let none = lab.run("list runs").expect(0).stdout;
    assert!(none.starts_with("no live run, and no recorded run in runs;"));
    let mut private = DirBuilder::new();
    let private = private.recursive(true).mode(0o700);
    private.create(lab.path("runtime/alliance")).unwrap();
    let pid = std::process::id();
    let stale = json!({"run": "gone", "endpoint": "tcp/127.0.0.1:9", "pid": pid, "token": "t", "started": 1});
    lab.write("runtime/alliance/gone.json", stale.to_string());
    for command in ["status", "status --watch"] {
        lab.run(command).expect(3).shows("no run is live");
    }
    let _ = std::fs::remove_file(lab.path("runtime/alliance/gone.json"));

    lab.mission("runs/first", "--log off").expect(0);
    for folder in ["runs/empty", "runs/broken"] {
        std::fs::create_dir(lab.path(folder)).unwrap();
    }
    lab.write("runs/broken/run.json", "{");
    let team = Team::start(&lab, "--paused");
    let id = announced(&lab).run;
    let listed = lab.run("list runs --json").expect(0).json();
    let listed = listed.as_array().unwrap();
    let of = |key: &str| -> Vec<Value> { listed.iter().map(|run| run[key].clone()).collect() };
    assert_eq!(of("run"), [&*id, "runs/broken", "runs/first"]);
    let broken = "run.json cannot be read";
    assert_eq!(of("state"), ["live, paused", broken, "complete"]);
    assert_eq!(listed[2]["hash"], hash(&lab, "runs/first"));
    assert_eq!(listed[2]["seed"], 1);
    let output = lab.run("list runs").expect(0).stdout;
    let is_listed = output.contains(&id) && output.contains("338.250 s");
    assert!(is_listed, "{output}");
    lab.run("list runs nowhere").expect(2).shows("nowhere");

    // A status that is watched ends with its run.
    let mut watch = lab.start("status --watch 1");
    watch.wait_for_stderr("paused");
    lab.run("clock speed max").expect(0);
    lab.run("clock resume").expect(0);
    team.wait().expect(0);
    let watched = watch.wait().expect(0).stderr;
    let over = format!("run {id} is over\n");
    assert!(watched.ends_with(&over), "{watched}");
}

/// The folder for temporary files may belong to another user, or be no folder. Then a run uses the home folder.
#[test]
fn without_a_private_runtime_folder_a_run_uses_the_home_folder_or_names_the_variable() {
    let lab = Lab::new();
    let taken = format!("tmp/alliance-{}", nix::unistd::Uid::effective());
    std::fs::create_dir_all(lab.path(&taken)).unwrap();
    lab.write("file", "");
    let start = |command: &str, tmp: &str, home: &str| {
        let [tmp, home] = [tmp, home].map(|name| lab.path(name).display().to_string());
        let variables = [("XDG_RUNTIME_DIR", ""), ("TMPDIR", &tmp), ("HOME", &home)];
        lab.start_with(command, &variables).wait()
    };
    for (tmp, home) in [("tmp", "home"), ("file", "other-home")] {
        let mission = format!("run --no-page --limit 5 --out {home}");
        start(&mission, tmp, home).expect(1);
        assert!(lab.path(home).join(".cache/alliance").is_dir());
    }
    let status = start("status", "file", "file").expect(3).stderr;
    let remedy = "; set XDG_RUNTIME_DIR to a folder in which only this user can write\n";
    assert!(status.ends_with(remedy), "{status}");
}

/// A run uses a socket in a folder that is closed to other users, and no port. It removes the socket at its end. The
/// next command removes the socket of a killed world.
#[test]
fn other_users_cannot_reach_a_run() {
    let lab = Lab::new();
    let sockets = || {
        let names = lab.names("runtime/alliance");
        names.iter().filter(|name| name.contains(".sock")).count()
    };
    let world = lab.world("killed", "");
    let endpoint = announced(&lab).endpoint;
    assert!(endpoint.starts_with("unixsock-stream/"), "{endpoint}");
    for pid in [world.pid(), gateway_of(&world)] {
        assert_eq!(listening_ports(pid), 0);
    }
    // The team's and the operators' socket, each with a lock.
    assert_eq!(sockets(), 4);
    let folder = std::fs::metadata(lab.path("runtime/alliance")).unwrap();
    assert_eq!(folder.permissions().mode() & 0o777, 0o700);
    world.signal(Signal::SIGKILL);
    world.wait();
    lab.run("status").expect(3);
    assert_eq!(sockets(), 0);

    lab.mission("complete", "--log off").expect(0);
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
    let command = "run --no-page --limit 5 --out run";
    let variables = [("XDG_RUNTIME_DIR", deep.as_str())];
    lab.start_with(command, &variables).wait().expect(1);
    let host = lab.json("run/host.json");
    let endpoint = host["endpoint"].as_str().unwrap();
    assert!(endpoint.starts_with("tcp/127.0.0.1:"), "{endpoint}");
}
