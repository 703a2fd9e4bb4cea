//! Shards of a sweep, and a team on several nodes, under a real Slurm whose daemons are children of the tests on
//! loopback.

use std::fs::{self, File};
use std::os::unix::fs::PermissionsExt;
use std::process::{Child, Command, Output, Stdio};

use alliance_tests::harness::{Lab, free_ports, wait_until};
use alliance_tests::needs::cannot_run;
use alliance_tests::testkit::in_repository;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

const PLAN: &str = "
limit_s = 120.0
seeds = 64
[grid]
allocator = ['alliance', 'cbba']
";

const SHARDS: usize = 8;

const RUNS: usize = 128 / SHARDS;

/// The daemons of Slurm, which end in reverse order of their start.
struct Cluster<'l> {
    lab: &'l Lab,
    daemons: Vec<Child>,
}

impl Drop for Cluster<'_> {
    fn drop(&mut self) {
        for daemon in self.daemons.iter_mut().rev() {
            let _ = kill(Pid::from_raw(daemon.id() as i32), Signal::SIGTERM);
            let _ = daemon.wait();
        }
    }
}

impl<'l> Cluster<'l> {
    fn start(lab: &'l Lab, nodes: usize, processors: usize) -> Self {
        let folder = lab.path("slurm");
        for name in ["state", "spool"] {
            fs::create_dir_all(folder.join(name)).unwrap();
        }
        let key = folder.join("munge.key");
        fs::write(&key, [7; 1024]).unwrap();
        fs::set_permissions(&key, fs::Permissions::from_mode(0o600)).unwrap();
        let host = output_of("uname", "-n");
        let host = host.split('.').next().unwrap();
        let user = output_of("id", "-un");
        let ports = free_ports(1 + nodes);
        let control = ports[0];
        let names: Vec<String> = (1..=nodes).map(|number| format!("node{number}")).collect();
        let at = folder.display();
        // A requeued job waits until its old credentials expire. Slurm replaces values below 5 s by the default of
        // 120 s.
        let conf = format!(
            "ClusterName=lab\nSlurmctldHost={host}(127.0.0.1)\nSlurmctldPort={control}\n\
             SlurmUser={user}\nSlurmdUser={user}\nAuthType=auth/munge\nAuthInfo=socket={at}/munge.socket,cred_expire=6\n\
             CredType=cred/munge\nStateSaveLocation={at}/state\nSlurmdSpoolDir={at}/spool/%n\n\
             SlurmctldPidFile={at}/slurmctld.pid\nSlurmdPidFile={at}/%n.pid\n\
             SlurmctldLogFile={at}/slurmctld.log\nSlurmdLogFile={at}/%n.log\n\
             ProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nMpiDefault=none\nSwitchType=switch/none\n\
             JobAcctGatherType=jobacct_gather/none\nAccountingStorageType=accounting_storage/none\n\
             SchedulerType=sched/builtin\nSelectType=select/cons_tres\nSelectTypeParameters=CR_CPU\n\
             SlurmdParameters=config_overrides\nReturnToService=2\nKillWait=1\n\
             PartitionName=all Nodes={} Default=YES MaxTime=INFINITE State=UP\n",
            names.join(",")
        );
        let of_nodes = names.iter().zip(&ports[1..]).map(|(name, port)| {
            format!(
                "NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs={processors} State=UNKNOWN\n"
            )
        });
        let conf = of_nodes.fold(conf, |conf, node| conf + &node);
        fs::write(folder.join("slurm.conf"), conf).unwrap();
        let mut cluster = Self {
            lab,
            daemons: Vec::new(),
        };
        let mut munge = "--foreground --force".to_owned();
        for name in ["socket", "key-file", "pid-file", "log-file", "seed-file"] {
            let ending = name.trim_end_matches("-file");
            munge += &format!(" --{name}={at}/munge.{ending}");
        }
        cluster.daemon("munged", &munge);
        let socket = folder.join("munge.socket");
        wait_until("munged's socket", || socket.exists());
        cluster.daemon("slurmctld", "-D -c");
        for name in &names {
            cluster.daemon("slurmd", &format!("-D -N {name}"));
        }
        wait_until("the nodes", || {
            let states = cluster.query("sinfo", &["-h", "-o", "%D %t"]);
            String::from_utf8_lossy(&states.stdout).trim() == format!("{nodes} idle")
        });
        cluster
    }

    fn daemon(&mut self, name: &str, arguments: &str) {
        let log = File::create(self.lab.path(&format!("slurm/{name}.out"))).unwrap();
        let mut command = self.command(&program(name));
        command.args(arguments.split(' ')).stdin(Stdio::null());
        command.stdout(log.try_clone().unwrap()).stderr(log);
        self.daemons.push(command.spawn().unwrap());
    }

    fn command(&self, name: &str) -> Command {
        let mut command = Command::new(name);
        let path = std::env::var("PATH").unwrap_or_default();
        command
            .current_dir(self.lab.path(""))
            .env("SLURM_CONF", self.lab.path("slurm/slurm.conf"))
            .env("PATH", format!("{}:{path}", self.lab.path("bin").display()));
        command
    }

    fn query(&self, name: &str, arguments: &[&str]) -> Output {
        self.command(name).args(arguments).output().unwrap()
    }

