//! The verdict of a run in three sentences, made from its metrics.

use observation::stints::Loss;
use proto::tick::Outcome;
use run_log::{RunFile, RunOutcome};
use scenario::mission::columns::short_summary;
use scenario::time::SimTime;

use super::failures::{Failure, OrphanOutcome};
use super::history::History;
use super::metrics::Metrics;

/// Returns the outcome, the losses with their takeovers, and the longest wait, one sentence each. The wait is absent if
/// the log does not contain it.
#[must_use]
pub fn verdict(run: &RunFile, history: &History, metrics: &Metrics) -> Vec<String> {
    let first = [outcome(run, history), losses(history, metrics)];
    first.into_iter().chain(wait(history, metrics)).collect()
}

fn outcome(run: &RunFile, history: &History) -> String {
    let progress = match history.latest().as_slice() {
        [] => String::new(),
        row => format!(": {}", short_summary(row)),
    };
    let end = seconds(history.end);
    match run.outcome {
        RunOutcome::Ended(Outcome::Complete) => {
            format!("The mission was complete after {end}{progress}.")
        }
        RunOutcome::Ended(outcome) => format!(
            "The mission was not complete after {end} ({}){progress}.",
            outcome.as_str()
        ),
        RunOutcome::Running => format!("The run did not end; its log ends at {end}{progress}."),
    }
}

fn losses(history: &History, metrics: &Metrics) -> String {
    let name = |rank: usize| history.robots[rank].name.as_str();
    let lost_a_task = |failure: &Failure| failure.orphan.is_some();
    match metrics.failures.as_slice() {
        [] => "No robot was lost.".to_owned(),
        [only] => {
            let how = match only.loss {
                Loss::Died => "died",
                Loss::Stopped => "was stopped",
            };
            let lost = format!("{} {how} at {}", name(only.robot), seconds(only.at));
            let Some(orphan) = &only.orphan else {
                return format!("{lost} without a task.");
            };
            let task = history.catalog.task_name(orphan.task);
            let after = |at: SimTime| seconds(at.since(only.at));
            let next = match orphan.aftermath {
                OrphanOutcome::Covered { by } => format!("{} was at it, too", name(by)),
                OrphanOutcome::TakenOver { at, by } => {
                    format!("{} took over after {}", name(by), after(at))
                }
                OrphanOutcome::Continued { at, by } => {
                    format!("{} executed it next, after {}", name(by), after(at))
                }
                OrphanOutcome::Resumed { at } => {
                    format!("it resumed the task itself after {}", after(at))
                }
                OrphanOutcome::Abandoned => "no robot took over".to_owned(),
            };
            format!("{lost} while it executed {task}; {next}.")
        }
        all => {
            let at_work = all.iter().filter(|failure| lost_a_task(failure)).count();
            let latencies = metrics.takeovers.iter();
            let latencies = latencies.filter(|takeover| takeover.cause.is_loss());
            let latencies: Vec<SimTime> = latencies.map(|takeover| takeover.latency()).collect();
            let longest = latencies.iter().max();
            let taken = match (latencies.len(), longest.map(|longest| seconds(*longest))) {
                (_, None) => "no task was taken over".to_owned(),
                (1, Some(only)) => format!("1 task was taken over, after {only}"),
                (count, Some(longest)) => {
                    format!("{count} tasks were taken over, the last to wait after {longest}")
                }
            };
            format!(
                "{} losses of robots, {at_work} of them at a task; {taken}.",
                all.len()
            )
        }
    }
}

/// Returns the latest recurring event, or else the task that was without a productive robot for the longest time.
fn wait(history: &History, metrics: &Metrics) -> Option<String> {
    let late = metrics.recurring.iter().flat_map(|recurring| {
        let moments = recurring.moments.iter();
        moments.map(|moment| (recurring.event, moment.late, moment.at))
    });
    let latest = late.max_by_key(|(_, late, _)| *late);
    if let Some((event, late, at)) = latest
        && late > SimTime::ZERO
    {
        let (late, at) = (seconds(late), seconds(at));
        return Some(format!(
            "The event '{event}' was at most {late} late, at {at}."
        ));
    }
    if history.is_summary {
        return None;
    }
    let tasks = history.tasks().zip(&metrics.tasks);
    let longest = tasks.max_by_key(|(_, figures)| figures.orphan.total());
    Some(match longest {
        Some((task, figures)) if figures.orphan.total() > SimTime::ZERO => format!(
            "{} was without a productive robot for {} of {}, the longest of all tasks.",
            history.catalog.task_name(task),
            seconds(figures.orphan.total()),
            seconds(figures.applicable.total())
        ),
        _ => "No task was ever without a productive robot.".to_owned(),
    })
}

fn seconds(time: SimTime) -> String {
    format!("{:.2} s", time.as_secs_f64())
}
