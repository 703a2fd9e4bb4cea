//! Command line of `alliance run`.

use std::collections::BTreeSet;
use std::process::ExitCode;

use alliance_proto::log::RunLog;
use alliance_proto::tell;
use anyhow::{Context, bail};
use clap::Args;
use missions::Registry;
use study::export::{export_mcap, mcap_is_there};
use study::learned;
use world_server::args::{MissionArgs, RunArgs, drawn_run_id, run_id_for};

use super::minds::{self, MindCommand};
use super::one_process;
use super::plan::Plan;
use super::supervise::supervise;
use crate::cluster::start::Start;
use crate::limits;
use crate::page::link::{Link, LinkArgs};
use crate::page::view::stay_with_log;

/// Run a mission: one world and one process per robot.
#[derive(Args, Clone, Debug)]
pub struct RunCommand {
    #[command(flatten)]
    mission: MissionArgs,
    #[command(flatten)]
    run: RunArgs,
    /// How the mind of that name is started, a program of its own, by a command line for a shell; once for each that the scenario names
    #[arg(long = "mind", value_name = "NAME[@VERSION]=COMMAND", value_parser = MindCommand::parse)]
    minds: Vec<MindCommand>,
    /// All robots and the world in this process: no page, no signals to robots, no pace, and the same bytes
    #[arg(long, conflicts_with_all = ["open", "port", "paused", "speed", "stall_after"])]
    in_process: bool,
    /// Look after each tick at what must always hold, and run it again from its inputs
    #[arg(long, requires = "in_process")]
    check: bool,
    #[command(flatten)]
    page: LinkArgs,
    /// Serve no page
    #[arg(long, conflicts_with_all = ["open", "port"])]
    no_page: bool,
    /// At the end, write run.mcap into the run's folder, for Foxglove, Lichtblick and PlotJuggler
    #[arg(long)]
    mcap: bool,
    /// Print the result as JSON on stdout
    #[arg(long)]
    json: bool,
    #[arg(skip)]
    over: Option<Over>,
}

/// What a run over several machines has besides.
#[derive(Clone, Debug)]
pub struct Over {
    /// For the world.
    pub arguments: Vec<String>,
    /// The robots of other hosts.
    pub elsewhere: BTreeSet<String>,
    /// Hosts that are started too, and the keys of this run.
    pub start: Option<Start>,
}

