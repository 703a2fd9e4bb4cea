//! The command line of `alliance run`.

use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZeroUsize;
use std::process::ExitCode;

use analysis::allocation::{self, DEFAULT_ROUNDS, allocate};
use analysis::branch::{BranchArgs, BranchPlan};
use analysis::check::contradictions_before_run;
use analysis::export::{export_mcap, mcap_is_there};
use analysis::learned;
use analysis::sweep::{jobs, jobs_or_cores};
use anyhow::{Context, bail};
use clap::Args;
use missions::Registry;
use run_log::RunLog;
use scenario::{Problem, Setup};
use terminal::{fail, stderr_line};
use world_server::args::{OUTPUT, RunArgs, random_run_id, run_id_for};
use world_server::mission_args::MissionArgs;

use super::controllers::{self, ControllerCommand};
use super::disk;
use super::one_process;
use super::plan::{BranchStart, RunPlan};
use super::supervise::supervise;
use crate::foxglove::FoxgloveArgs;
use crate::limits;
use crate::page::link::{LinkArgs, PageLink};
use crate::page::view::show_log;
use crate::ros::RosArgs;
use crate::ros::bodies::BridgeRefusal;
use cluster::process_log::{log_to_stderr, set_run};
use cluster::start::StartPlan;

/// Run a mission with one process per robot
#[derive(Args, Clone, Debug)]
pub struct RunCommand {
    #[command(flatten)]
    mission: MissionArgs,
    #[command(flatten)]
    run: RunArgs,
    #[command(flatten)]
    branch: BranchArgs,
    /// Shell command of the external controller NAME; repeatable
    #[arg(long = "controller", value_name = "NAME[@VERSION]=COMMAND", value_parser = ControllerCommand::parse, help_heading = "Execution")]
    controllers: Vec<ControllerCommand>,
    /// Run everything in this process: the same log, but no page and no pace
    #[arg(long, help_heading = "Execution", conflicts_with_all = ["open", "port", "paused", "speed", "stall_after", "metrics", "ros", "external", "foxglove", "foxglove_control"])]
    in_process: bool,
    /// Number of threads with --in-process [default: all cores, fewer for a small team]
    #[arg(long, value_name = "N", value_parser = jobs, requires = "in_process", help_heading = "Execution")]
    jobs: Option<NonZeroUsize>,
    /// Check invariants after every tick, then replay the run and compare
    #[arg(long, requires = "in_process", help_heading = "Execution")]
    check: bool,
    /// Allocate without motion: at most this many communication rounds, in this process; no log
    #[arg(
        long,
        value_name = "ROUNDS",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = DEFAULT_ROUNDS,
        value_parser = clap::value_parser!(u64).range(1..=1_000_000),
        help_heading = "Execution",
        conflicts_with_all = ["open", "port", "paused", "speed", "stall_after", "check", "mcap", "ros", "external", "foxglove", "foxglove_control", "out", "log", "from", "at", "controllers"],
    )]
    allocate_only: Option<u64>,
    #[command(flatten)]
    page: LinkArgs,
    #[command(flatten)]
    ros: RosArgs,
    #[command(flatten)]
    foxglove: FoxgloveArgs,
    /// Do not serve a page
    #[arg(long, help_heading = "Page", conflicts_with_all = ["open", "port"])]
    no_page: bool,
    /// Write run.mcap for Foxglove and PlotJuggler to the folder at the end
    #[arg(long, help_heading = OUTPUT, hide = !cfg!(feature = "mcap"))]
    mcap: bool,
    /// Print the result as JSON on stdout
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
    #[arg(skip)]
    over: Option<RemoteSettings>,
}

/// The additional settings of a run over several machines.
#[derive(Clone, Debug)]
pub struct RemoteSettings {
    pub arguments: Vec<String>,
    /// The names of the robots on other hosts.
    pub remote_robots: BTreeSet<String>,
    /// The hosts that the launcher starts, and the keys of this run.
    pub start: Option<StartPlan>,
}

