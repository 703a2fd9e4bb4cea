//! Starts the processes of a run, watches them until the world ends, and leaves none behind.

use std::fs::File;
use std::io::{self, Seek, Write};
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use alliance_proto::control::AgentState;
use alliance_proto::log::{RunFile, RunOutcome};
use alliance_proto::process::{ProcessAct, ProcessState};
use alliance_proto::rendezvous::Rendezvous;
use alliance_proto::view::View;
use anyhow::{Context, Error, bail};
use missions::Registry;
use nix::sys::memfd::{MFdFlags, memfd_create};
use nix::sys::signal::Signal;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;
use tokio::time::{Instant, sleep, timeout};
use world_server::invocation;

use super::bus::{Bus, Call};
use super::children::{Change, Ending, Process};
use super::crew::Crew;
use super::plan::Plan;
use super::progress::Progress;
use super::summary;
use crate::cluster::start::Hold;
use crate::page::link::Link;
use crate::page::server::FAREWELL;
use crate::runtime;

/// How long a process may take to end by itself, and again to obey SIGTERM, before it is killed. The page may also take leave.
pub const GRACE: Duration = Duration::from_secs(3);

/// How long after a request to end the next one is meant as a new one.
const AGAIN: Duration = Duration::from_millis(500);

/// How long other hosts may take to end their agents, and themselves.
const HOSTS: Duration = Duration::from_secs(15);

/// How long a run that has not begun outlives one of its agents.
const STILLBORN: Duration = Duration::from_secs(1);

/// How long a world that is asked to end may take, in all. It has a log to finish.
const ENDING: Duration = Duration::from_secs(15);

/// How often processes and progress are looked at when nothing calls.
const INTERVAL: Duration = Duration::from_millis(200);

/// Runs it to its end, with a page at that link; whether the mission is complete.
///
/// # Errors
/// When a process cannot be started or fails, or the bus does.
pub fn supervise(plan: &Plan, link: Option<Link>) -> anyhow::Result<bool> {
    let runtime = runtime::start()?;
    runtime.block_on(async {
        let mut team = Team::start(plan, link)?;
        let watched = team.watch(plan).await;
        team.end_all().await;
        team.progress.clear();
        watched?;
        team.check_world()
    })?;
    let run = read_run(&plan.folder)?;
    summary::show(plan, &run)?;
    Ok(run.outcome == RunOutcome::Ended(alliance_proto::tick::Outcome::Complete))
}

/// The processes of a run.
struct Team {
    world: Process,
    crew: Crew,
    /// What started the daemons of other hosts, and holds them.
    hosts: Vec<(Process, Hold)>,
    /// Serves the page. The run does without it.
    page: Option<Process>,
    progress: Progress,
}

impl Team {
    fn start(plan: &Plan, link: Option<Link>) -> anyhow::Result<Self> {
        let logs = plan.folder.join("logs");
        std::fs::create_dir_all(&logs).with_context(|| logs.display().to_string())?;

        let mut arguments = vec!["world".to_owned()];
        arguments.extend(plan.world_arguments.iter().cloned());
        arguments.push(format!("--out={}", plan.folder.display()));
        arguments.push(format!("--run={}", plan.run));
        arguments.push("--launched".to_owned());
        let command = [(invocation::COMMAND, invocation::command())];
        let log = logs.join("world.log");
        let input = match &plan.start {
            Some(start) => in_memory(&start.world.to_line())
                .context("standard input of the world")?
                .into(),
            None => Stdio::null(),
        };
        let world = Process::start_with("world", &log, &arguments, input, &command, false)?;
        let mut team = Self {
            world,
            crew: Crew::new(plan.run.clone(), plan.minds.clone(), logs),
            hosts: Vec::new(),
            page: None,
            progress: Progress::new(&plan.setup),
        };
        let robots = plan.setup.scenario.robots.iter();
        let here = |name: &String| !plan.elsewhere.contains(name);
        for robot in robots.filter(|robot| !robot.absent && here(&robot.name)) {
            // Should one not start, those that run already die with this process.
            team.crew.start(&robot.name)?;
        }
        for host in plan.start.iter().flat_map(|start| &start.hosts) {
            let started = Process::start_host(host, &team.crew.logs)?;
            team.hosts.push(started);
        }
        let hosts = team.hosts.iter().map(|(host, _)| host);
        let pids: Vec<String> = std::iter::once(&team.world)
            .chain(&team.crew.agents)
            .chain(hosts)
            .map(|process| format!("{} {}", process.name(), process.pid()))
            .collect();
        team.progress.say(&format!("run {}", plan.run));
        team.progress
            .say(&format!("process ids: {}", pids.join(", ")));
        if let Some(link) = link {
            team.start_page(link, plan.open);
        }
        if plan.paused {
            team.progress
                .say("the clock is held: start it on the page, or with `alliance clock resume`");
        }
        Ok(team)
    }

