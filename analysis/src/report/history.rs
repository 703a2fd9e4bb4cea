//! The contents of a full or compact log, sorted by robot and behavior set into spans, times and levels.

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex};
use std::thread::{self, ScopedJoinHandle};

use missions::Registry;
use proto::view::{ItemView, LevelUnit, Mark};
use run_log::{
    AllocationRow, EventRow, MessageRow, MissionRow, MotivationRow, PoseRow, ReadError, RunFile,
    RunLog, Table, TableRow,
};
use scenario::fault::Fault;
use scenario::ids::{RobotId, TaskId};
use scenario::mission::columns::{Column, ColumnValue};
use scenario::time::SimTime;
use scenario::{Catalog, Obstacle, Setup};
use world_server::simulation::Simulation;

use super::links::LinkHistory;
use super::robot_history::{ReceivedClaim, RobotHistory, SetHistory, SetState, TrackPoint};
use super::spans::Spans;
use observation::stints::{Span, end_of_last_counted};

/// The maximum number of levels of all curves. Beyond it, curves are thinned: no figure shows as many.
const LEVELS_MAX: usize = 8_000_000;

/// A run, up to the last complete tick of its log.
#[derive(Clone, Debug)]
pub struct History {
    pub setup: Setup,
    pub catalog: Arc<Catalog>,
    pub step: SimTime,
    /// The end of the last tick; 0 if there is none.
    pub end: SimTime,
    /// The robots' log data, by rank.
    pub robots: Vec<RobotHistory>,
    /// The messages by the ranks of sender and receiver.
    pub links: BTreeMap<(usize, usize), LinkHistory>,
    pub events: Vec<EventRow>,
    pub mission: Vec<MissionRow>,
    /// The visible marks of the mission at the start.
    pub marks: Vec<Mark>,
    /// The items at their start positions.
    pub items: Vec<ItemView>,
    /// The scenario's obstacles, and the obstacles that faults added.
    pub obstacles: Vec<Obstacle>,
    /// The largest time between two levels of a curve without a gap: a step, or more if the curves are thinned.
    pub level_step: SimTime,
    level_count: usize,
    levels_max: usize,
    /// True if the log is a summary, without motivations, utilities, messages and poses.
    pub is_summary: bool,
}

/// An error for a log that does not belong to its run.json or cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum HistoryError {
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A row with a name that is not in run.json.
    #[error("{table} has a row about '{name}', which is not in run.json")]
    Unknown { table: &'static str, name: String },
}

impl History {
    /// Reads all tables of a log.
    ///
    /// # Errors
    /// Returns an error for malformed rows and for rows of another run.
    pub fn read(log: &RunLog) -> Result<Self, HistoryError> {
        Self::read_with(log, || {})
    }

    /// Returns the number of written rows, for which [`History::read_with`] calls back.
    #[must_use]
    pub fn count_rows(log: &RunLog) -> usize {
        use Table::{Allocation, Messages, Motivations, Poses};
        let tables = [Motivations, Allocation, Messages, Poses].into_iter();
        let bytes = tables.flat_map(|table| log.table(table));
        bytes.filter(|byte| **byte == b'\n').count()
    }

    /// Reads all tables of a log like [`History::read`]. Calls `step_done` once for each written row of the large tables,
    /// some rows at a time. Each of these tables fills other fields of the robots, so several threads read them.
    pub fn read_with(log: &RunLog, step_done: impl FnMut() + Send) -> Result<Self, HistoryError> {
        let setup = &log.run.setup;
        let step = SimTime(setup.scenario.step_ms);
        let end = log.last.map_or(SimTime::ZERO, |last| last.now + step);
        let empty = || Self::new(setup.clone(), end);
        let step_done = Mutex::new(step_done);
        let (levels, messages, poses) = thread::scope(|scope| {
            let levels = scope.spawn(|| {
                let mut history = empty();
                each_row(log, &step_done, |row| history.add_motivation(row))?;
                each_row(log, &step_done, |row| history.add_utility(row))?;
                Ok::<_, HistoryError>(history)
            });
            let messages = scope.spawn(|| {
                let mut history = empty();
                each_row(log, &step_done, |row| history.add_message(row))?;
                Ok::<_, HistoryError>(history)
            });
            let mut history = empty();
            let poses = each_row(log, &step_done, |row| history.add_pose(row));
            (joined(levels), joined(messages), poses.map(|()| history))
        });
        let (mut history, messages, poses) = (levels?, messages?, poses?);
        history.links = messages.links;
        let read = messages.robots.into_iter().zip(poses.robots);
        for (robot, (messages, poses)) in history.robots.iter_mut().zip(read) {
            robot.received_claims = messages.received_claims;
            robot.may_reset = messages.may_reset;
            robot.track = poses.track;
        }
        history.events = log.rows()?;
        history.mission = log.rows()?;
        history.is_summary = !log.has_every_tick();
        history.finish(&log.run);
        Ok(history)
    }

