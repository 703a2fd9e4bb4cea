//! Supervision of a run's processes: start, state changes until the world ends, and the end of all processes.

use std::fs::File;
use std::io::{self, Seek, Write};
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::Stdio;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use analysis::interrupted::INTERRUPTED_STATUS;
use analysis::table::paragraph;
use anyhow::{Context, Error, bail};
use cluster::rendezvous::Rendezvous;
use missions::Registry;
use nix::sys::memfd::{MFdFlags, memfd_create};
use nix::sys::signal::Signal;
use proto::control::AgentState;
use proto::process::{ProcessAction, ProcessState};
use proto::view::{RobotView, View};
use run_log::RunFile;
use scenario::names::{PAGE, WORLD};
use scenario::{Robot, listed};
use terminal::stderr_line;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;
use tokio::time::{Instant, sleep, timeout};
use world_server::invocation;

use super::bus::{BusMessage, LauncherBus, lock};
use super::child_processes::{Ending, GRACE, Process, ProcessChange, end_processes};
use super::crew::AgentProcesses;
use super::news::RunNews;
use super::observers::{ObserverCommand, poll_observer};
use super::plan::RunPlan;
use super::progress::ProgressDisplay;
use super::summary;
use crate::page::link::PageLink;
use crate::page::server::END_OF_RUN_TIMEOUT;
use crate::ros::bodies::BodyBridge;
use crate::runtime;
use cluster::start::InputHold;

/// The minimum time between two separate requests to end.
const MIN_SIGNAL_INTERVAL: Duration = Duration::from_millis(500);

/// The time for other hosts to end their agents and themselves.
const HOSTS: Duration = Duration::from_secs(15);

/// The time after a process failure at which a run that has not begun is aborted.
const START_FAILURE_DELAY: Duration = Duration::from_secs(1);

/// The time for the world to complete its log and end after a request.
const ENDING: Duration = Duration::from_secs(15);

/// The number of processes whose ids are printed. `alliance list runs` finds the run, and the page shows all robots.
const PIDS: usize = 30;

/// The interval between checks of processes and progress if no message arrives.
const INTERVAL: Duration = Duration::from_millis(200);

/// Runs the processes of a plan to their end and prints the result. Returns the exit status.
///
/// # Errors
/// If a process cannot be started or fails, or the bus fails.
pub fn supervise(plan: &RunPlan, link: Option<PageLink>) -> anyhow::Result<u8> {
    let runtime = runtime::start_runtime()?;
    let has_log = runtime.block_on(async {
        let mut team = RunProcesses::start(plan, link)?;
        let watched = team.watch(plan).await;
        team.end_all().await;
        team.progress.clear();
        let is_interrupted = watched?;
        // A world that is still starting does not handle the request to end.
        if is_interrupted && team.world.ending() == Some(Ending::Signal(Signal::SIGTERM as i32)) {
            return Ok(false);
        }
        team.check_world().map(|()| true)
    })?;
    if !has_log {
        stderr_line!("the run was interrupted before its first tick");
        return Ok(INTERRUPTED_STATUS);
    }
    let run = read_run(&plan.folder)?;
    summary::show(plan, &run)?;
    Ok(summary::exit_status(run.outcome))
}