    /// A process that serves the page. The run does without it.
    fn start_page(&mut self, link: Link, open: bool) {
        let url = link.url();
        let opened = open.then(|| link.open());
        let (socket, token) = link.into_heritage();
        let mut arguments = ["watch", &self.crew.run, "--inherited"]
            .map(ToOwned::to_owned)
            .to_vec();
        if open {
            arguments.push("--stays".to_owned());
        }
        let page = Process::start_with(
            "page",
            &self.crew.logs.join("page.log"),
            &arguments,
            OwnedFd::from(socket).into(),
            &[token],
            false,
        );
        match page {
            Ok(page) => {
                self.progress
                    .say(&format!("page {url} (process {})", page.pid()));
                self.page = Some(page);
            }
            Err(error) => self.progress.say(&format!("no page: {error:#}")),
        }
        if let Some(Err(error)) = opened {
            self.progress.say(&format!("{error:#}"));
        }
    }

    /// A stopped observer holds nothing that anybody needs, but its open connection holds up the world's end.
    fn release_page(&self) {
        if let Some(page) = self.page.as_ref().filter(|page| page.is_stopped()) {
            page.signal(Signal::SIGKILL);
        }
    }

    /// Until the world has ended.
    async fn watch(&mut self, plan: &Plan) -> anyhow::Result<()> {
        let mut children = signal(SignalKind::child())?;
        let mut interrupt = signal(SignalKind::interrupt())?;
        let mut terminate = signal(SignalKind::terminate())?;
        let (sender, mut views) = watch::channel(None::<View>);
        let mut bus: Option<Bus> = None;
        let mut first_loss: Option<Instant> = None;
        let mut interrupted = None;

        while self.world.ending().is_none() {
            if bus.is_none() && Rendezvous::find(Some(&plan.run)).is_ok() {
                bus = self.observe(sender.clone()).await;
                if let Some(bus) = &mut bus {
                    self.tell_what_was(bus).await;
                }
            }
            let pause = if bus.is_none() {
                INTERVAL / 10
            } else {
                INTERVAL
            };
            tokio::select! {
                _ = children.recv() => {}
                _ = interrupt.recv() => interrupted = self.interrupt(interrupted),
                _ = terminate.recv() => interrupted = self.interrupt(interrupted),
                Ok(()) = views.changed() => {
                    if let Some(view) = views.borrow_and_update().as_ref() {
                        self.progress.show(view);
                        if view.outcome.is_some() {
                            self.release_page();
                        }
                    }
                }
                call = heard(bus.as_mut()) => match call {
                    Call::Order(order, query) => {
                        let done = self.crew.obey(&order).await;
                        if let (Ok(pid), ProcessAct::Start) = (&done, order.act) {
                            self.progress.say(&format!("{} is process {pid} now", order.robot));
                        }
                        if let Some(bus) = &mut bus {
                            bus.answer(&query, order.number, done).await;
                        }
                    }
                    Call::Event(line) => self.progress.tell(&line),
                },
                () = sleep(pause) => {}
            }
            self.poll(bus.as_mut()).await?;
            self.insist(interrupted);

            let begun = views.borrow().as_ref().is_some_and(|view| {
                view.tick > 0
                    || view
                        .robots
                        .iter()
                        .any(|robot| robot.state == AgentState::Present)
            });
            if let Some(failed) = self.failed()
                && !begun
                && interrupted.is_none()
                && self.world.ending().is_none()
                && first_loss.get_or_insert_with(Instant::now).elapsed() > STILLBORN
            {
                bail!(
                    "the run could not begin: {} {}:\n{}",
                    failed.name(),
                    failed.ending().map_or_else(String::new, Ending::describe),
                    failed.last_words()
                );
            }
        }
        if let Some(bus) = bus {
            let _ = timeout(Duration::from_millis(200), bus.close()).await;
        }
        Ok(())
    }