    /// Completes the history after all rows.
    pub fn finish(&mut self, run: &RunFile) {
        self.find_other_allocators();
        for robot in &mut self.robots {
            robot.find_reset_senders();
        }
        // The marks of an unknown mission are not available.
        if let Ok(mission) = Registry::current().worlds().find(&self.setup.scenario) {
            let start = Simulation::new(self.setup.clone(), mission, false).view();
            (self.marks, self.items) = (start.marks, start.items);
        }
        let applied = run.faults.iter().filter(|fault| fault.applied_ms.is_some());
        let put_there = applied.filter_map(|fault| match fault.order.fault {
            Fault::Obstacle(obstacle) => Some(obstacle),
            _ => None,
        });
        self.obstacles.extend(put_there);
    }

    /// Creates an empty history of a run that ends at `end`.
    #[must_use]
    pub fn new(setup: Setup, end: SimTime) -> Self {
        let catalog = Arc::clone(&setup.catalog);
        let robots: Vec<RobotHistory> = setup
            .scenario
            .robots
            .iter()
            .map(|robot| {
                let sets = catalog.behaviors_of(robot).map(|set| {
                    let set = &catalog.sets[set.index()];
                    let params = &setup.alliance.robots[&robot.name].sets[&set.name];
                    SetHistory::new(set.name.clone(), set.task, params.clone())
                });
                RobotHistory::new(robot.name.clone(), sets.collect())
            })
            .collect();
        let step = SimTime(setup.scenario.step_ms);
        Self {
            step,
            end,
            robots,
            links: BTreeMap::new(),
            catalog,
            events: Vec::new(),
            mission: Vec::new(),
            marks: Vec::new(),
            items: Vec::new(),
            obstacles: setup.scenario.obstacles.clone(),
            level_step: step,
            level_count: 0,
            levels_max: LEVELS_MAX,
            is_summary: false,
            setup,
        }
    }

    /// Adds a row of motivations.csv. Rows must come in file order.
    pub fn add_motivation(&mut self, row: &MotivationRow) -> Result<(), HistoryError> {
        const TABLE: &str = "motivations.csv";
        let tick = self.tick(row.t_ms);
        let rank = self.known_rank(TABLE, &row.robot)?;
        let robot = &mut self.robots[rank];
        robot.present.push(tick);
        robot.has_motivations = true;
        let set = robot
            .set_named(&row.behavior_set)
            .ok_or_else(|| unknown(TABLE, &row.behavior_set))?;
        set.add(tick, row);
        self.count_level();
        Ok(())
    }

    /// Counts a new level. If there are too many, doubles the time between levels until three quarters of the maximum are
    /// left.
    fn count_level(&mut self) {
        self.level_count += 1;
        if self.level_count <= self.levels_max {
            return;
        }
        while self.level_count > self.levels_max / 4 * 3 && self.level_step.0 < u64::MAX / 2 {
            self.level_step = self.level_step + self.level_step;
            let sets = self.robots.iter_mut().flat_map(|robot| &mut robot.sets);
            self.level_count = sets.map(|set| set.thin(self.level_step)).sum();
        }
    }

