//! Shards of a sweep under a real Slurm, whose daemons run as processes of this test on loopback.

use std::fs::{self, File};
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use alliance_tests::needs::cannot_run;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::harness::{Lab, wait_until};

const PLAN: &str = "
limit_s = 120.0
seeds = 160
[grid]
allocator = ['alliance', 'cbba']
";

const SHARDS: usize = 8;

/// Runs of a shard.
const RUNS: usize = 320 / SHARDS;

/// Slurm's daemons, ended in the order in which they depend on each other.
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
    /// One node with a processor for each shard.
    fn start(lab: &'l Lab) -> Self {
        let folder = lab.path("slurm");
        for name in ["state", "spool"] {
            fs::create_dir_all(folder.join(name)).unwrap();
        }
        let key = folder.join("munge.key");
        fs::write(&key, [7; 1024]).unwrap();
        fs::set_permissions(&key, fs::Permissions::from_mode(0o600)).unwrap();
        let host = said("uname", &["-n"]);
        let host = host.split('.').next().unwrap();
        let user = said("id", &["-un"]);
        let [control, node] = free_ports();
        let at = folder.display();
        // A job that is requeued waits until no credential of its old life is good any more: less than 5 s is taken for the default, 120 s.
        let conf = format!(
            "ClusterName=lab\nSlurmctldHost={host}(127.0.0.1)\nSlurmctldPort={control}\nSlurmdPort={node}\n\
             SlurmUser={user}\nSlurmdUser={user}\nAuthType=auth/munge\nAuthInfo=socket={at}/munge.socket,cred_expire=6\n\
             CredType=cred/munge\nStateSaveLocation={at}/state\nSlurmdSpoolDir={at}/spool\n\
             SlurmctldPidFile={at}/slurmctld.pid\nSlurmdPidFile={at}/slurmd.pid\n\
             SlurmctldLogFile={at}/slurmctld.log\nSlurmdLogFile={at}/slurmd.log\n\
             ProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nMpiDefault=none\nSwitchType=switch/none\n\
             JobAcctGatherType=jobacct_gather/none\nAccountingStorageType=accounting_storage/none\n\
             SchedulerType=sched/builtin\nSelectType=select/cons_tres\nSelectTypeParameters=CR_CPU\n\
             SlurmdParameters=config_overrides\nReturnToService=2\nKillWait=1\n\
             NodeName={host} NodeAddr=127.0.0.1 CPUs={SHARDS} State=UNKNOWN\n\
             PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP\n"
        );
        fs::write(folder.join("slurm.conf"), conf).unwrap();
        let mut cluster = Self {
            lab,
            daemons: Vec::new(),
        };
        let file = |name: &str, ending: &str| format!("--{name}={at}/munge.{ending}");
        let munge = [
            "--foreground".to_owned(),
            "--force".to_owned(),
            file("socket", "socket"),
            file("key-file", "key"),
            file("pid-file", "pid"),
            file("log-file", "log"),
            file("seed-file", "seed"),
        ];
        cluster.daemon("munged", &munge);
        let socket = folder.join("munge.socket");
        wait_until("munged's socket", || socket.exists());
        cluster.daemon("slurmctld", &["-D".to_owned(), "-c".to_owned()]);
        cluster.daemon(
            "slurmd",
            &["-D".to_owned(), "-N".to_owned(), host.to_owned()],
        );
        wait_until("the node", || {
            let said = cluster.ask("sinfo", &["-h", "-o", "%t"]);
            String::from_utf8_lossy(&said.stdout).trim() == "idle"
        });
        cluster
    }

    fn daemon(&mut self, name: &str, arguments: &[String]) {
        let log = File::create(self.lab.path(&format!("slurm/{name}.out"))).unwrap();
        let mut command = self.command(&program(name));
        command.args(arguments).stdin(Stdio::null());
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

    fn ask(&self, name: &str, arguments: &[&str]) -> Output {
        self.command(name).args(arguments).output().unwrap()
    }

    #[track_caller]
    fn done(&self, name: &str, arguments: &[&str]) -> String {
        let output = self.ask(name, arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{name} {arguments:?}: {said}");
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    }
}

/// Daemons are where users do not look for programs.
fn program(name: &str) -> String {
    let there = Path::new("/usr/sbin").join(name);
    if there.exists() {
        there.display().to_string()
    } else {
        name.to_owned()
    }
}

/// What a program says in a word.
fn said(name: &str, arguments: &[&str]) -> String {
    let output = Command::new(name).args(arguments).output().unwrap();
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

/// Two that nobody listens at.
fn free_ports() -> [u16; 2] {
    let listeners = [(); 2].map(|()| TcpListener::bind("127.0.0.1:0").unwrap());
    listeners.map(|listener| listener.local_addr().unwrap().port())
}

fn rows(lab: &Lab, shard: usize) -> usize {
    let path = lab.path(&format!("shards/journal-{shard}-of-{SHARDS}.jsonl"));
    let text = fs::read_to_string(path).unwrap_or_default();
    text.lines().count().saturating_sub(1)
}

#[test]
fn slurm_runs_shards_and_requeues_one_that_is_killed() {
    let there = ["slurmctld", "slurmd", "munged", "sbatch"]
        .iter()
        .all(|name| {
            // Its status says nothing: without a configuration sbatch fails even here.
            let tried = Command::new(program(name)).arg("--version").output();
            tried.is_ok()
        });
    if !there {
        let how =
            "no Slurm: install Debian's packages `slurmctld`, `slurmd`, `slurm-client` and `munge`";
        cannot_run(how);
        return;
    }
    let lab = Lab::new();
    fs::write(lab.path("plan.toml"), PLAN).unwrap();
    lab.run(&["sweep", "plan.toml", "--out", "whole"]).expect(0);
    fs::create_dir(lab.path("bin")).unwrap();
    let program = env!("CARGO_BIN_EXE_alliance-under-test");
    std::os::unix::fs::symlink(program, lab.path("bin/alliance")).unwrap();

    let cluster = Cluster::start(&lab);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let script = root.join("docs/examples/slurm.sbatch");
    let job = cluster.done(
        "sbatch",
        &[
            "--parsable",
            script.to_str().unwrap(),
            "sweep",
            "plan.toml",
            "shards",
        ],
    );
    wait_until("some runs of shard 3", || rows(&lab, 3) >= 2);
    cluster.done("scontrol", &["requeue", &format!("{job}_3")]);
    wait_until("the end of all jobs", || {
        cluster.done("squeue", &["-h", "-j", &job]).is_empty()
    });
    let log = |shard: usize| {
        fs::read_to_string(lab.path(&format!("alliance-{job}_{shard}.log"))).unwrap()
    };
    let killed = log(3);
    assert!(killed.contains("DUE TO JOB REQUEUE"), "{killed}");
    let before = format!("{RUNS} runs, ");
    let (_, before) = killed
        .split_once(&before)
        .unwrap_or_else(|| panic!("{killed}"));
    let before: usize = before.split(' ').next().unwrap().parse().unwrap();
    assert!((2..RUNS).contains(&before), "in the middle: {before}");
    for shard in 0..SHARDS {
        let said = log(shard);
        let line = format!("shard {shard}/{SHARDS}: all {RUNS} runs are done");
        assert!(said.contains(&line), "{said}");
    }
    drop(cluster);

    lab.run(&["sweep", "--merge", "shards"]).expect(0);
    super::sweep::assert_same_files(&lab, "whole", "shards");
}
