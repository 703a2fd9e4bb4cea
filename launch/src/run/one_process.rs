//! `alliance run --in-process`: world and agents in one process without sockets, with the same log as a run by processes.

use missions::Registry;
use std::num::NonZeroUsize;
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use analysis::interrupted::InterruptFlag;
use analysis::invariants::{Invariants, replayed};
use in_process::{BackgroundTeam, Team, threads_for};
use proto::event::TickEvents;
use proto::program_build;
use proto::tick::Outcome;
use run_log::recorder::{Folder, Sink};
use run_log::{LogLevel, RunLog};
use scenario::time::SimTime;
use serde_json::json;
use terminal::panics;
use terminal::stderr_line;
use tokio::time::Instant;
use world_server::barrier::Presence;
use world_server::invocation;
use world_server::latest::link_latest;

use super::news::RunNews;
use super::plan::RunPlan;
use super::progress::ProgressDisplay;
use super::summary;

/// The interval between updates of the progress display.
const INTERVAL: Duration = Duration::from_millis(200);

/// The number of steps of robots between two readings of the clock, which costs as much as some of them.
const STEPS_PER_CLOCK_READING: u64 = 200;

/// Runs the mission on at most `jobs` threads to its end or to the first violated invariant. Returns the exit status.
pub fn run(plan: &RunPlan, log: LogLevel, check: bool, jobs: NonZeroUsize) -> anyhow::Result<u8> {
    panics::set_process_name(format!(
        "alliance run (mission {}, allocator {})",
        plan.setup.catalog.mission.name(),
        plan.setup.scenario.allocator_list(),
    ));
    let interrupted = InterruptFlag::install()?;
    let mut progress = ProgressDisplay::new(&plan.setup);
    progress.print_line(&format!("run {}, in one process", plan.run));
    let folder = Folder::create(&plan.folder)?;
    // The link `runs/latest` is optional, so a failure is ignored.
    let _ = link_latest(Path::new("runs"), &plan.folder);
    let (began, wall) = (Instant::now(), unix_ms());
    let mut shown = began;
    let mut invariants = check.then(|| Invariants::new(&plan.setup));
    let mut violation = None;
    let mut team = match &plan.branch {
        None => Team::new(plan.setup.clone(), log, folder)?,
        Some(branch) => {
            let team = branch.plan.team(log, folder)?;
            branch
                .plan
                .repeat(team, branch.plan.origin().tick, |team| {
                    if let Some(invariants) = &mut invariants
                        && violation.is_none()
                    {
                        violation = invariants.check_simulation(team.simulation()).err();
                    }
                    Ok(())
                })?
        }
    };
    let threads = threads_for(plan.setup.scenario.robots.len(), jobs.get());
    team.use_threads(threads)?;
    let mut team = team.into_background(jobs.get() > 1)?;
    let mut violation = violation.map(anyhow::Error::from);
    let mut news = RunNews::new(&plan.setup);
    let robots = plan.setup.scenario.robots.len() as u64;
    let ticks_per_reading = (STEPS_PER_CLOCK_READING / robots.max(1)).max(1);
    let outcome = loop {
        let outcome = team.tick()?;
        for line in news_of(&mut team, &mut news) {
            progress.print_line(&line);
        }
        if let Some(invariants) = &mut invariants
            && let Err(found) = invariants.check_simulation(team.simulation())
        {
            violation = Some(anyhow::Error::from(found));
            break outcome.unwrap_or(Outcome::Interrupted);
        }
        if let Some(outcome) = outcome {
            break outcome;
        }
        if interrupted.is_set() {
            break Outcome::Interrupted;
        }
        let is_due = team.simulation().tick().is_multiple_of(ticks_per_reading);
        if is_due && shown.elapsed() >= INTERVAL {
            shown = Instant::now();
            progress.show(&team.view());
        }
    };
    for line in news.see(&team.view()).into_iter().chain(news.finish()) {
        progress.print_line(&line);
    }
    let running_s = began.elapsed().as_secs_f64();
    let ticks = team.simulation().tick();
    let (run, mut recorder) = team.end(outcome)?;
    recorder.write_host(&json!({
        "run": plan.run,
        "build": program_build::get(),
        "command": invocation::command(),
        "in_process": true,
        "started_unix_ms": wall,
        "ended_unix_ms": unix_ms(),
        "running_s": running_s,
        "ticks_per_s": (running_s > 0.0).then(|| ticks as f64 / running_s),
        "pids": {"world": std::process::id()},
    }))?;
    progress.clear();
    summary::show(plan, &run)?;
    if check && violation.is_none() {
        violation = replayed::check(&RunLog::open(
            &plan.folder,
            &Registry::current().vocabulary(),
        )?)
        .err();
    }
    if let Some(violation) = &violation {
        stderr_line!("violated: {violation:#}");
    }
    Ok(match violation {
        Some(_) => 1,
        None => summary::exit_status(run.outcome),
    })
}

/// Returns the lines about the last tick.
fn news_of<S: Sink + Send + 'static>(
    team: &mut BackgroundTeam<S>,
    news: &mut RunNews,
) -> Vec<String> {
    let events = team.take_events();
    let simulation = team.simulation();
    let tick = simulation.tick();
    let now = SimTime(tick * simulation.setup().scenario.step_ms);
    let mut lines = news.add(&TickEvents {
        tick: tick.saturating_sub(1),
        events,
    });
    lines.extend(if news.needs_view(now) {
        news.see(&team.view())
    } else {
        let barrier = simulation.barrier();
        let active = barrier.robots().map(|robot| {
            let is_present = barrier.presence(robot) == Presence::Present;
            simulation.active(robot).filter(|_| is_present)
        });
        news.set_active(active);
        news.takeovers_until(now, &[])
    });
    lines
}

/// Returns the wall-clock time for host.json. The simulation does not use it.
#[allow(clippy::disallowed_methods)]
fn unix_ms() -> u64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_millis() as u64)
}
