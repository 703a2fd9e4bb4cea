//! The result of a run: the state, the robots and the times of each task, from the events of its log.

use run_log::{EventRow, RunLog, RunOutcome, Table};
use scenario::Problem;
use scenario::fault::EventTrigger;
use scenario::time::SimTime;

use super::from_scenario::{self, Extracted};
use super::model::{Instance, RobotResult, RunResult, TaskResult, TaskState};

/// Returns the instance of a run with its result. `starts` are the places of the robots at the start, by rank, m.
///
/// # Errors
/// Returns an error if the mission has no tasks at places, or if the log cannot be read.
pub fn of_run(log: &RunLog, starts: &[[f64; 2]]) -> anyhow::Result<Extracted> {
    if !log.run.log.keeps(Table::Events) {
        let what = format!("--log {} keeps no events", log.run.log.as_str());
        anyhow::bail!(Problem::of_value(what, "repeat the run with --log summary"));
    }
    let setup = &log.run.setup;
    let mut extracted = from_scenario::instance(&setup.scenario, setup.seed, starts)?;
    let mut events = Vec::new();
    for row in log.each_row::<EventRow>() {
        events.push(row?);
    }
    let result = result(log, &extracted.instance, &events);
    let stated = extracted.instance.tasks.len();
    let added = events
        .iter()
        .filter(|event| event.kind == "arrived" && number_of(event) >= Some(stated))
        .count();
    if added > 0 {
        extracted.notes.push(format!(
            "{added} points that faults added: not in the instance"
        ));
    }
    extracted.instance.result = Some(result);
    Ok(extracted)
}

/// Returns the number of the point that an event concerns.
fn number_of(event: &EventRow) -> Option<usize> {
    EventTrigger::number_of(&event.subject, "p")
}

fn result(log: &RunLog, instance: &Instance, events: &[EventRow]) -> RunResult {
    let run = &log.run;
    let outcome = match run.outcome {
        RunOutcome::Running => "running",
        RunOutcome::Ended(outcome) => outcome.as_str(),
    };
    let new = |id: &String| TaskResult {
        id: id.clone(),
        ..TaskResult::default()
    };
    let mut tasks: Vec<TaskResult> = instance.tasks.iter().map(|task| new(&task.id)).collect();
    let mut robots: Vec<RobotResult> = instance
        .robots
        .iter()
        .map(|robot| RobotResult {
            id: robot.id.clone(),
            tasks: Vec::new(),
        })
        .collect();
    for event in events {
        let Some(task) = number_of(event).and_then(|number| tasks.get_mut(number)) else {
            continue;
        };
        let at_s = event.t_ms.as_secs_f64();
        if ["begun", "done"].contains(&event.kind.as_str()) && !event.robot.is_empty() {
            if !task.robots.contains(&event.robot) {
                task.robots.push(event.robot.clone());
            }
            if let Some(robot) = robots.iter_mut().find(|each| each.id == event.robot)
                && !robot.tasks.contains(&task.id)
            {
                robot.tasks.push(task.id.clone());
            }
        }
        match event.kind.as_str() {
            // A task that comes back begins anew.
            "arrived" => *task = new(&task.id.clone()),
            "begun" => {
                task.begun_s.get_or_insert(at_s);
            }
            "done" => (task.state, task.ended_s) = (TaskState::Done, Some(at_s)),
            "expired" => (task.state, task.ended_s) = (TaskState::Expired, Some(at_s)),
            _ => {}
        }
    }
    let done = instance
        .tasks
        .iter()
        .zip(&tasks)
        .filter(|(_, result)| result.state == TaskState::Done);
    let value = done.map(|(task, _)| task.value.unwrap_or(1.0)).sum();
    let makespan_ms = log.run_json()["result"]["makespan_ms"].as_u64();
    RunResult {
        allocator: run.setup.scenario.allocator_list(),
        seed: run.setup.seed,
        outcome: outcome.to_owned(),
        end_s: run.result.sim_time_ms.as_secs_f64(),
        makespan_s: makespan_ms.map(|ms| SimTime(ms).as_secs_f64()),
        value,
        tasks,
        robots,
    }
}