    /// What became of agents before there was a bus to tell it.
    async fn tell_what_was(&self, bus: &mut Bus) {
        for agent in &self.crew.agents {
            let state = match agent.ending() {
                Some(_) => ProcessState::Ended,
                None if agent.is_stopped() => ProcessState::Stopped,
                None => continue,
            };
            bus.tell(agent.name(), agent.pid(), state).await;
        }
    }

    /// Somebody without whom a run cannot begin: a host, an agent that failed, or any where all have ended. An agent that somebody ended
    /// is a dead robot.
    fn failed(&self) -> Option<&Process> {
        let mut hosts = self.hosts.iter().map(|(host, _)| host);
        if let Some(host) = hosts.find(|host| host.ending().is_some()) {
            return Some(host);
        }
        let all_ended = self
            .crew
            .agents
            .iter()
            .all(|agent| agent.ending().is_some());
        let failed = |agent: &&Process| match agent.ending() {
            Some(Ending::Exit(status)) => status != 0 || all_ended,
            Some(Ending::Signal(_)) => all_ended,
            None => false,
        };
        self.crew.agents.iter().find(failed)
    }

    /// Joins the bus. Without it the run goes on; only its progress is not seen, and no fault reaches a process.
    async fn observe(&self, views: watch::Sender<Option<View>>) -> Option<Bus> {
        match Bus::join(&self.crew.run, views).await {
            Ok(bus) => Some(bus),
            Err(error) => {
                self.progress.say(&format!("no view of the run: {error:#}"));
                None
            }
        }
    }

    /// Looks at every process, and tells the world and the person what has changed.
    async fn poll(&mut self, bus: Option<&mut Bus>) -> anyhow::Result<()> {
        while let Some(change) = self.world.poll()? {
            match change {
                Change::Stopped => {
                    let pid = self.world.pid();
                    let cure = format!("`kill -CONT {pid}` lets it go on, Ctrl-C ends the run");
                    self.progress.say(&format!(
                        "the world (process {pid}) is stopped, and the run stands still; {cure}"
                    ));
                }
                Change::Continued => self.progress.say("the world goes on"),
                Change::Ended(_) => {}
            }
        }
        let over = self.world.ending().is_some();
        if let Some(page) = &mut self.page {
            while let Some(change) = page.poll()? {
                match change {
                    Change::Stopped => self.progress.say("the page is stopped; the run goes on"),
                    Change::Continued => self.progress.say("the page goes on"),
                    Change::Ended(ending) if ending != Ending::Exit(0) && !over => {
                        let said = format!("the page {}; the run goes on", ending.describe());
                        self.progress.say(&said);
                        if matches!(ending, Ending::Exit(_)) {
                            self.progress.say(page.last_words().trim_end());
                        }
                    }
                    Change::Ended(_) => {}
                }
            }
        }
        let progress = &self.progress;
        let say = |line: &str| progress.say(line);
        for (host, _) in &mut self.hosts {
            while let Some(change) = host.poll()? {
                if let (Change::Ended(ending), false) = (change, over) {
                    let said = format!(
                        "{} {}\n{}",
                        host.name(),
                        ending.describe(),
                        host.last_words()
                    );
                    say(said.trim_end());
                }
            }
        }
        self.crew.poll(bus, &say, over).await
    }

