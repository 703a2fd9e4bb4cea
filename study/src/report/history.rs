//! What a full log says, sorted by robot and behavior set: the rows of all ticks become spans, moments and levels.

use std::sync::Arc;

use alliance_proto::fault::Fault;
use alliance_proto::ids::{RobotId, TaskId};
use alliance_proto::log::{
    AllocationRow, EventRow, MessageRow, MissionRow, MotivationRow, PoseRow, ReadError, RunLog,
};
use alliance_proto::mission::columns::{Column, ColumnValue};
use alliance_proto::scenario::{BehaviorParams, Catalog, Obstacle, Setup};
use alliance_proto::time::SimTime;
use alliance_proto::view::{ItemView, Mark, Measure};
use missions::Registry;
use world_server::simulation::Simulation;

use super::spans::{Span, Spans};

/// A run, up to the last tick that is whole in its log.
#[derive(Clone, Debug)]
pub struct History {
    /// Scenario and parameters.
    pub setup: Setup,
    /// Its tasks and behavior sets.
    pub catalog: Arc<Catalog>,
    /// Length of a step.
    pub step: SimTime,
    /// End of the last tick; 0 without any.
    pub end: SimTime,
    /// By rank.
    pub robots: Vec<RobotHistory>,
    /// The rows of events.csv.
    pub events: Vec<EventRow>,
    /// The rows of mission.csv.
    pub mission: Vec<MissionRow>,
    /// What there was to see of the mission at the start.
    pub marks: Vec<Mark>,
    /// The items as they lay at the start.
    pub items: Vec<ItemView>,
    /// Rectangles that lay on the floor: the scenario's, and those that faults put there at some time.
    pub obstacles: Vec<Obstacle>,
}

/// One robot.
#[derive(Clone, Debug)]
pub struct RobotHistory {
    /// Its name.
    pub name: String,
    /// The ticks in which it took part: neither dead nor stopped.
    pub present: Spans,
    /// Its behavior sets, in the catalog's order.
    pub sets: Vec<SetHistory>,
    /// What the levels of its behavior sets are.
    pub measure: Measure,
    /// Claims of teammates to execute a task, in the order in which it heard them.
    pub heard: Vec<Claim>,
    /// Where it was at the start of each tick.
    pub track: Vec<Place>,
    /// As `heard`, with what teammates said that waited for the task: that resets a motivation under some presets.
    may_reset: Vec<Claim>,
}

/// One behavior set of one robot. A tick counts from its start to the start of the next one.
#[derive(Clone, Debug)]
pub struct SetHistory {
    /// Its name.
    pub name: String,
    /// Its task.
    pub task: TaskId,
    /// Its parameters.
    pub params: BehaviorParams,
    /// Motivation at the end of each step in which the robot took part; utility at the end of each step in which it was applicable.
    pub levels: Vec<(SimTime, f64)>,
    /// sensory_feedback = 1.
    pub applicable: Spans,
    /// State active.
    pub active: Spans,
    /// State waiting.
    pub waiting: Spans,
    /// Steps in which impatience_reset = 0 took away motivation.
    pub resets: Vec<Reset>,
    /// Steps in which the rate of impatience rose to δ_fast.
    pub hurries: Vec<SimTime>,
    /// Rate of impatience in the latest step, motivation/s.
    impatience: f64,
}

/// "I execute that task", or "I have done it": what comm_received counts under every preset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Claim {
    /// When it was heard.
    pub at: SimTime,
    /// Rank of the sender.
    pub sender: usize,
    /// The task.
    pub task: TaskId,
}

/// A step in which the message of a teammate took away motivation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reset {
    /// When.
    pub at: SimTime,
    /// Ranks of those whose claims came in this step: as a rule one. Of several, those that had not claimed the task before, if
    /// there are any.
    pub by: Vec<usize>,
}

/// Where a robot was, and whether it carried something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Center of the body, m.
    pub position: (f64, f64),
    /// Whether the gripper held an item.
    pub carrying: bool,
    /// Energy left, J; `None` where it is not simulated.
    pub energy_j: Option<f64>,
}

/// A log that does not belong to its run.json, or cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum HistoryError {
    /// See [`ReadError`].
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A row that names something of another run.
    #[error("{table} has a row about '{name}', which run.json does not know")]
    Unknown {
        /// Where.
        table: &'static str,
        /// Robot, behavior set or task.
        name: String,
    },
}

