//! Starts the command and its processes, and ends all of them after a test.

#![allow(clippy::disallowed_methods)] // Waiting for real processes needs the real clock; no assertion depends on it.

use missions::Registry;
use missions::waste::data::{WasteSection, default_scenario};
use std::fs::File;
use std::io::Read;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use crate::hosts::Hosts;
use crate::testkit::{files, results};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use run_log::RunLog;
use tempfile::TempDir;

/// The longest wait of a test. A longer wait is a hang. It is long because machines can be busy.
const PATIENCE: Duration = Duration::from_secs(120);

/// Returns the path of the command under test, which cargo puts above the folder of the tests' own programs.
///
/// # Panics
/// Panics if the test has no path.
#[must_use]
pub fn alliance() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let target = test.ancestors().nth(2).unwrap();
    target.join("alliance-under-test")
}

/// The arguments of a command: words with blanks between them, or a list if a word contains a blank.
pub trait Arguments {
    fn words(&self) -> Vec<String>;
}

impl Arguments for str {
    fn words(&self) -> Vec<String> {
        self.split_whitespace().map(str::to_owned).collect()
    }
}

impl Arguments for String {
    fn words(&self) -> Vec<String> {
        self.as_str().words()
    }
}

impl<T: AsRef<str>> Arguments for [T] {
    fn words(&self) -> Vec<String> {
        self.iter().map(|word| word.as_ref().to_owned()).collect()
    }
}

impl<T: AsRef<str>, const N: usize> Arguments for [T; N] {
    fn words(&self) -> Vec<String> {
        self[..].words()
    }
}

impl<T: AsRef<str>> Arguments for Vec<T> {
    fn words(&self) -> Vec<String> {
        self[..].words()
    }
}

impl<A: Arguments + ?Sized> Arguments for &A {
    fn words(&self) -> Vec<String> {
        (**self).words()
    }
}

/// Returns two lists of arguments as one.
pub fn join(first: impl Arguments, rest: impl Arguments) -> Vec<String> {
    [first.words(), rest.words()].concat()
}

/// The folder, the runtime folder and the processes of one test.
pub struct Lab {
    folder: TempDir,
}

/// A process under test. It is killed when dropped.
pub struct Process {
    name: String,
    child: Child,
    output: PathBuf,
}

/// The exit status and the output of a process.
#[derive(Debug)]
pub struct Finished {
    pub name: String,
    pub status: ExitStatus,
    pub stdout: String,
    pub stderr: String,
}