struct RunProcesses {
    world: Process,
    crew: AgentProcesses,
    /// The commands that run the daemons of other hosts, each with its hold.
    hosts: Vec<(Process, InputHold)>,
    /// The process of the page. The run continues without it.
    page: Option<Process>,
    /// The processes that publish the run, each with the name of the other tool. The run continues without them.
    observers: Vec<(Process, &'static str)>,
    /// The bridge to the bodies; `None` if they move in the world of the run.
    bridge: Option<BodyBridge>,
    progress: ProgressDisplay,
}

impl RunProcesses {
    fn start(plan: &RunPlan, link: Option<PageLink>) -> anyhow::Result<Self> {
        let logs = plan.folder.join("logs");
        std::fs::create_dir_all(&logs).with_context(|| {
            let name = logs.display();
            format!("cannot make {name}; choose another folder with --out")
        })?;

        let bridge = plan.bodies.as_ref();
        let bridge = bridge.map(|settings| BodyBridge::start(settings, &logs));
        let (bridge, socket) = bridge.transpose()?.unzip();
        let mut arguments = ["cluster", "world"].map(ToOwned::to_owned).to_vec();
        arguments.extend(plan.world_arguments.iter().cloned());
        arguments.push(format!("--out={}", plan.folder.display()));
        arguments.push(format!("--run={}", plan.run));
        arguments.push("--launched".to_owned());
        let command = [(invocation::COMMAND, invocation::command())];
        let log = logs.join(format!("{WORLD}.log"));
        let input = match (&plan.start, socket) {
            (_, Some(socket)) => socket.into(),
            (Some(start), None) => in_memory(&start.world.to_line())
                .context("standard input of the world")?
                .into(),
            (None, None) => Stdio::null(),
        };
        let world = Process::start_with(WORLD, &log, &arguments, input, &command, false)?;
        let mut team = Self {
            world,
            crew: AgentProcesses::new(plan.run.clone(), plan.controllers.clone(), logs),
            hosts: Vec::new(),
            page: None,
            observers: Vec::new(),
            bridge,
            progress: ProgressDisplay::new(&plan.setup),
        };
        let robots = plan.setup.scenario.robots.iter();
        let takes_part = |robot: &Robot| match &plan.branch {
            Some(branch) => branch.hand_over.robots.contains(&robot.name),
            None => !robot.absent && !plan.elsewhere.contains(&robot.name),
        };
        let more = plan
            .branch
            .as_ref()
            .map_or(&[][..], |branch| &branch.arguments);
        let robots = robots.filter(|robot| takes_part(robot));
        // If a start fails, the processes that already run die with this process.
        team.crew
            .start_all(robots.map(|robot| robot.name.clone()), more)?;
        for host in plan.start.iter().flat_map(|start| &start.hosts) {
            let started = Process::start_host(host, &team.crew.logs)?;
            team.hosts.push(started);
        }
        let hosts = team.hosts.iter().map(|(host, _)| host);
        let pids: Vec<String> = std::iter::once(&team.world)
            .chain(&team.crew.agents)
            .chain(hosts)
            .map(|process| format!("{} {}", process.name(), process.pid()))
            .chain(team.crew.waiting().map(ToOwned::to_owned))
            .collect();
        team.progress.print_line(&format!("run {}", plan.run));
        team.progress
            .print_line(&paragraph(&format!("process ids: {}", listed(&pids, PIDS))));
        match team.crew.waiting().count() {
            0 => {}
            later => {
                let line =
                    format!("the last {later} processes start when earlier ones have joined");
                team.progress.print_line(&line);
            }
        }
        let has_page = link.is_some();
        if let Some(link) = link {
            team.start_page(link, plan.open);
        }
        if let Some((bridge, settings)) = team.bridge.as_ref().zip(plan.bodies.as_ref()) {
            let line = format!("{} (process {})", settings.describe(), bridge.pid());
            team.progress.print_line(&line);
        }
        for command in &plan.observers {
            team.start_observer(command);
        }
        if plan.paused {
            let page = if has_page { "on the page or " } else { "" };
            let held = format!(
                "the clock is held; start it {page}with `alliance clock resume --run {}`",
                plan.run
            );
            team.progress.print_line(&held);
        }
        Ok(team)
    }