impl RunCommand {
    /// Runs the mission and shows how it went.
    ///
    /// Exit status 0 when the mission is complete, 1 when it ran but is not, or something did not hold, 2 for a mistake in
    /// scenario, parameters or arguments, 3 when a process, the bus or the export failed.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        // Everything is read and checked here, before the first process starts.
        let prepared = self.mission.setup(&crate::known()).and_then(|setup| {
            if self.over.is_some() && self.in_process {
                bail!("--in-process: all processes in one are on one machine; leave it out");
            }
            if !self.in_process {
                limits::allow_a_run(setup.scenario.robots.len())?;
            }
            let minds = minds::commands(&setup.scenario, &self.minds)?;
            if self.in_process && let Some((robot, _)) = minds.first_key_value() {
                bail!(
                    "--in-process: the mind of {robot} is a program of its own; leave --in-process out"
                );
            }
            if let Some(profile) = &self.mission.profile {
                learned::check_place(profile).context("--profile")?;
            }
            if self.mcap {
                mcap_is_there()?;
            }
            let link = self.link()?;
            Ok((self.run.folder(&setup)?, setup, minds, link))
        });
        let (folder, setup, minds, link) = match prepared {
            Ok(prepared) => prepared,
            Err(error) => {
                tell!("alliance run: {error:#}");
                return ExitCode::from(2);
            }
        };
        // The socket outlives the run: whoever looks at its page goes on to look at its log.
        let stay = link.as_ref().filter(|_| self.page.open);
        let stay = match stay.map(Link::try_clone).transpose() {
            Ok(stay) => stay,
            Err(error) => {
                tell!("alliance run: {error:#}");
                return ExitCode::from(3);
            }
        };
        let drawn = self.over.as_ref().map(|_| drawn_run_id(&setup));
        let run = match drawn.transpose() {
            Ok(drawn) => drawn.unwrap_or_else(|| run_id_for(&setup)),
            Err(error) => {
                tell!("alliance run: {error:#}");
                return ExitCode::from(3);
            }
        };
        let over = self.over.as_ref();
        let plan = Plan {
            run,
            world_arguments: self.world_arguments(),
            setup,
            minds,
            elsewhere: over.map_or_else(BTreeSet::new, |over| over.elsewhere.clone()),
            start: over.and_then(|over| over.start.clone()),
            folder,
            paused: self.is_paused(),
            open: self.page.open,
            json: self.json,
        };
        let carried_out = self.carry_out(&plan, link).and_then(|complete| {
            if let Some(link) = stay {
                stay_with_log(link, &plan.folder)?;
            }
            Ok(complete)
        });
        match carried_out {
            Ok(true) => ExitCode::SUCCESS,
            Ok(false) => ExitCode::from(1),
            Err(error) => {
                tell!("alliance run: {error:#}");
                ExitCode::from(3)
            }
        }
    }

    /// Whether it says what is run.
    #[must_use]
    pub fn is_of_a_scenario(&self) -> bool {
        let MissionArgs {
            scenario,
            size,
            seed,
            ..
        } = &self.mission;
        scenario.is_some() || !size.arguments().is_empty() || *seed != 1
    }

    /// The same over several machines.
    #[must_use]
    pub fn over(mut self, over: Over, scenario: String, seed: Option<u64>) -> Self {
        self.mission.scenario = Some(scenario);
        self.mission.seed = seed.unwrap_or(self.mission.seed);
        self.over = Some(over);
        self
    }

    /// Runs it, and writes the profile and exports it if that is wanted; whether the mission is complete.
    fn carry_out(&self, plan: &Plan, link: Option<Link>) -> anyhow::Result<bool> {
        let complete = if self.in_process {
            one_process::run(plan, self.run.log(&plan.setup), self.check)?
        } else {
            supervise(plan, link)?
        };
        if let Some(profile) = &self.mission.profile {
            let vocabulary = Registry::of_this_program().vocabulary();
            let logged = RunLog::open(&plan.folder, &vocabulary)?;
            learned::write_profile(profile, &logged).context("--profile")?;
        }
        if self.mcap {
            export_mcap(&plan.folder).context("--mcap")?;
        }
        Ok(complete)
    }

    /// Where the page is to be found.
    fn link(&self) -> anyhow::Result<Option<Link>> {
        if self.no_page || self.in_process {
            return Ok(None);
        }
        Link::new(self.page.port).map(Some)
    }

    /// Whether the clock is held at first: who opens a page wants to see the run from its beginning.
    fn is_paused(&self) -> bool {
        self.run.paused || self.page.open
    }

    /// What the world is started with, beside its folder and the run's id.
    fn world_arguments(&self) -> Vec<String> {
        let mission = &self.mission;
        let mut arguments: Vec<String> = mission.scenario.iter().cloned().collect();
        arguments.extend(mission.size.arguments());
        if self.is_paused() {
            arguments.push("--paused".to_owned());
        }
        let mut push = |name: &str, value: String| arguments.push(format!("--{name}={value}"));
        push("seed", mission.seed.to_string());
        push("speed", self.run.pace(self.is_paused()).to_string());
        if let Some(log) = self.run.log {
            push("log", log.as_str().to_owned());
        }
        push("stall-after", self.run.stall_after.to_string());
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
        for mind in &self.minds {
            if let Some(version) = &mind.version {
                push("mind-version", format!("{}={version}", mind.name));
            }
        }
        let over = self.over.iter().flat_map(|over| &over.arguments);
        arguments.extend(over.cloned());
        arguments
    }
}