impl RunCommand {
    /// Runs the mission and prints its result.
    ///
    /// Exit status 0 if the mission is complete, 1 if it is incomplete or an invariant is violated, 2 for a mistake in
    /// scenario, parameters or arguments, 3 if a process, the bus or the export failed.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        if let Some(rounds) = self.allocate_only {
            return self.allocate(rounds);
        }
        // All inputs are read and checked before the first process starts.
        let prepared = self.setup().and_then(|(setup, branch)| {
            if self.over.is_some() && self.in_process {
                bail!("--in-process: a run over several machines needs several processes; leave it out");
            }
            if self.over.is_some() && self.ros.has_external_bodies() {
                let what = "the bodies of a run over several machines move in its world";
                bail!(Problem::with_source("--external", what, "use `alliance run`"));
            }
            if !self.in_process {
                limits::check_run_limits(setup.scenario.robots.len())?;
            }
            // The answers of external controllers are in the log that a branch repeats.
            let controllers = match &branch {
                Some(branch) if branch.needs_one_process() => BTreeMap::new(),
                _ => controllers::commands(&setup.scenario, &self.controllers)?,
            };
            if self.in_process && let Some((robot, _)) = controllers.first_key_value() {
                bail!(
                    "--in-process: the controller of {robot} is an external program; leave --in-process out"
                );
            }
            if let Some(profile) = &self.mission.profile {
                learned::check_writable(profile).context("--profile")?;
            }
            if self.mcap {
                mcap_is_there()?;
            }
            let branch = branch.map(|plan| self.start_of(plan)).transpose()?;
            let log = branch.as_ref().map(|branch| branch.plan.log());
            let log = log.unwrap_or_else(|| self.run.log(&setup));
            self.ros.check(&setup, log)?;
            let bodies = self.ros.bridge(&setup, self.run.stall_after)?;
            // The listeners are open until all addresses are checked, so that no two options have the same one.
            let foxglove = self.foxglove.check(&setup, log)?;
            let metrics = self.run.check_metrics()?;
            let link = self.link()?;
            drop((foxglove, metrics));
            let folder = self.run.folder(&setup)?;
            Ok((folder, setup, branch, controllers, link, bodies))
        });
        let (folder, setup, branch, controllers, link, bodies) = match prepared {
            Ok(prepared) => prepared,
            Err(error) => {
                return fail(self.name(), &error, 2);
            }
        };
        // The socket outlives the run, so that an open page can show the log afterwards.
        let stay = link.as_ref().filter(|_| self.page.open);
        let stay = match stay.map(PageLink::try_clone).transpose() {
            Ok(stay) => stay,
            Err(error) => {
                return fail(self.name(), &error, 3);
            }
        };
        let drawn = self.over.as_ref().map(|_| random_run_id(&setup));
        let run = match drawn.transpose() {
            Ok(drawn) => drawn.unwrap_or_else(|| run_id_for(&setup)),
            Err(error) => {
                return fail(self.name(), &error, 3);
            }
        };
        set_run(&run);
        let over = self.over.as_ref();
        let ros = self.ros.observer(folder.clone(), &run);
        let foxglove = self.foxglove.observer(folder.clone(), &run);
        let plan = RunPlan {
            observers: ros.into_iter().chain(foxglove).collect(),
            bodies,
            run,
            world_arguments: match &branch {
                Some(branch) => self.execution_arguments(&branch.arguments),
                None => self.world_arguments(),
            },
            branch,
            setup,
            controllers,
            elsewhere: over.map_or_else(BTreeSet::new, |over| over.remote_robots.clone()),
            start: over.and_then(|over| over.start.clone()),
            folder,
            paused: self.is_paused(),
            open: self.page.open,
            json: self.json,
            log: self.run.log,
        };
        let carried_out = self.carry_out(&plan, link).and_then(|status| {
            if let Some(link) = stay {
                show_log(link, &plan.folder)?;
            }
            Ok(status)
        });
        match carried_out {
            Ok(status) => ExitCode::from(status),
            Err(error) => {
                let is_refused = error.is::<BridgeRefusal>();
                fail(self.name(), &error, if is_refused { 2 } else { 3 })
            }
        }
    }

    /// Prints the allocation of a team that does not move. Exit status 0 if it is stable, and 1 otherwise.
    fn allocate(&self, rounds: u64) -> ExitCode {
        if self.over.is_some() {
            let what = "the rounds run in one process";
            let problem = Problem::with_source("--allocate-only", what, "use `alliance run`");
            return fail(self.name(), &problem, 2);
        }
        let setup = match self.mission.setup(&crate::program_content()) {
            Ok(setup) => setup,
            Err(error) => return fail(self.name(), &error, 2),
        };
        let allocation = match allocate(&setup, rounds) {
            Ok(allocation) => allocation,
            Err(error) => return fail(self.name(), &error, 3),
        };
        let text = match self.json {
            true => format!("{:#}\n", allocation::json(&setup, &allocation)),
            false => allocation::text(&setup, &allocation),
        };
        let status = ExitCode::from(u8::from(!allocation.is_stable));
        terminal::print_result(self.name(), text, status)
    }

    /// Starts the log of this process.
    pub fn start_log(&self) {
        log_to_stderr(self.run.log_args, "launcher");
    }

    /// Returns the checked setup: that of the arguments, or of the run that a branch repeats.
    fn setup(&self) -> anyhow::Result<(Setup, Option<BranchPlan>)> {
        if self.branch.from.is_some() {
            self.refuse_other_mission()?;
        }
        let Some(plan) = self.branch.plan(self.run.log)? else {
            let setup = self.mission.setup(&crate::program_content())?;
            return Ok((setup, None));
        };
        if plan.needs_one_process() && !self.in_process {
            let what = "the run has external controllers, whose answers are in its log";
            bail!(Problem::with_source("--from", what, "add --in-process"));
        }
        Ok((plan.setup().clone(), Some(plan)))
    }

    /// Rejects the options that a branch takes from its run, with the reason.
    fn refuse_other_mission(&self) -> Result<(), Problem> {
        let MissionArgs {
            size,
            params,
            profile,
            step_order,
            allocator,
            limit,
            ..
        } = &self.mission;
        let whole = "it is the same for a whole run";
        let refused = [
            (
                self.over.is_some(),
                "--from",
                "a branch runs on one machine",
                "use `alliance run`",
            ),
            (
                allocator.is_some(),
                "--allocator",
                "one allocator cannot continue with the state of another",
                "leave it out, or start the mission anew",
            ),
            (step_order.is_some(), "--step-order", whole, "leave it out"),
            (limit.is_some(), "--limit", whole, "leave it out"),
            (
                profile.is_some(),
                "--profile",
                "the robots have learned other times since the start",
                "leave it out",
            ),
            (
                params.is_some(),
                "--params",
                "its values are those of a start",
                "use --set for values from --at on",
            ),
            (
                !size.arguments().is_empty(),
                "--from",
                "the size of the mission is that of the run",
                "leave the size out",
            ),
        ];
        match refused.into_iter().find(|(is_given, ..)| *is_given) {
            Some((_, option, what, remedy)) => Err(Problem::with_source(option, what, remedy)),
            None => Ok(()),
        }
    }

    /// Repeats the run once to check that the branch can start.
    fn start_of(&self, plan: BranchPlan) -> anyhow::Result<BranchStart> {
        let hand_over = plan.rehearse()?;
        let request = plan.request().to_json().context("--from")?;
        Ok(BranchStart {
            plan,
            hand_over,
            arguments: vec![format!("--branch={request}")],
        })
    }

    /// Returns `true` if the arguments contain a scenario, a size or a seed.
    #[must_use]
    pub fn selects_scenario(&self) -> bool {
        let MissionArgs {
            scenario,
            size,
            seed,
            ..
        } = &self.mission;
        scenario.is_some() || !size.arguments().is_empty() || *seed != 1
    }

    /// Returns the command for the same run over several machines.
    #[must_use]
    pub fn over(mut self, over: RemoteSettings, scenario: String, seed: Option<u64>) -> Self {
        self.mission.scenario = Some(scenario);
        self.mission.seed = seed.unwrap_or(self.mission.seed);
        self.over = Some(over);
        self
    }

    /// Returns the command for error messages: this or `alliance cluster up`.
    fn name(&self) -> &'static str {
        match self.over {
            Some(_) => "alliance cluster up",
            None => "alliance run",
        }
    }

    /// Runs the mission, then writes the profile and the export if requested. Returns the exit status.
    fn carry_out(&self, plan: &RunPlan, link: Option<PageLink>) -> anyhow::Result<u8> {
        let log = plan.branch.as_ref().map(|branch| branch.plan.log());
        let log = log.unwrap_or_else(|| self.run.log(&plan.setup));
        if let Some(note) = disk::note(&plan.setup, log, &plan.folder) {
            stderr_line!("{note}");
        }
        for contradiction in contradictions_before_run(&plan.setup)? {
            stderr_line!("note: {contradiction}");
        }
        let status = if self.in_process {
            one_process::run(plan, log, self.check, jobs_or_cores(self.jobs))?
        } else {
            supervise(plan, link)?
        };
        if let Some(profile) = &self.mission.profile {
            let vocabulary = Registry::current().vocabulary();
            let logged = RunLog::open(&plan.folder, &vocabulary)?;
            learned::write_profile(profile, &logged).context("--profile")?;
        }
        if self.mcap {
            export_mcap(&plan.folder).context("--mcap")?;
        }
        Ok(status)
    }

    /// Opens the socket of the page; `None` for a run without a page.
    fn link(&self) -> anyhow::Result<Option<PageLink>> {
        if self.no_page || self.in_process {
            return Ok(None);
        }
        PageLink::new(self.page.port).map(Some)
    }

    /// Returns `true` if the run starts paused. With `--open` it does, so that the page shows the run from its start.
    fn is_paused(&self) -> bool {
        self.run.paused || self.page.open
    }

    /// Returns the arguments of the world process, without folder and run id.
    fn world_arguments(&self) -> Vec<String> {
        let mission = &self.mission;
        let mut arguments: Vec<String> = mission.scenario.iter().cloned().collect();
        arguments.extend(mission.size.arguments());
        let mut push = |name: &str, value: String| arguments.push(format!("--{name}={value}"));
        push("seed", mission.seed.to_string());
        if let Some(log) = self.run.log {
            push("log", log.as_str().to_owned());
        }
        if let Some(params) = &mission.params {
            push("params", params.display().to_string());
        }
        if let Some(profile) = &mission.profile {
            push("profile", profile.display().to_string());
        }
        if let Some(order) = mission.step_order {
            push("step-order", order.as_str().to_owned());
        }
        if let Some(name) = &mission.allocator {
            push("allocator", name.clone());
        }
        if let Some(limit) = mission.limit {
            push("limit", limit.to_string());
        }
        for controller in &self.controllers {
            if let Some(version) = &controller.version {
                push(
                    "controller-version",
                    format!("{}={version}", controller.name),
                );
            }
        }
        let over = self.over.iter().flat_map(|over| &over.arguments);
        arguments.extend(over.cloned());
        self.execution_arguments(&arguments)
    }

    /// Returns the arguments for the execution of a run after those of its mission.
    fn execution_arguments(&self, mission: &[String]) -> Vec<String> {
        let mut arguments = mission.to_vec();
        if self.is_paused() {
            arguments.push("--paused".to_owned());
        }
        let is_watched = self.is_paused() || self.ros.is_on() || self.foxglove.is_on();
        let has_external_bodies = self.ros.has_external_bodies();
        if has_external_bodies {
            arguments.push("--external-bodies".to_owned());
        }
        arguments.push(format!(
            "--speed={}",
            self.run.pace(is_watched || has_external_bodies)
        ));
        arguments.push(format!("--stall-after={}", self.run.stall_after));
        if let Some(address) = self.run.metrics {
            arguments.push(format!("--metrics={address}"));
        }
        arguments
    }
}