impl Lab {
    #[allow(clippy::new_without_default)] // It creates a folder, which is no default value.
    pub fn new() -> Self {
        Self {
            folder: TempDir::new().unwrap(),
        }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), text).unwrap();
    }

    #[track_caller]
    pub fn bytes(&self, name: &str) -> Vec<u8> {
        let bytes = std::fs::read(self.path(name));
        bytes.unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    #[track_caller]
    pub fn text(&self, name: &str) -> String {
        String::from_utf8(self.bytes(name)).unwrap()
    }

    #[track_caller]
    pub fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&self.bytes(name)).unwrap()
    }

    pub fn exists(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    /// Returns the names of all entries of a folder in order, including hidden ones.
    pub fn names(&self, folder: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.path(folder)).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }

    pub fn start(&self, arguments: impl Arguments) -> Process {
        self.start_with(arguments, &[])
    }

    /// Starts a world by hand, with the run folder `out`.
    pub fn world(&self, out: &str, arguments: &str) -> Process {
        self.start(format!("cluster world --out {out} {arguments}"))
    }

    /// Starts an agent by hand.
    pub fn agent(&self, robot: &str) -> Process {
        self.start(format!("cluster agent --robot {robot}"))
    }

    pub fn start_with(&self, arguments: impl Arguments, variables: &[(&str, &str)]) -> Process {
        let runtime = self.path("runtime");
        std::fs::create_dir_all(&runtime).unwrap();
        let mut command = Command::new(alliance());
        command.env("XDG_RUNTIME_DIR", &runtime);
        command.envs(variables.iter().copied());
        self.spawn(command, arguments)
    }

    pub fn start_on(&self, hosts: &Hosts, host: &str, arguments: impl Arguments) -> Process {
        self.spawn(hosts.command(host, alliance()), arguments)
    }

    fn spawn(&self, mut command: Command, arguments: impl Arguments) -> Process {
        static COUNT: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);
        let number = COUNT.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let output = self.path(&format!("process-{number}"));
        let arguments = arguments.words();
        let child = command
            .args(&arguments)
            .current_dir(self.folder.path())
            .env("RUST_BACKTRACE", "0")
            .env_remove("RUST_LOG")
            .stdin(Stdio::null())
            .stdout(File::create(output.with_extension("out")).unwrap())
            .stderr(File::create(output.with_extension("err")).unwrap())
            .spawn()
            .unwrap();
        Process {
            name: arguments.join(" "),
            child,
            output,
        }
    }

    pub fn run(&self, arguments: impl Arguments) -> Finished {
        self.start(arguments).wait()
    }

    /// Returns the one-line error of a command that is refused with exit status 2 and has no other output.
    #[track_caller]
    pub fn refusal(&self, arguments: impl Arguments) -> String {
        let finished = self.run(arguments).expect(2);
        let error = finished.stderr;
        assert_eq!(error.lines().count(), 1, "{}: {error}", finished.name);
        let programs = ["alliance", "world: ", "robot-agent: "];
        let names_program = programs.iter().any(|program| error.starts_with(program));
        assert!(names_program, "{}: {error}", finished.name);
        assert_eq!(finished.stdout, "", "{}", finished.name);
        error
    }

    /// Writes a scenario file for the default mission with `items` items, half of them in each spill.
    pub fn mission_of(&self, items: u32) -> String {
        let mut scenario = default_scenario();
        for spill in &mut WasteSection::of_mut(&mut scenario).spills {
            spill.items = items / 2;
        }
        let file = format!("mission-of-{items}.toml");
        self.write(&file, scenario.to_toml().unwrap());
        file
    }

    /// Runs `alliance run` with `--out NAME`, without a page, to its end.
    pub fn mission(&self, out: &str, arguments: impl Arguments) -> Finished {
        self.run(join(["run", "--no-page", "--out", out], arguments))
    }

    /// Checks that a replay of a run is identical.
    #[track_caller]
    pub fn assert_repeated(&self, run: &str) {
        let again = self.run(["replay", run]).expect(0);
        let (answer, stderr) = (again.answer(), &again.stderr);
        assert!(answer.starts_with("identical"), "{run}: {stderr}");
    }

    pub fn log(&self, out: &str) -> RunLog {
        RunLog::open(&self.path(out), &Registry::built_in().vocabulary()).unwrap()
    }

    /// Waits for a line in a log table of the folder `run` that contains all texts, and returns it. Fails if the
    /// launcher ends first.
    #[track_caller]
    pub fn wait_for_row(&self, launcher: &mut Process, table: &str, texts: &[&str]) -> String {
        let path = self.path("run").join(table);
        let mut found = None;
        wait_until(&format!("{texts:?} in {table}"), || {
            // Only complete lines count, because the last one may be partly written.
            let text = std::fs::read_to_string(&path).unwrap_or_default();
            let whole = text.rfind('\n').map_or("", |end| &text[..end]);
            found = whole
                .lines()
                .find(|line| texts.iter().all(|text| line.contains(text)))
                .map(ToOwned::to_owned);
            assert!(
                found.is_some() || launcher.is_running(),
                "the run ended without {texts:?} in {table}:\n{}",
                launcher.stderr()
            );
            found.is_some()
        });
        found.unwrap()
    }

    /// Checks that two folders have the same files, except journals.
    #[track_caller]
    pub fn assert_same_results(&self, a: &str, b: &str) {
        let (left, right) = (results(&self.path(a)), results(&self.path(b)));
        assert!(left.keys().eq(right.keys()), "files of {a} and {b}");
        assert!(!left.is_empty(), "{a} is empty");
        for (name, bytes) in &left {
            assert!(*bytes == right[name], "{name} of {a} and {b}");
        }
    }

    /// Checks that each table of two runs has the same bytes, and that their answers of external controllers do.
    #[track_caller]
    pub fn assert_same_bytes(&self, a: &str, b: &str) {
        let tables = |run: &str| {
            let mut tables = files(&self.path(run));
            let endings = [".csv", "inputs.jsonl", "foreign.bin"];
            tables.retain(|name, _| endings.iter().any(|ending| name.ends_with(ending)));
            tables
        };
        let (left, right) = (tables(a), tables(b));
        assert!(left.keys().eq(right.keys()), "tables of {a} and {b}");
        assert!(left.len() >= 7, "tables of {a}: {:?}", left.keys());
        for (table, left) in left {
            let right = &right[&table];
            assert!(!left.is_empty(), "{a}/{table} is empty");
            if left != *right {
                let at = left.iter().zip(right).position(|(x, y)| x != y);
                let at = at.unwrap_or(left.len().min(right.len()));
                let around = |bytes: &[u8]| {
                    let from = at.saturating_sub(120);
                    String::from_utf8_lossy(&bytes[from..bytes.len().min(at + 120)]).into_owned()
                };
                panic!(
                    "{table} of {a} and {b} differ at byte {at}:\n{}\n---\n{}",
                    around(&left),
                    around(right)
                );
            }
        }
    }
}

