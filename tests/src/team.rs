//! A live mission whose processes can be killed, stopped, continued and restarted.

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::harness::{Arguments, Finished, Lab, Process, command_line, join, wait_until};

/// A mission under `alliance run`, in the folder `run` of its lab.
pub struct Team<'l> {
    lab: &'l Lab,
    launcher: Process,
    pub id: String,
    pids: Vec<(String, u32)>,
}

impl<'l> Team<'l> {
    /// Starts the mission without a page, and waits for all process ids.
    pub fn start(lab: &'l Lab, arguments: impl Arguments) -> Self {
        Self::start_with_page(lab, join(arguments, "--no-page"))
    }

    /// Starts the mission with its page, unless the arguments disable it. The launcher's stderr contains the link.
    pub fn start_with_page(lab: &'l Lab, arguments: impl Arguments) -> Self {
        let mut launcher = lab.start(join("run --out run --json", arguments));
        launcher.wait_for_stderr("process ids: ");
        let stderr = launcher.stderr();
        let after = |label: &str| {
            let line = stderr.lines().find_map(|line| line.strip_prefix(label));
            line.unwrap().to_owned()
        };
        let pids = after("process ids: ")
            .split(", ")
            .map(|entry| {
                // The last entry of a large team ends with "and 5 more".
                let mut words = entry.split(' ');
                let mut word = || words.next().unwrap();
                (word().to_owned(), word().parse().unwrap())
            })
            .collect();
        Self {
            lab,
            launcher,
            id: after("run "),
            pids,
        }
    }

    /// Waits for the link to the page and returns the process id of its server.
    pub fn wait_for_page(&mut self) -> u32 {
        self.launcher.shown_pid("(process ").as_raw() as u32
    }

    pub fn robots(&self) -> Vec<String> {
        let names = self.pids.iter().map(|(name, _)| name.clone());
        names.filter(|name| name != "world").collect()
    }

    pub fn launcher(&self) -> &Process {
        &self.launcher
    }

    /// Returns the process id of a robot or of "world".
    pub fn pid(&self, name: &str) -> u32 {
        self.pids.iter().find(|(known, _)| known == name).unwrap().1
    }

    pub fn signal(&self, name: &str, signal: Signal) {
        kill(Pid::from_raw(self.pid(name) as i32), signal).unwrap();
    }

    /// Sends a signal to a robot's first process, which may have ended.
    pub fn try_signal(&self, name: &str, signal: Signal) {
        let _ = kill(Pid::from_raw(self.pid(name) as i32), signal);
    }

    /// Sends a signal to the current process of a robot, if there is one.
    pub fn try_signal_latest(&self, name: &str, signal: Signal) {
        let option = format!("--robot {name} ");
        let is_agent = |pid: &u32| command_line(*pid).is_some_and(|line| line.contains(&option));
        for pid in self.launcher.children().into_iter().filter(is_agent) {
            let _ = kill(Pid::from_raw(pid as i32), signal);
        }
    }

    pub fn is_running(&mut self) -> bool {
        self.launcher.is_running()
    }

    /// Kills a robot and waits for the end of its process.
    pub fn kill(&self, name: &str) {
        self.signal(name, Signal::SIGKILL);
        let pid = self.pid(name);
        wait_until(&format!("the end of {name}"), || {
            command_line(pid).is_none()
        });
    }

    /// Starts a separate agent, which becomes the robot's process.
    pub fn restart(&mut self, name: &str) -> Process {
        let agent = self
            .lab
            .start(format!("cluster agent --robot {name} --run {}", self.id));
        for (known, pid) in &mut self.pids {
            if known == name {
                *pid = agent.pid();
            }
        }
        agent
    }

    /// Waits for a line in a log table that contains all texts, and returns it.
    #[track_caller]
    pub fn wait_for_row(&mut self, table: &str, texts: &[&str]) -> String {
        self.lab.wait_for_row(&mut self.launcher, table, texts)
    }

    #[track_caller]
    pub fn wait_for_stderr(&mut self, text: &str) {
        self.launcher.wait_for_stderr(text);
    }

    pub fn wait(self) -> Finished {
        self.launcher.wait()
    }
}