    /// Starts the process of the page. The run continues if this fails.
    fn start_page(&mut self, link: PageLink, open: bool) {
        let url = link.url();
        let opened = open.then(|| link.open());
        let (socket, token) = link.into_inherited();
        let mut arguments = ["watch", &self.crew.run, "--inherited"]
            .map(ToOwned::to_owned)
            .to_vec();
        if open {
            arguments.push("--stays".to_owned());
        }
        let page = Process::start_with(
            PAGE,
            &self.crew.logs.join(format!("{PAGE}.log")),
            &arguments,
            OwnedFd::from(socket).into(),
            &[token],
            false,
        );
        match page {
            Ok(page) => {
                self.progress
                    .print_line(&format!("page {url} (process {})", page.pid()));
                self.page = Some(page);
            }
            Err(error) => self
                .progress
                .print_line(&format!("the page cannot be served: {error:#}")),
        }
        if let Some(Err(error)) = opened {
            self.progress.print_line(&format!("{error:#}"));
        }
    }

    /// Starts a process that publishes the run. The run continues if this fails.
    fn start_observer(&mut self, command: &ObserverCommand) {
        let log = self.crew.logs.join(command.log());
        let title = command.title;
        match Process::start(command.name, &log, &command.arguments) {
            Ok(process) => {
                let line = format!("{} (process {})", command.description, process.pid());
                self.progress.print_line(&line);
                self.observers.push((process, title));
            }
            Err(error) => self.progress.print_line(&format!(
                "the run cannot be published to {title}: {error:#}"
            )),
        }
    }

    /// Kills a stopped page, because its open connection delays the end of the world.
    fn release_page(&self) {
        if let Some(page) = self.page.as_ref().filter(|page| page.is_stopped()) {
            page.signal(Signal::SIGKILL);
        }
    }

    /// Handles orders, events and process changes until the world has ended. Returns whether the user ended the run.
    async fn watch(&mut self, plan: &RunPlan) -> anyhow::Result<bool> {
        let mut children = signal(SignalKind::child())?;
        let mut interrupt = signal(SignalKind::interrupt())?;
        let mut terminate = signal(SignalKind::terminate())?;
        let (sender, mut views) = watch::channel(None::<View>);
        let news = Arc::new(Mutex::new(RunNews::new(&plan.setup)));
        let mut bus: Option<LauncherBus> = None;
        let mut first_loss: Option<Instant> = None;
        let mut interrupted = None;

        while self.world.ending().is_none() {
            if bus.is_none() && Rendezvous::find(Some(&plan.run)).is_ok() {
                bus = self.observe(sender.clone(), Arc::clone(&news)).await;
                if let Some(bus) = &mut bus {
                    self.report_earlier_changes(bus).await;
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
                        self.crew.start_waiting(&plan.setup.scenario.robots, view)?;
                        // The clock waits for processes that this program has yet to start.
                        if self.crew.waiting().next().is_none() {
                            self.progress.show(view);
                        }
                        if view.outcome.is_some() {
                            self.release_page();
                        }
                    }
                }
                call = next_call(bus.as_mut()) => match call {
                    BusMessage::Order(order, query) => {
                        let done = self.crew.execute(&order).await;
                        if let (Ok(pid), ProcessAction::Start) = (&done, order.act) {
                            self.progress.print_line(&format!("{} is process {pid} now", order.robot));
                        }
                        if let Some(bus) = &mut bus {
                            bus.answer(&query, order.number, done).await;
                        }
                    }
                    BusMessage::Line(line) => self.progress.print_line(&line),
                },
                () = sleep(pause) => {}
            }
            self.poll(bus.as_mut()).await?;
            self.kill_if_overdue(interrupted);

            let begun = views.borrow().as_ref().is_some_and(|view| {
                let is_present = |robot: &RobotView| robot.state == AgentState::Present;
                match &plan.branch {
                    // The robots are present before their processes have joined.
                    Some(branch) => view.tick > branch.hand_over.tick,
                    None => view.tick > 0 || view.robots.iter().any(is_present),
                }
            });
            if let Some(failed) = self.failed()
                && !begun
                && interrupted.is_none()
                && self.world.ending().is_none()
                && first_loss.get_or_insert_with(Instant::now).elapsed() > START_FAILURE_DELAY
            {
                bail!(
                    "the run could not begin: {} {}:\n{}",
                    failed.name(),
                    failed.ending().map_or_else(String::new, Ending::describe),
                    failed.last_log_lines()
                );
            }
        }
        if let Some(mut bus) = bus {
            let rest = lock(&news).finish();
            for line in bus.take_lines().into_iter().chain(rest) {
                self.progress.print_line(&line);
            }
            let _ = timeout(Duration::from_millis(200), bus.close()).await;
        }
        Ok(interrupted.is_some())
    }