impl History {
    /// Reads all tables.
    ///
    /// # Errors
    /// For rows that are malformed or of another run.
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
            robot.tell_resets();
        }
        for row in log.each_row::<PoseRow>() {
            history.add_pose(&row?)?;
        }
        history.mission = log.rows()?;
        // What a mission is that this program does not know nobody can see.
        if let Ok(mission) = Registry::of_this_program().worlds().of(&setup.scenario) {
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

    /// A run of that length of which nothing is known yet.
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
                measure: Measure::Motivation,
                heard: Vec::new(),
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

    /// Adds a row of motivations.csv; they come in the order of the file.
    ///
    /// # Errors
    /// [`HistoryError::Unknown`].
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

    /// Robots without motivations have allocators of another kind: the events tell when they took part.
    fn find_other_allocators(&mut self) {
        let others = self.robots.iter_mut();
        for robot in others.filter(|robot| robot.present.iter().next().is_none()) {
            robot.measure = Measure::Utility;
            let mut since = None;
            for event in self.events.iter().filter(|it| it.robot == robot.name) {
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

    /// Adds a row of allocation.csv; they come in the order of the file.
    ///
    /// # Errors
    /// [`HistoryError::Unknown`].
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

    /// The row of mission.csv with its columns; empty before the first.
    #[must_use]
    pub fn latest(&self) -> Vec<ColumnValue> {
        let row = self.mission.last();
        let columns = self.columns().iter().zip(row.into_iter().cycle());
        columns
            .map(|(column, row)| column.seen(row.get(column.name)))
            .collect()
    }

    /// The columns of mission.csv.
    #[must_use]
    pub fn columns(&self) -> &'static [Column] {
        self.catalog.mission.terms().columns
    }

    /// Adds a row of messages.csv; they come in the order of the file.
    ///
    /// # Errors
    /// [`HistoryError::Unknown`].
    pub fn add_message(&mut self, row: &MessageRow) -> Result<(), HistoryError> {
        const TABLE: &str = "messages.csv";
        let heard = matches!(row.fate.as_str(), "heard" | "delayed");
        // A bulletin with a task counts as a message about it.
        let bulletins = self.catalog.mission.terms().bulletins;
        let is_told = bulletins.contains(&row.kind.as_str()) && !row.task.is_empty();
        let claims = row.state == "executing" || is_told;
        if !heard || !(claims || row.state == "waiting") {
            return Ok(());
        }
        let sender = self.known_rank(TABLE, &row.sender)?;
        let receiver = self.known_rank(TABLE, &row.receiver)?;
        let task = self
            .task_named(&row.task)
            .ok_or_else(|| unknown(TABLE, &row.task))?;
        let claim = Claim {
            at: row.t_ms,
            sender,
            task,
        };
        let receiver = &mut self.robots[receiver];
        if claims {
            receiver.heard.push(claim);
        }
        receiver.may_reset.push(claim);
        Ok(())
    }

    /// Adds a row of poses.csv; they come in the order of the file.
    ///
    /// # Errors
    /// [`HistoryError::Unknown`].
    pub fn add_pose(&mut self, row: &PoseRow) -> Result<(), HistoryError> {
        let rank = self.known_rank("poses.csv", &row.robot)?;
        let tick = self.tick(row.t_ms);
        let robot = &mut self.robots[rank];
        // Of the others motivations.csv says it.
        if robot.measure == Measure::Utility {
            let active = robot.sets.iter_mut();
            for set in active.filter(|set| set.name == row.behavior_set) {
                set.active.push(tick);
            }
        }
        robot.track.push(Place {
            position: (row.x_m.into(), row.y_m.into()),
            carrying: row.carrying,
            energy_j: row.energy.map(f64::from),
        });
        Ok(())
    }

    /// Rank of the robot of that name.
    #[must_use]
    pub fn rank(&self, robot: &str) -> Option<usize> {
        self.setup.roster.robot_named(robot).map(RobotId::index)
    }

    /// The task of that name.
    #[must_use]
    pub fn task_named(&self, name: &str) -> Option<TaskId> {
        self.catalog.task_named(name)
    }

    /// All tasks, in the catalog's order.
    pub fn tasks(&self) -> impl Iterator<Item = TaskId> + use<> {
        (0..self.catalog.tasks.len() as u16).map(TaskId)
    }

    /// Each behavior set of each robot that performs the task, with the robot's rank.
    pub fn behaviors_for(&self, task: TaskId) -> impl Iterator<Item = (usize, &SetHistory)> {
        self.robots
            .iter()
            .enumerate()
            .flat_map(move |(rank, robot)| {
                let sets = robot.sets.iter().filter(move |set| set.task == task);
                sets.map(move |set| (rank, set))
            })
    }

    /// The time in which that robot took no part: dead, stopped, or not there yet.
    #[must_use]
    pub fn absent(&self, rank: usize) -> Spans {
        let all = Span {
            from: SimTime::ZERO,
            to: self.end,
        };
        Spans::from_iter([all]).without(&self.robots[rank].present)
    }

    /// The events of that kind.
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
    /// Finds out by whom its motivations were reset.
    fn tell_resets(&mut self) {
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

    /// The time in which one of its behavior sets was active.
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
            // Nobody is taken to have become impatient in the first step.
            impatience: params.fast_impatience,
            params,
            levels: Vec::new(),
            applicable: Spans::default(),
            active: Spans::default(),
            waiting: Spans::default(),
            resets: Vec::new(),
            hurries: Vec::new(),
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
            self.hurries.push(tick.from);
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
