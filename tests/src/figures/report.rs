//! The figures of a report.

use analysis::report::{History, HistoryError, Metrics};
use observation::stints::Loss;
use observation::takeovers::TakeoverCause;
use run_log::{AllocationRow, EventRow, MotivationRow, ReadError, RunLog};
use scenario::ids::TaskId;

use super::{Differences, Tables};

/// Compares the tables of a report with the tables of a full log.
///
/// # Errors
/// Returns an error if the log cannot be read.
pub fn report(log: &RunLog) -> Result<Differences, HistoryError> {
    let metrics = Metrics::compute(&History::read(log)?, &log.run);
    Ok(report_of(log, &metrics)?)
}

/// Compares the metrics of a report with the tables of a full log.
///
/// # Errors
/// Returns an error if the log cannot be read.
pub fn report_of(log: &RunLog, metrics: &Metrics) -> Result<Differences, ReadError> {
    let tables = Tables::read(log)?;
    let work = Work::read(&tables, log)?;
    let mut found = Differences::default();
    let ms = |ticks: usize| ticks as u64 * tables.step_ms;
    let makespan_ms = tables.is_complete().then(|| ms(tables.ticks as usize));
    let stated_ms = metrics.makespan.map(|time| time.0);
    found.compare("makespan", stated_ms, makespan_ms);
    for (rank, robot) in tables.robots.iter().enumerate() {
        let stated = &metrics.robots[rank];
        let present = &tables.counted[rank];
        let is_idle = |tick: &&u64| work.sets_of(rank).all(|set| !set.active[**tick as usize]);
        let idle_ms = ms(present.iter().filter(is_idle).count());
        let activations = tables.count("activated", robot);
        for (name, stated, calculated) in [
            ("present", stated.present.0, ms(present.len())),
            ("idle", stated.idle.0, idle_ms),
            ("activations", stated.activations.into(), activations),
        ] {
            found.compare(format!("report: {name} of {robot}"), stated, calculated);
        }
    }
    let stints = work.stints(&tables);
    for (task, stated) in tables.setup.catalog.tasks.iter().zip(&metrics.tasks) {
        let ticks = 0..tables.ticks as usize;
        let sets = || work.sets.iter().filter(|set| set.task == task.name);
        let applicable = |tick: &usize| sets().any(|set| set.applicable[*tick]);
        let active = |tick: &usize| sets().filter(|set| set.active[*tick]).count();
        let mut productive = vec![false; tables.ticks as usize];
        for stint in stints.iter().filter(|stint| stint.task == task.name) {
            productive[stint.from..stint.idle_since(stint.to)].fill(true);
        }
        let count = |fits: &dyn Fn(&usize) -> bool| ms(ticks.clone().filter(fits).count());
        let unattended_ms = count(&|tick| applicable(tick) && active(tick) == 0);
        let orphan_ms = count(&|tick| applicable(tick) && !productive[*tick]);
        for (name, spans, calculated_ms) in [
            ("applicable", &stated.applicable, count(&applicable)),
            ("unattended", &stated.unattended, unattended_ms),
            ("orphan", &stated.orphan, orphan_ms),
        ] {
            let name = format!("report: {name} of {}", task.name);
            found.compare(name, spans.total().0, calculated_ms);
        }
        let twice_ms = (task.max_robots == 1).then(|| count(&|tick| active(tick) > 1));
        let stated_ms = stated.duplicate.as_ref().map(|spans| spans.total().0);
        found.compare(format!("duplicate of {}", task.name), stated_ms, twice_ms);
    }
    let mut latest_present = vec![None; tables.robots.len()];
    let losses = tables.events.iter().filter_map(|row| {
        let rank = tables.rank(&row.robot).filter(|_| is_loss(row))?;
        let tick = row.t_ms.0 / tables.step_ms;
        let back = tables.counted[rank].range(tick + 1..).next();
        // A death at the end of a stop leaves no task: the stop has ended the stints.
        let present = tables.counted[rank].range(..=tick).next_back();
        let is_first = latest_present[rank] != Some(present);
        latest_present[rank] = Some(present);
        let ends = tick as usize..=tick as usize + 1;
        let mut stints = stints.iter().filter(|stint| stint.robot == rank);
        let left = stints.find(|stint| stint.end == StintEnd::Absent && ends.contains(&stint.to));
        let task = left.filter(|_| is_first).map(|stint| stint.task);
        let back_ms = back.map(|tick| tick * tables.step_ms);
        Some((row.t_ms.0, rank, row.kind.as_str(), back_ms, task))
    });
    let task_name = |task: TaskId| tables.setup.catalog.tasks[task.index()].name.as_str();
    let kind = |loss: Loss| match loss {
        Loss::Died => "gone",
        Loss::Stopped => "stalled",
    };
    let stated = metrics.failures.iter().map(|failure| {
        let back_ms = failure.returned_at.map(|back| back.0);
        let task = failure.orphan.as_ref().map(|orphan| task_name(orphan.task));
        (
            failure.at.0,
            failure.robot,
            kind(failure.loss),
            back_ms,
            task,
        )
    });
    let name = "report: losses (at, robot, loss, back, task)";
    found.compare(name, stated.collect::<Vec<_>>(), losses.collect());
    let stated = metrics.takeovers.iter().map(|takeover| {
        let task = task_name(takeover.task);
        let (at_ms, since_ms) = (takeover.at.0, takeover.idle_since.0);
        let cause = match &takeover.cause {
            TakeoverCause::StillActive => "active".to_owned(),
            TakeoverCause::Left(reason) => reason.clone(),
            TakeoverCause::Lost(loss) => kind(*loss).to_owned(),
        };
        (at_ms, task, takeover.from, takeover.robot, since_ms, cause)
    });
    let mut stated: Vec<_> = stated.collect();
    stated.sort();
    let name = "report: takeovers (at, task, from, to, idle since, cause)";
    found.compare(name, stated, takeovers(&tables, &stints));
    for recurring in &metrics.recurring {
        let period_ms = recurring.period.map(|period| period.0);
        let mut before_ms = 0;
        let calculated = tables.of_kind(recurring.event).map(|row| {
            let interval_ms = row.t_ms.0 - before_ms;
            before_ms = row.t_ms.0;
            let late_ms = period_ms.map_or(0, |period_ms| interval_ms.saturating_sub(period_ms));
            (row.t_ms.0, tables.rank(&row.robot), interval_ms, late_ms)
        });
        let moments = recurring.moments.iter();
        let stated =
            moments.map(|moment| (moment.at.0, moment.by, moment.interval.0, moment.late.0));
        let name = format!("report: each '{}'", recurring.event);
        found.compare(name, stated.collect::<Vec<_>>(), calculated.collect());
    }
    Ok(found)
}