    /// Asks the world to end the run; later on, nobody is asked any more. Some programs send one signal twice, to a process
    /// and to its group: the second counts only after a moment.
    fn interrupt(&self, before: Option<Instant>) -> Option<Instant> {
        match before {
            None => {
                self.progress.say("ending the run (again: at once)");
                self.release_page();
                self.world.signal(Signal::SIGTERM);
                Some(Instant::now())
            }
            Some(first) => {
                if first.elapsed() > AGAIN {
                    self.world.signal(Signal::SIGKILL);
                }
                before
            }
        }
    }

    /// A world that was asked to end and does not is killed: at once after the grace if it is stopped, and so hears nothing.
    fn insist(&self, interrupted: Option<Instant>) {
        let patience = if self.world.is_stopped() {
            GRACE
        } else {
            ENDING
        };
        if self.world.ending().is_none()
            && interrupted.is_some_and(|since| since.elapsed() > patience)
        {
            self.progress
                .say("the world does not end: it is killed; the log is whole up to its last tick");
            self.world.signal(Signal::SIGKILL);
        }
    }

    /// No process outlives its run. The page ends last: it still has to tell those who look at it.
    async fn end_all(&mut self) {
        let team = std::iter::once(&mut self.world)
            .chain(self.crew.everybody())
            .collect();
        let say = |line: &str| self.progress.say(line);
        end(team, GRACE, &say).await;
        let mut hosts = Vec::new();
        for (host, hold) in self.hosts.drain(..) {
            drop(hold);
            hosts.push(host);
        }
        end(hosts.iter_mut().collect(), HOSTS, &say).await;
        end(self.page.iter_mut().collect(), FAREWELL + GRACE, &say).await;
    }

    fn check_world(&self) -> anyhow::Result<()> {
        match self.world.ending() {
            Some(Ending::Exit(0 | 1)) => Ok(()),
            ending => {
                let log = if self.crew.logs.with_file_name("run.json").exists() {
                    "its log is whole up to its last tick"
                } else {
                    "it has no log"
                };
                bail!(
                    "the world {}; {log}; {}",
                    ending.map_or_else(|| "does not end".to_owned(), Ending::describe),
                    self.world.said()
                )
            }
        }
    }
}

/// Ends them: first they may so long end by themselves, then they are asked, then killed.
pub async fn end(
    mut processes: Vec<&mut Process>,
    patience: Duration,
    say: &(dyn Fn(&str) + Sync),
) {
    let steps = [
        (None, patience),
        (Some(Signal::SIGTERM), GRACE),
        (Some(Signal::SIGKILL), GRACE),
    ];
    for (signal, patience) in steps {
        if let Some(signal) = signal {
            for process in processes
                .iter()
                .filter(|process| process.ending().is_none())
            {
                if signal == Signal::SIGKILL {
                    say(&format!("{} had to be killed", process.name()));
                }
                process.signal(signal);
            }
        }
        let until = Instant::now() + patience;
        while Instant::now() < until {
            let mut left = false;
            for process in &mut processes {
                // A process that the operating system does not know has ended.
                while let Ok(Some(_)) = process.poll() {}
                left |= process.ending().is_none();
            }
            if !left {
                return;
            }
            sleep(Duration::from_millis(10)).await;
        }
    }
}

/// An input that is in no file system.
fn in_memory(text: &str) -> io::Result<File> {
    let mut file = File::from(memfd_create(c"alliance-keys", MFdFlags::MFD_CLOEXEC)?);
    file.write_all(text.as_bytes())?;
    file.rewind()?;
    Ok(file)
}

/// What comes over the bus next; nothing ever does where there is none.
async fn heard(bus: Option<&mut Bus>) -> Call {
    match bus {
        Some(bus) => bus.call().await,
        None => std::future::pending().await,
    }
}

fn read_run(folder: &Path) -> anyhow::Result<RunFile> {
    let path = folder.join("run.json");
    let at = || path.display().to_string();
    let text = std::fs::read(&path).with_context(at)?;
    let vocabulary = Registry::of_this_program().vocabulary();
    RunFile::parse(&text, &vocabulary)
        .map_err(Error::msg)
        .with_context(at)
}