    /// Reports state changes of agents from before the launcher joined the bus.
    async fn report_earlier_changes(&self, bus: &mut LauncherBus) {
        for agent in &self.crew.agents {
            let state = match agent.ending() {
                Some(_) => ProcessState::Ended,
                None if agent.is_stopped() => ProcessState::Stopped,
                None => continue,
            };
            bus.report_state(agent.name(), agent.pid(), state).await;
        }
    }

    /// Returns a process whose end prevents the start of the run: a host, a failed agent, or any agent if all have ended. An agent that was
    /// ended by a signal is only a dead robot.
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

    /// Joins the bus. Without it the run continues, but without progress display and process faults.
    async fn observe(
        &self,
        views: watch::Sender<Option<View>>,
        news: Arc<Mutex<RunNews>>,
    ) -> Option<LauncherBus> {
        match LauncherBus::join(&self.crew.run, views, news).await {
            Ok(bus) => Some(bus),
            Err(error) => {
                // A short run can end before the launcher has joined.
                if Rendezvous::find(Some(&self.crew.run)).is_ok() {
                    self.progress
                        .print_line(&format!("the launcher cannot observe the run: {error:#}"));
                }
                None
            }
        }
    }

    /// Checks every process, and reports changes to the world and on the terminal.
    async fn poll(&mut self, bus: Option<&mut LauncherBus>) -> anyhow::Result<()> {
        while let Some(change) = self.world.poll()? {
            match change {
                ProcessChange::Stopped => {
                    let pid = self.world.pid();
                    let remedy = format!("`kill -CONT {pid}` resumes it, Ctrl-C ends the run");
                    self.progress.print_line(&format!(
                        "the world (process {pid}) is stopped, and the run stands still; {remedy}"
                    ));
                }
                ProcessChange::Continued => self.progress.print_line("the world resumes"),
                ProcessChange::Ended(_) => {}
            }
        }
        let over = self.world.ending().is_some();
        let progress = &self.progress;
        let say = |line: &str| progress.print_line(line);
        if let Some(page) = &mut self.page
            && poll_observer(page, "the page", over, &say)?
        {
            self.page = None;
        }
        if let Some(bridge) = &mut self.bridge {
            bridge.poll(&say)?;
        }
        let mut failed = Vec::new();
        for (index, (process, title)) in self.observers.iter_mut().enumerate() {
            if poll_observer(process, &format!("the process for {title}"), over, &say)? {
                failed.push(index);
            }
        }
        for index in failed.into_iter().rev() {
            self.observers.remove(index);
        }
        for (host, _) in &mut self.hosts {
            while let Some(change) = host.poll()? {
                if let (ProcessChange::Ended(ending), false) = (change, over) {
                    let lines = format!(
                        "{} {}\n{}",
                        host.name(),
                        ending.describe(),
                        host.last_log_lines()
                    );
                    say(lines.trim_end());
                }
            }
        }
        self.crew.poll(bus, &say, over).await
    }

    /// Requests the end of the run from the world; a second request kills the world. Some programs send a signal to both a process
    /// and its group, so a repetition within [`MIN_SIGNAL_INTERVAL`] is ignored.
    fn interrupt(&self, before: Option<Instant>) -> Option<Instant> {
        match before {
            None => {
                self.progress
                    .print_line("ending the run (repeat to end it at once)");
                self.release_page();
                self.world.signal(Signal::SIGTERM);
                Some(Instant::now())
            }
            Some(first) => {
                if first.elapsed() > MIN_SIGNAL_INTERVAL {
                    self.world.signal(Signal::SIGKILL);
                }
                before
            }
        }
    }