fn is_loss(row: &EventRow) -> bool {
    row.kind == "gone" || row.kind == "stalled"
}

/// The state of all behavior sets in each tick.
struct Work<'a> {
    sets: Vec<SetWork<'a>>,
}

struct SetWork<'a> {
    robot: usize,
    name: &'a str,
    task: &'a str,
    applicable: Vec<bool>,
    active: Vec<bool>,
}

/// An unbroken time in which a robot works on a task, in ticks.
struct Stint<'a> {
    robot: usize,
    set: &'a str,
    task: &'a str,
    from: usize,
    to: usize,
    effects: Vec<usize>,
    acts: Vec<usize>,
    end: StintEnd,
    is_continuous: bool,
}

#[derive(PartialEq)]
enum StintEnd {
    Left(String),
    /// The end of the run.
    Ongoing,
    /// The loss of the robot.
    Absent,
}

impl Stint<'_> {
    fn idle_since(&self, tick: usize) -> usize {
        if self.is_continuous {
            return tick.min(self.to);
        }
        let before = self.effects.iter().filter(|effect| **effect <= tick).max();
        before.copied().unwrap_or(self.from)
    }
}

impl<'a> Work<'a> {
    fn read(tables: &Tables<'a>, log: &RunLog) -> Result<Self, ReadError> {
        let catalog = &tables.setup.catalog;
        let ticks = tables.ticks as usize;
        let mut sets = Vec::new();
        for (rank, robot) in tables.setup.scenario.robots.iter().enumerate() {
            for id in catalog.behaviors_of(robot) {
                let set = &catalog.sets[id.index()];
                sets.push(SetWork {
                    robot: rank,
                    name: &set.name,
                    task: &catalog.tasks[set.task.index()].name,
                    applicable: vec![false; ticks],
                    active: vec![false; ticks],
                });
            }
        }
        let mut work = Self { sets };
        let tick = |ms: u64| (ms / tables.step_ms) as usize;
        for row in log.each_row::<MotivationRow>() {
            let row = row?;
            if row.sensory_feedback {
                work.set(tables, &row.robot, &row.behavior_set).applicable[tick(row.t_ms.0)] = true;
            }
        }
        for row in log.each_row::<AllocationRow>() {
            let row = row?;
            work.set(tables, &row.robot, &row.behavior_set).applicable[tick(row.t_ms.0)] = true;
        }
        work.follow_events(tables);
        Ok(work)
    }