impl Process {
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    pub fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(self.child.id() as i32), signal).unwrap();
    }

    /// Returns the text written to stderr so far.
    pub fn stderr(&self) -> String {
        read(&self.output.with_extension("err"))
    }

    #[track_caller]
    pub fn wait_for_stderr(&mut self, text: &str) {
        let name = self.name.clone();
        wait_until(&format!("'{text}' on stderr of {name}"), || {
            let ended = self.child.try_wait().unwrap();
            let found = self.stderr().contains(text);
            assert!(
                found || ended.is_none(),
                "{name} ended without '{text}' on stderr:\n{}",
                self.stderr()
            );
            found
        });
    }

    /// Waits for `text` on stderr. Returns the process id after it.
    #[track_caller]
    pub fn shown_pid(&mut self, text: &str) -> Pid {
        self.wait_for_stderr(text);
        let stderr = self.stderr();
        let (_, rest) = stderr.split_once(text).unwrap();
        let mut numbers = rest.split(|letter: char| !letter.is_ascii_digit());
        Pid::from_raw(numbers.next().unwrap().parse().unwrap())
    }

    pub fn is_running(&mut self) -> bool {
        self.child.try_wait().unwrap().is_none()
    }

    #[track_caller]
    pub fn wait(mut self) -> Finished {
        let mut status = None;
        wait_until(&format!("the end of {}", self.name), || {
            status = self.child.try_wait().unwrap();
            status.is_some()
        });
        Finished {
            name: self.name.clone(),
            status: status.unwrap(),
            stdout: read(&self.output.with_extension("out")),
            stderr: read(&self.output.with_extension("err")),
        }
    }

    pub fn children(&self) -> Vec<u32> {
        children(self.pid())
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // A killed launcher's children end by themselves.
        if self.child.try_wait().is_ok_and(|ended| ended.is_none()) {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

impl Finished {
    /// Returns stderr after the notes and the progress of a replay, which a slow machine prints.
    pub fn answer(&self) -> &str {
        let mut answer = self.stderr.as_str();
        while let Some((line, rest)) = answer.split_once('\n')
            && (line.starts_with("replaying the run")
                || line.starts_with("the run has not ended")
                || line.contains(": running it again")
                || line.ends_with(" left"))
        {
            answer = rest;
        }
        answer
    }

    /// Checks that stderr contains a text.
    #[track_caller]
    pub fn shows(&self, text: &str) -> &Self {
        let Self { name, stderr, .. } = self;
        assert!(stderr.contains(text), "no '{text}' of {name}:\n{stderr}");
        self
    }

    /// Parses the output of `alliance run --json`.
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout).unwrap()
    }

    /// Checks the exit status, and shows the output if it differs.
    #[track_caller]
    pub fn expect(self, code: i32) -> Self {
        assert_eq!(
            self.status.code(),
            Some(code),
            "exit status of: alliance {}\nstdout:\n{}\nstderr:\n{}",
            self.name,
            self.stdout,
            self.stderr
        );
        self
    }
}

/// Waits for the end of processes and checks their exit status.
#[track_caller]
pub fn expect_all(processes: impl IntoIterator<Item = Process>, code: i32) -> Vec<Finished> {
    let processes = processes.into_iter();
    processes
        .map(|process| process.wait().expect(code))
        .collect()
}

/// Waits until the condition holds. Fails after a long time.
#[track_caller]
pub fn wait_until(what: &str, mut condition: impl FnMut() -> bool) {
    let until = Instant::now() + PATIENCE;
    while !condition() {
        assert!(Instant::now() < until, "no {what} within the time limit");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Returns the ids of the live children of all threads of a process.
pub fn children(pid: u32) -> Vec<u32> {
    let threads = std::fs::read_dir(format!("/proc/{pid}/task"));
    let threads = threads.into_iter().flatten().flatten();
    let children: String = threads
        .map(|thread| read(&thread.path().join("children")))
        .collect();
    let children = children.split_whitespace();
    children.map(|child| child.parse().unwrap()).collect()
}

/// Returns the command line of a live process, or `None` after its end.
pub fn command_line(pid: u32) -> Option<String> {
    let state = read(Path::new(&format!("/proc/{pid}/stat")));
    // A zombie process has ended.
    if state.is_empty() || state.rsplit(')').next()?.trim_start().starts_with('Z') {
        return None;
    }
    Some(read(Path::new(&format!("/proc/{pid}/cmdline"))).replace('\0', " "))
}

fn read(path: &Path) -> String {
    let mut text = Vec::new();
    if let Ok(mut file) = File::open(path) {
        let _ = file.read_to_end(&mut text);
    }
    String::from_utf8_lossy(&text).into_owned()
}

/// Returns unused ports of this machine.
#[must_use]
pub fn free_ports(count: usize) -> Vec<u16> {
    let listeners = (0..count).map(|_| TcpListener::bind("127.0.0.1:0").unwrap());
    let listeners: Vec<TcpListener> = listeners.collect();
    let port = |listener: &TcpListener| listener.local_addr().unwrap().port();
    listeners.iter().map(port).collect()
}