    #[track_caller]
    fn run(&self, name: &str, arguments: &[&str]) -> String {
        let output = self.query(name, arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{name} {arguments:?}: {stderr}");
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    }
}

/// Returns the path of a daemon, which may not be in `PATH`.
fn program(name: &str) -> String {
    let there = format!("/usr/sbin/{name}");
    match fs::exists(&there) {
        Ok(true) => there,
        _ => name.to_owned(),
    }
}

/// Returns the trimmed output of a program.
fn output_of(name: &str, argument: &str) -> String {
    let output = Command::new(name).arg(argument).output().unwrap();
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

/// Returns whether Slurm is installed. Prints how to install it otherwise.
fn is_installed() -> bool {
    // The exit status does not matter: sbatch fails without a configuration.
    let runs = |name: &&str| {
        Command::new(program(name))
            .arg("--version")
            .output()
            .is_ok()
    };
    let is_installed = ["slurmctld", "slurmd", "munged", "sbatch"].iter().all(runs);
    if !is_installed {
        let packages = "`slurmctld`, `slurmd`, `slurm-client` and `munge`";
        cannot_run(&format!("no Slurm: install Debian's packages {packages}"));
    }
    is_installed
}

fn recipe(name: &str) -> String {
    let examples = in_repository("docs/examples");
    examples.join(name).display().to_string()
}

/// Puts the command into the jobs' `PATH`.
fn install(lab: &Lab) {
    fs::create_dir(lab.path("bin")).unwrap();
    let program = env!("CARGO_BIN_EXE_alliance-under-test");
    std::os::unix::fs::symlink(program, lab.path("bin/alliance")).unwrap();
}

fn rows(lab: &Lab, shard: usize) -> usize {
    let path = lab.path(&format!("shards/journal-{shard}-of-{SHARDS}.jsonl"));
    let text = fs::read_to_string(path).unwrap_or_default();
    text.lines().count().saturating_sub(1)
}

#[test]
fn slurm_runs_shards_and_requeues_one_that_is_killed() {
    if !is_installed() {
        return;
    }
    let lab = Lab::new();
    lab.write("plan.toml", PLAN);
    lab.run("sweep plan.toml --out whole").expect(0);
    install(&lab);

    let cluster = Cluster::start(&lab, 1, SHARDS);
    let script = recipe("slurm.sbatch");
    let shards = ["--parsable", &script, "sweep", "plan.toml", "shards"];
    let job = cluster.run("sbatch", &shards);
    wait_until("some runs of shard 3", || rows(&lab, 3) >= 2);
    cluster.run("scontrol", &["requeue", &format!("{job}_3")]);
    wait_until("the end of all jobs", || {
        cluster.run("squeue", &["-h", "-j", &job]).is_empty()
    });
    let log = |shard: usize| lab.text(&format!("alliance-{job}_{shard}.log"));
    let killed = log(3);
    assert!(killed.contains("DUE TO JOB REQUEUE"), "{killed}");
    let total = format!("{RUNS} runs, ");
    let completed = killed
        .split(&total)
        .nth(1)
        .and_then(|rest| rest.split(' ').next());
    let completed = completed.and_then(|count| count.parse::<usize>().ok());
    // Killed in the middle.
    let is_torn = completed.is_some_and(|count| (2..RUNS).contains(&count));
    assert!(is_torn, "{killed}");
    for shard in 0..SHARDS {
        let text = log(shard);
        let line = format!("shard {shard}/{SHARDS}: {RUNS} runs done");
        assert!(text.contains(&line), "{text}");
    }
    drop(cluster);

    lab.run("sweep --merge shards").expect(0);
    lab.assert_same_results("whole", "shards");
}

/// The hosts as the script expects them.
const TEAM: &str = r#"
scenario = "waste-cleanup"
seed = 1
listen = "tls/WORLD:PORT"
world = "h1"
[[hosts]]
name = "h1"
robots = ["blue"]
[[hosts]]
name = "h2"
robots = ["gold"]
[[hosts]]
name = "h3"
robots = ["green"]
"#;

#[test]
fn slurm_runs_a_team_on_three_nodes() {
    if !is_installed() {
        return;
    }
    let lab = Lab::new();
    lab.write("team.toml", TEAM);
    install(&lab);
    let cluster = Cluster::start(&lab, 3, 1);
    let script = recipe("machines/slurm.sbatch");
    let arguments = ["--parsable", "--wait", "--nodes=3", &script, "team.toml"];
    let submitted = cluster.query("sbatch", &arguments);
    let job = String::from_utf8(submitted.stdout).unwrap();
    let job = job.trim();
    let log = lab.text(&format!("alliance-team-{job}.log"));
    assert!(submitted.status.success(), "{log}");
    let folder = format!("alliance-team-{job}");
    for (host, robot) in [("h2", "gold"), ("h3", "green")] {
        let text = lab.text(&format!("{folder}/run/logs/host.{host}.log"));
        assert!(text.contains(&format!("robots {robot}\n")), "{text}");
    }
    drop(cluster);

    // The bytes are those of one machine, and the shared folder contains no keys.
    lab.mission("alone", "waste-cleanup --seed=1").expect(0);
    lab.assert_same_bytes(&format!("{folder}/run"), "alone");
    assert_eq!(lab.names(&folder), ["run", "runs", "team.toml"]);
}