    /// Reconstructs presence, active and waiting sets of robots without motivations from the events. Such robots have
    /// another kind of allocator, or the log is a summary.
    fn find_other_allocators(&mut self) {
        let (step, end) = (self.step, self.end);
        let mut events_of: HashMap<&str, Vec<&EventRow>> = HashMap::new();
        for event in &self.events {
            events_of.entry(&event.robot).or_default().push(event);
        }
        let others = self.robots.iter_mut();
        for robot in others.filter(|robot| !robot.has_motivations) {
            robot.measure = LevelUnit::Utility;
            let mut since = None;
            let mut state_since = vec![None; robot.sets.len()];
            for event in events_of.get(&*robot.name).into_iter().flatten() {
                let at = event.t_ms;
                match event.kind.as_str() {
                    "joined" | "back" => since = Some(at),
                    "gone" | "stalled" => {
                        if let Some(from) = since.take() {
                            let to = match event.kind.as_str() {
                                "stalled" => at,
                                _ => end_of_last_counted(&event.detail, step).unwrap_or(from),
                            };
                            let to = to.max(from);
                            robot.present.push(Span { from, to });
                        }
                    }
                    _ => {}
                }
                let sets = robot.sets.iter_mut().zip(&mut state_since);
                for (set, since) in sets {
                    let is_own = set.name == event.subject;
                    let (ends, begins) = match event.kind.as_str() {
                        "activated" if is_own => (true, Some((SetState::Active, at))),
                        "waiting" if is_own => (true, Some((SetState::Waiting, at))),
                        "hibernated" if is_own => (true, None),
                        "joined" => (true, None),
                        _ => (false, None),
                    };
                    if ends {
                        set.end_state(since, at);
                        *since = begins;
                    }
                }
            }
            if let Some(from) = since {
                robot.present.push(Span { from, to: end });
            }
            for (set, since) in robot.sets.iter_mut().zip(&mut state_since) {
                set.end_state(since, end);
                for spans in [&mut set.active, &mut set.waiting] {
                    *spans = spans.without(&spans.without(&robot.present));
                }
            }
        }
    }

    /// Adds a row of allocation.csv. Rows must come in file order.
    pub fn add_utility(&mut self, row: &AllocationRow) -> Result<(), HistoryError> {
        const TABLE: &str = "allocation.csv";
        let tick = self.tick(row.t_ms);
        let rank = self.known_rank(TABLE, &row.robot)?;
        let set = self.robots[rank]
            .set_named(&row.behavior_set)
            .ok_or_else(|| unknown(TABLE, &row.behavior_set))?;
        set.levels.push((row.t_ms, row.utility));
        set.applicable.push(tick);
        self.count_level();
        Ok(())
    }

    /// Returns the latest row of mission.csv with its columns; empty before the first row.
    #[must_use]
    pub fn latest(&self) -> Vec<ColumnValue> {
        let row = self.mission.last();
        let columns = self.columns().iter().zip(row.into_iter().cycle());
        columns
            .map(|(column, row)| column.with_number(row.get(column.name)))
            .collect()
    }

    #[must_use]
    pub fn columns(&self) -> &'static [Column] {
        self.catalog.mission.vocabulary().columns
    }

    /// Adds a row of messages.csv. Rows must come in file order.
    pub fn add_message(&mut self, row: &MessageRow) -> Result<(), HistoryError> {
        const TABLE: &str = "messages.csv";
        let sender = self.known_rank(TABLE, &row.sender)?;
        let receiver = self.known_rank(TABLE, &row.receiver)?;
        self.links.entry((sender, receiver)).or_default().add(row);
        let received = matches!(row.delivery.as_str(), "received" | "delayed" | "damaged");
        // A bulletin that names a task counts as a claim of that task.
        let bulletins = self.catalog.mission.vocabulary().bulletins;
        let names_task = bulletins.contains(&row.kind.as_str()) && !row.task.is_empty();
        let claims = row.state == "executing" || names_task;
        if !received || !(claims || row.state == "waiting") {
            return Ok(());
        }
        let task = match self.task_named(&row.task) {
            Some(task) => task,
            // A damaged message may name no task. The receiver ignores it.
            None if row.delivery == "damaged" => return Ok(()),
            None => return Err(unknown(TABLE, &row.task)),
        };
        let claim = ReceivedClaim {
            at: row.t_ms,
            sender,
            task,
        };
        let receiver = &mut self.robots[receiver];
        if claims {
            receiver.received_claims.push(claim);
        }
        receiver.may_reset.push(claim);
        Ok(())
    }

    /// Adds a row of poses.csv. Rows must come in file order.
    pub fn add_pose(&mut self, row: &PoseRow) -> Result<(), HistoryError> {
        let rank = self.known_rank("poses.csv", &row.robot)?;
        self.robots[rank].track.push(TrackPoint {
            x_m: row.x_m,
            y_m: row.y_m,
            carrying: row.carrying,
            energy_j: row.energy,
        });
        Ok(())
    }

    #[must_use]
    pub fn rank(&self, robot: &str) -> Option<usize> {
        self.setup.roster.find(robot).map(RobotId::index)
    }

    #[must_use]
    pub fn task_named(&self, name: &str) -> Option<TaskId> {
        self.catalog.find_task(name)
    }

    /// Returns all tasks in catalog order.
    pub fn tasks(&self) -> impl Iterator<Item = TaskId> + use<> {
        (0..self.catalog.tasks.len() as u32).map(TaskId)
    }

    /// Returns each behavior set of each robot for the task, with the robot's rank.
    pub fn behaviors_for(&self, task: TaskId) -> impl Iterator<Item = (usize, &SetHistory)> {
        let robots = self.robots.iter().enumerate();
        robots.flat_map(move |(rank, robot)| {
            let sets = robot.sets.iter().filter(move |set| set.task == task);
            sets.map(move |set| (rank, set))
        })
    }

    /// Returns the time in which a robot was dead, stopped or not yet present.
    #[must_use]
    pub fn absent(&self, rank: usize) -> Spans {
        let all = Span {
            from: SimTime::ZERO,
            to: self.end,
        };
        Spans::from_iter([all]).without(&self.robots[rank].present)
    }

    pub fn events_of<'h>(&'h self, kind: &'h str) -> impl Iterator<Item = &'h EventRow> {
        self.events.iter().filter(move |event| event.kind == kind)
    }

    fn tick(&self, at: SimTime) -> Span {
        Span {
            from: at,
            to: at + self.step,
        }
    }

    fn known_rank(&self, table: &'static str, robot: &str) -> Result<usize, HistoryError> {
        self.rank(robot).ok_or_else(|| unknown(table, robot))
    }
}

