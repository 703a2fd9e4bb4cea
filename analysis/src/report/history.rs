//! The contents of a full log, sorted by robot and behavior set into spans, times and levels.

use std::sync::Arc;

use missions::Registry;
use proto::view::{ItemView, LevelUnit, Mark};
use run_log::{
    AllocationRow, EventRow, MessageRow, MissionRow, MotivationRow, PoseRow, ReadError, RunLog,
};
use scenario::fault::Fault;
use scenario::ids::{RobotId, TaskId};
use scenario::mission::columns::{Column, ColumnValue};
use scenario::time::SimTime;
use scenario::{BehaviorParams, Catalog, Obstacle, Setup};
use world_server::simulation::Simulation;

use super::spans::{Span, Spans};

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
    pub events: Vec<EventRow>,
    pub mission: Vec<MissionRow>,
    /// The visible marks of the mission at the start.
    pub marks: Vec<Mark>,
    /// The items at their start positions.
    pub items: Vec<ItemView>,
    /// The scenario's obstacles, and the obstacles that faults added.
    pub obstacles: Vec<Obstacle>,
}

#[derive(Clone, Debug)]
pub struct RobotHistory {
    pub name: String,
    /// The ticks in which the robot was neither dead nor stopped.
    pub present: Spans,
    /// The behavior sets, in catalog order.
    pub sets: Vec<SetHistory>,
    /// The meaning of the behavior sets' levels.
    pub measure: LevelUnit,
    /// Task claims from teammates, in order of receipt.
    pub received_claims: Vec<ReceivedClaim>,
    /// The position at the start of each tick.
    pub track: Vec<TrackPoint>,
    /// The claims in `heard`, plus messages of teammates that wait for a task. Under some presets, these messages also
    /// reset motivations.
    may_reset: Vec<ReceivedClaim>,
}

/// The log data of one behavior set of one robot. Each tick lasts until the start of the next one.
#[derive(Clone, Debug)]
pub struct SetHistory {
    pub name: String,
    pub task: TaskId,
    pub params: BehaviorParams,
    /// The motivation at the end of each step in which the robot took part, or the utility at the end of each step in
    /// which the set was applicable.
    pub levels: Vec<(SimTime, f64)>,
    /// The times with sensory_feedback = 1.
    pub applicable: Spans,
    pub active: Spans,
    pub waiting: Spans,
    /// Steps in which impatience_reset = 0 reduced the motivation.
    pub resets: Vec<Reset>,
    /// Steps in which the impatience rate rose to δ_fast.
    pub impatience_rises: Vec<SimTime>,
    /// The impatience rate in the latest step, motivation/s.
    impatience: f64,
}

/// A message that the sender executes or has done a task. comm_received counts it under every preset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReceivedClaim {
    /// The time of receipt.
    pub at: SimTime,
    pub sender: usize,
    pub task: TaskId,
}