    fn set(&mut self, tables: &Tables<'_>, robot: &str, name: &str) -> &mut SetWork<'a> {
        let rank = tables.rank(robot);
        let mut sets = self.sets.iter_mut();
        let found = sets.find(|set| Some(set.robot) == rank && set.name == name);
        found.expect("a behavior set of the robot")
    }

    /// Marks the ticks in which each set is active: from `activated` to the next change, while the robot takes part.
    fn follow_events(&mut self, tables: &Tables<'_>) {
        let mut rest = tables.events.as_slice();
        let mut is_active = vec![false; self.sets.len()];
        for tick in 0..tables.ticks {
            let now_ms = tick * tables.step_ms;
            let count = rest.iter().take_while(|row| row.t_ms.0 <= now_ms).count();
            let (events, later) = rest.split_at(count);
            rest = later;
            for row in events {
                let rank = tables.rank(&row.robot);
                for (set, is_active) in self.sets.iter().zip(&mut is_active) {
                    if Some(set.robot) != rank {
                        continue;
                    }
                    match row.kind.as_str() {
                        "joined" => *is_active = false,
                        "activated" if set.name == row.subject => *is_active = true,
                        "hibernated" | "waiting" if set.name == row.subject => *is_active = false,
                        _ => {}
                    }
                }
            }
            for (set, is_active) in self.sets.iter_mut().zip(&is_active) {
                let counts = tables.counted[set.robot].contains(&tick);
                set.active[tick as usize] = *is_active && counts;
            }
        }
    }

    fn sets_of(&self, rank: usize) -> impl Iterator<Item = &SetWork<'a>> {
        self.sets.iter().filter(move |set| set.robot == rank)
    }

    /// Returns all stints in order of start and rank.
    fn stints(&self, tables: &Tables<'_>) -> Vec<Stint<'a>> {
        let mut stints = Vec::new();
        for set in &self.sets {
            let name = tables.robots[set.robot];
            let joins = tables.of_kind("joined").filter(|row| row.robot == name);
            let joins: Vec<u64> = joins.map(|row| row.t_ms.0 / tables.step_ms).collect();
            let ticks: Vec<usize> = (0..set.active.len()).collect();
            // A new process begins a new stint, also in the next tick.
            let is_same = |a: &usize, b: &usize| {
                set.active[*a] == set.active[*b] && !joins.contains(&(*b as u64))
            };
            for run in ticks.chunk_by(is_same).filter(|run| set.active[run[0]]) {
                stints.push(stint(tables, set, run[0], run[0] + run.len()));
            }
        }
        stints.sort_by_key(|stint| (stint.from, stint.robot));
        stints
    }
}

fn stint<'a>(tables: &Tables<'_>, set: &SetWork<'a>, from: usize, to: usize) -> Stint<'a> {
    let terms = tables.setup.catalog.mission.vocabulary();
    let name = tables.robots[set.robot];
    let tick = |row: &EventRow| (row.t_ms.0 / tables.step_ms) as usize;
    let own = || tables.events.iter().filter(|row| row.robot == name);
    let effects = own().filter_map(|row| {
        let kind = row.kind.as_str();
        let mut columns = terms.columns.iter();
        let changes_column = columns.any(|column| column.event == Some(kind));
        let at = match kind {
            "progress" if row.detail == set.task => tick(row),
            _ if terms.effects.contains(&kind) => tick(row),
            _ if changes_column => tick(row) + 1,
            _ => return None,
        };
        (from < at && at <= to).then_some(at)
    });
    let acts = own().filter(|row| {
        let mut verbs = terms.verbs.iter();
        verbs.any(|(_, kind)| *kind == row.kind) && (from..to).contains(&tick(row))
    });
    let change = own().find(|row| {
        let is_end = ["hibernated", "waiting"].contains(&row.kind.as_str());
        is_end && tick(row) == to && row.subject == set.name
    });
    Stint {
        robot: set.robot,
        set: set.name,
        task: set.task,
        from,
        to,
        effects: effects.collect(),
        acts: acts.map(tick).collect(),
        end: match change {
            Some(row) => StintEnd::Left(row.reason.clone()),
            None if to as u64 >= tables.ticks => StintEnd::Ongoing,
            None => StintEnd::Absent,
        },
        is_continuous: terms.continuous,
    }
}

/// A takeover: time, task, previous robot, next robot, time of the last progress and state of the previous robot.
type Takeover<'t> = (u64, &'t str, usize, usize, u64, String);