/// Passes each row of a table to `add`, and counts the rows of its file.
fn each_row<R: TableRow>(
    log: &RunLog,
    step_done: &Mutex<impl FnMut()>,
    mut add: impl FnMut(&R) -> Result<(), HistoryError>,
) -> Result<(), HistoryError> {
    /// Rows between two counts, so that threads seldom wait for each other.
    const AT_ONCE: u64 = 4096;
    let count = |rows: u64| {
        // After a panic of another thread, the count does not matter.
        if let Ok(mut step_done) = step_done.lock() {
            (0..rows).for_each(|_| step_done());
        }
    };
    let mut counted = 0;
    let mut rows = log.each_row();
    while let Some(row) = rows.advance() {
        add(row?)?;
        let uncounted = rows.lines() - counted;
        if uncounted >= AT_ONCE {
            count(uncounted);
            counted += uncounted;
        }
    }
    count(rows.lines() - counted);
    Ok(())
}

/// Returns the result of a thread, or passes on its panic.
fn joined<T>(thread: ScopedJoinHandle<'_, T>) -> T {
    thread
        .join()
        .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

fn unknown(table: &'static str, name: &str) -> HistoryError {
    HistoryError::Unknown {
        table,
        name: name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use missions::waste::data::default_setup;

    use super::*;
    use crate::report::tests::motivation;

    #[test]
    fn long_curves_are_thinned_within_the_bound_and_keep_their_ends_and_peaks() {
        let end = SimTime(50 * 20_000);
        let mut history = History::new(default_setup(1), end);
        history.levels_max = 1000;
        let (robot, set) = (&history.robots[0], &history.robots[0].sets[0]);
        let mut row = motivation(0, &robot.name, &set.name);
        for tick in 0..20_000_u64 {
            row.t_ms = SimTime(50 * tick);
            row.motivation = match tick {
                777 => 9.0,
                _ => (tick % 10) as f64 / 10.0,
            };
            history.add_motivation(&row).unwrap();
            assert!(history.level_count <= 1000);
        }
        let levels = &history.robots[0].sets[0].levels;
        assert_eq!(levels.len(), history.level_count);
        assert!(levels.len() > 200, "{} levels", levels.len());
        assert_eq!(levels[0], (SimTime::ZERO, 0.0));
        assert!(levels.contains(&(SimTime(50 * 777), 9.0)));
        assert_eq!(levels.last(), Some(&(SimTime(50 * 19_999), 0.9)));
        let gaps = levels.windows(2).map(|pair| pair[1].0.since(pair[0].0));
        assert!(gaps.max() <= Some(history.level_step));
        // The spans of the set do not depend on its levels.
        assert_eq!(history.robots[0].sets[0].applicable.total(), end);
    }
}