/// A step in which a teammate's message reduced the motivation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reset {
    pub at: SimTime,
    /// Ranks of the senders of claims in this step, usually one. New claimants take precedence over earlier ones.
    pub by: Vec<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPoint {
    /// Center of the body, m.
    pub position: (f64, f64),
    /// `true` if the gripper held an item.
    pub carrying: bool,
    /// Energy left, J; `None` if energy is not simulated.
    pub energy_j: Option<f64>,
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
        let setup = &log.run.setup;
        let step = SimTime(setup.scenario.step_ms);
        let end = log.last.map_or(SimTime::ZERO, |last| last.now + step);
        let mut history = Self::new(setup.clone(), end);
        for row in log.each_row::<MotivationRow>() {
            history.add_motivation(&row?)?;
        }
        history.events = log.rows()?;
        history.find_other_allocators();
        for row in log.each_row::<AllocationRow>() {
            history.add_utility(&row?)?;
        }
        for row in log.each_row::<MessageRow>() {
            history.add_message(&row?)?;
        }
        for robot in &mut history.robots {
            robot.find_reset_senders();
        }
        for row in log.each_row::<PoseRow>() {
            history.add_pose(&row?)?;
        }
        history.mission = log.rows()?;
        // The marks of an unknown mission are not available.
        if let Ok(mission) = Registry::current().worlds().find(&setup.scenario) {
            let start = Simulation::new(setup.clone(), mission, false).view();
            (history.marks, history.items) = (start.marks, start.items);
        }
        let applied = log
            .run
            .faults
            .iter()
            .filter(|fault| fault.applied_ms.is_some());
        let put_there = applied.filter_map(|fault| match fault.order.fault {
            Fault::Obstacle(obstacle) => Some(obstacle),
            _ => None,
        });
        history.obstacles.extend(put_there);
        Ok(history)
    }

    /// Creates an empty history of a run that ends at `end`.
    #[must_use]
    pub fn new(setup: Setup, end: SimTime) -> Self {
        let catalog = Arc::clone(&setup.catalog);
        let robots: Vec<RobotHistory> = setup
            .scenario
            .robots
            .iter()
            .map(|robot| RobotHistory {
                name: robot.name.clone(),
                present: Spans::default(),
                sets: catalog
                    .behaviors_of(robot)
                    .map(|set| {
                        let set = &catalog.sets[set.index()];
                        let params = &setup.alliance.robots[&robot.name].sets[&set.name];
                        SetHistory::new(set.name.clone(), set.task, params.clone())
                    })
                    .collect(),
                measure: LevelUnit::Motivation,
                received_claims: Vec::new(),
                track: Vec::new(),
                may_reset: Vec::new(),
            })
            .collect();
        Self {
            step: SimTime(setup.scenario.step_ms),
            catalog,
            end,
            robots,
            events: Vec::new(),
            mission: Vec::new(),
            marks: Vec::new(),
            items: Vec::new(),
            obstacles: setup.scenario.obstacles.clone(),
            setup,
        }
    }

    /// Adds a row of motivations.csv. Rows must come in file order.
    pub fn add_motivation(&mut self, row: &MotivationRow) -> Result<(), HistoryError> {
        const TABLE: &str = "motivations.csv";
        let tick = self.tick(row.t_ms);
        let rank = self.known_rank(TABLE, &row.robot)?;
        let robot = &mut self.robots[rank];
        let set = robot
            .sets
            .iter_mut()
            .find(|set| set.name == row.behavior_set)
            .ok_or_else(|| unknown(TABLE, &row.behavior_set))?;
        robot.present.push(tick);
        set.add(tick, row);
        Ok(())
    }

    /// Reconstructs the presence of robots without motivations from the events. Such robots have another kind of
    /// allocator.
    fn find_other_allocators(&mut self) {
        let others = self.robots.iter_mut();
        for robot in others.filter(|robot| robot.present.iter().next().is_none()) {
            robot.measure = LevelUnit::Utility;
            let mut since = None;
            for event in self.events.iter().filter(|row| row.robot == robot.name) {
                match event.kind.as_str() {
                    "joined" | "back" => since = Some(event.t_ms),
                    "gone" | "stalled" => {
                        if let Some(from) = since.take() {
                            let to = event.t_ms;
                            robot.present.push(Span { from, to });
                        }
                    }
                    _ => {}
                }
            }
            if let Some(from) = since {
                robot.present.push(Span { from, to: self.end });
            }
        }
    }

    /// Adds a row of allocation.csv. Rows must come in file order.
    pub fn add_utility(&mut self, row: &AllocationRow) -> Result<(), HistoryError> {
        const TABLE: &str = "allocation.csv";
        let tick = self.tick(row.t_ms);
        let rank = self.known_rank(TABLE, &row.robot)?;
        let mut sets = self.robots[rank].sets.iter_mut();
        let set = sets
            .find(|set| set.name == row.behavior_set)
            .ok_or_else(|| unknown(TABLE, &row.behavior_set))?;
        set.levels.push((row.t_ms, row.utility));
        set.applicable.push(tick);
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
        let received = matches!(row.delivery.as_str(), "heard" | "delayed");
        // A bulletin that names a task counts as a claim of that task.
        let bulletins = self.catalog.mission.vocabulary().bulletins;
        let names_task = bulletins.contains(&row.kind.as_str()) && !row.task.is_empty();
        let claims = row.state == "executing" || names_task;
        if !received || !(claims || row.state == "waiting") {
            return Ok(());
        }
        let sender = self.known_rank(TABLE, &row.sender)?;
        let receiver = self.known_rank(TABLE, &row.receiver)?;
        let task = self
            .task_named(&row.task)
            .ok_or_else(|| unknown(TABLE, &row.task))?;
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
        let tick = self.tick(row.t_ms);
        let robot = &mut self.robots[rank];
        // For robots with motivations, motivations.csv contains this.
        if robot.measure == LevelUnit::Utility {
            let active = robot.sets.iter_mut();
            for set in active.filter(|set| set.name == row.behavior_set) {
                set.active.push(tick);
            }
        }
        robot.track.push(TrackPoint {
            position: (row.x_m.into(), row.y_m.into()),
            carrying: row.carrying,
            energy_j: row.energy.map(f64::from),
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
        (0..self.catalog.tasks.len() as u16).map(TaskId)
    }

    /// Returns each behavior set of each robot for the task, with the robot's rank.
    pub fn behaviors_for(&self, task: TaskId) -> impl Iterator<Item = (usize, &SetHistory)> {
        self.robots
            .iter()
            .enumerate()
            .flat_map(move |(rank, robot)| {
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

fn unknown(table: &'static str, name: &str) -> HistoryError {
    HistoryError::Unknown {
        table,
        name: name.to_owned(),
    }
}

impl RobotHistory {
    fn find_reset_senders(&mut self) {
        let claims = &self.may_reset;
        for set in &mut self.sets {
            let task = set.task;
            for reset in &mut set.resets {
                let from = claims.partition_point(|claim| claim.at < reset.at);
                let now = claims[from..]
                    .iter()
                    .take_while(|claim| claim.at == reset.at);
                let mut by: Vec<usize> = now
                    .filter(|claim| claim.task == task)
                    .map(|claim| claim.sender)
                    .collect();
                by.dedup();
                let is_new = |sender: &usize| {
                    let mut before = claims[..from].iter();
                    !before.any(|claim| claim.sender == *sender && claim.task == task)
                };
                if by.iter().any(is_new) {
                    by.retain(is_new);
                }
                reset.by = by;
            }
        }
    }

    /// Returns the time in which any of the robot's behavior sets was active.
    #[must_use]
    pub fn active(&self) -> Spans {
        Spans::in_at_least(1, self.sets.iter().map(|set| &set.active))
    }
}

impl SetHistory {
    fn new(name: String, task: TaskId, params: BehaviorParams) -> Self {
        Self {
            name,
            task,
            // Impatience counts as fast before the first step, so that the first step is not a rise.
            impatience: params.fast_impatience,
            params,
            levels: Vec::new(),
            applicable: Spans::default(),
            active: Spans::default(),
            waiting: Spans::default(),
            resets: Vec::new(),
            impatience_rises: Vec::new(),
        }
    }

    fn add(&mut self, tick: Span, row: &MotivationRow) {
        let before = self.levels.last().map_or(0.0, |&(_, level)| level);
        if !row.impatience_reset && before > 0.0 {
            let at = tick.from;
            self.resets.push(Reset { at, by: Vec::new() });
        }
        let fast = self.params.fast_impatience;
        if self.impatience < fast && row.impatience >= fast {
            self.impatience_rises.push(tick.from);
        }
        self.impatience = row.impatience;
        self.levels.push((tick.from, row.motivation));
        if row.sensory_feedback {
            self.applicable.push(tick);
        }
        match row.state.as_str() {
            "active" => self.active.push(tick),
            "waiting" => self.waiting.push(tick),
            _ => {}
        }
    }
}