    /// Kills a world that has not ended in time after a request. A stopped world has less time, because it cannot handle the signal.
    fn kill_if_overdue(&self, interrupted: Option<Instant>) {
        let patience = if self.world.is_stopped() {
            GRACE
        } else {
            ENDING
        };
        if self.world.ending().is_none()
            && interrupted.is_some_and(|since| since.elapsed() > patience)
        {
            self.progress.print_line(
                "the world does not end and is killed; the log is complete up to its last tick",
            );
            self.world.signal(Signal::SIGKILL);
        }
    }

    /// Ends all processes. Observers end last: the page still sends the result to open browsers, and the others their
    /// last messages.
    async fn end_all(&mut self) {
        // A world that ended abnormally sent the agents no end of the run.
        let patience = match self.world.ending() {
            None | Some(Ending::Exit(0 | 1)) => GRACE,
            Some(_) => Duration::ZERO,
        };
        let team = std::iter::once(&mut self.world)
            .chain(self.crew.all())
            .collect();
        let say = |line: &str| self.progress.print_line(line);
        end_processes(team, patience, &say).await;
        // The end of the world closes the socket of the bridge, which then stops the bodies.
        // If it was killed, a second process does so.
        for _ in 0..2 {
            if let Some(bridge) = &mut self.bridge
                && let Some(process) = bridge.live_process()
            {
                end_processes(vec![process], GRACE, &say).await;
                if let Err(error) = bridge.poll(&say) {
                    say(&format!("the bridge to the other world: {error:#}"));
                }
            }
        }
        let mut hosts = Vec::new();
        for (host, hold) in self.hosts.drain(..) {
            drop(hold);
            hosts.push(host);
        }
        end_processes(hosts.iter_mut().collect(), HOSTS, &say).await;
        let observers = self.observers.iter_mut().map(|(process, _)| process);
        end_processes(
            self.page.iter_mut().chain(observers).collect(),
            END_OF_RUN_TIMEOUT + GRACE,
            &say,
        )
        .await;
        for (process, title) in &self.observers {
            if let Some(Ending::Exit(1..)) = process.ending() {
                say(&format!("the run was not published to {title} to its end:"));
                say(process.last_log_lines().trim_end());
            }
        }
    }

    fn check_world(&self) -> anyhow::Result<()> {
        match self.world.ending() {
            Some(Ending::Exit(0 | 1)) => Ok(()),
            ending => {
                let log = if self.crew.logs.with_file_name("run.json").exists() {
                    "its log is complete up to its last tick"
                } else {
                    "it has no log"
                };
                bail!(
                    "the world {}; {log}; {}",
                    ending.map_or_else(|| "does not end".to_owned(), Ending::describe),
                    self.world.failure_output()
                )
            }
        }
    }
}

/// Creates an anonymous file in memory with this content.
fn in_memory(text: &str) -> io::Result<File> {
    let mut file = File::from(memfd_create(c"alliance-keys", MFdFlags::MFD_CLOEXEC)?);
    file.write_all(text.as_bytes())?;
    file.rewind()?;
    Ok(file)
}

/// Waits for the next order or event; without a bus it never returns.
async fn next_call(bus: Option<&mut LauncherBus>) -> BusMessage {
    match bus {
        Some(bus) => bus.call().await,
        None => std::future::pending().await,
    }
}

fn read_run(folder: &Path) -> anyhow::Result<RunFile> {
    let path = folder.join("run.json");
    let at = || path.display().to_string();
    let text = std::fs::read(&path).with_context(at)?;
    let vocabulary = Registry::current().vocabulary();
    RunFile::parse(&text, &vocabulary)
        .map_err(Error::msg)
        .with_context(at)
}