/// Returns the takeovers by the definition in docs/book/results.md. The numbers are those of its rules.
fn takeovers<'t>(tables: &Tables<'t>, stints: &[Stint<'t>]) -> Vec<Takeover<'t>> {
    let has_row = |kind: &str, stint: &Stint<'_>| {
        let (at_ms, name) = (
            stint.from as u64 * tables.step_ms,
            tables.robots[stint.robot],
        );
        let of_robot = |row: &&EventRow| row.robot == name && row.t_ms.0 == at_ms;
        let mut rows = tables.of_kind(kind).filter(of_robot);
        rows.any(|row| row.subject == stint.set)
    };
    let is_bid = |stint: &Stint<'_>| stint.to == stint.from + 1; // 3
    let yields = |stint: &Stint<'_>| {
        let plans = "arbitration outbid claimed awarded reassigned drawn";
        let mut plans = plans
            .split(' ')
            .map(|reason| StintEnd::Left(reason.to_owned()));
        let has_worked = stint.is_continuous || !stint.acts.is_empty() || !stint.effects.is_empty();
        let mut others = stints.iter().filter(|other| {
            let included = (other.from..other.to).contains(&stint.from);
            let differs = other.robot != stint.robot && other.task == stint.task;
            differs && included && other.to >= stint.to
        });
        plans.any(|end| end == stint.end) && (!has_worked || others.next().is_some()) // 4, 5
    };
    let counts = |stint: &&Stint<'_>| !is_bid(stint) && !yields(stint); // 6
    let counted: Vec<&Stint<'_>> = stints.iter().filter(counts).collect();
    let exclusive = |name: &str| {
        let mut tasks = tables.setup.catalog.tasks.iter();
        tasks.any(|task| task.name == name && task.max_robots == 1)
    };
    let mut found = Vec::new();
    for next in &counted {
        let on_task = || counted.iter().filter(|stint| stint.task == next.task);
        let is_second = on_task().any(|stint| stint.from == next.from && stint.robot < next.robot);
        if !exclusive(next.task) || !has_row("activated", next) || is_second {
            continue; // 2, 8
        }
        let mut earlier: Vec<_> = on_task().filter(|stint| stint.from < next.from).collect();
        earlier.sort_by_key(|stint| (stint.to.min(next.from), stint.from, stint.robot)); // 7
        let Some(before) = earlier.last().filter(|stint| stint.robot != next.robot) else {
            continue;
        };
        let progress_ms = before.idle_since(next.from) as u64 * tables.step_ms;
        let works_on = before.acts.iter().any(|act| *act >= next.from)
            || before.effects.iter().any(|effect| *effect > next.from)
            || before.is_continuous && before.to > next.from;
        let (since_ms, cause) = match &before.end {
            _ if works_on => continue, // 8
            _ if before.to > next.from => (progress_ms, "active".to_owned()),
            StintEnd::Left(reason) if reason == "not-applicable" => continue,
            StintEnd::Left(reason) => (progress_ms, reason.clone()),
            StintEnd::Ongoing => continue,
            StintEnd::Absent => {
                let end_ms = before.to as u64 * tables.step_ms;
                let lost = tables.robots[before.robot];
                let losses = tables.events.iter().filter(|row| {
                    let ends = row.t_ms.0..=row.t_ms.0 + tables.step_ms;
                    is_loss(row) && row.robot == lost && ends.contains(&end_ms)
                });
                // A death at the end of a stop did not end the stint.
                let Some(loss) = losses.min_by_key(|row| row.t_ms) else {
                    continue;
                };
                (loss.t_ms.0, loss.kind.clone())
            }
        };
        let at_ms = next.from as u64 * tables.step_ms;
        found.push((at_ms, next.task, before.robot, next.robot, since_ms, cause)); // 9
    }
    found.sort();
    found
}
