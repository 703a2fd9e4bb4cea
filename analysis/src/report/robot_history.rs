//! The log data of one robot: its presence, its behavior sets, its received claims and its track.

use observation::stints::Span;
use proto::view::LevelUnit;
use run_log::MotivationRow;
use scenario::BehaviorParams;
use scenario::ids::TaskId;
use scenario::time::SimTime;

use super::spans::Spans;
use crate::figures::simplify::first_last_and_extremes;

#[derive(Clone, Debug)]
pub struct RobotHistory {
    pub name: String,
    /// The ticks in which the robot was neither dead nor stopped.
    pub present: Spans,
    /// The behavior sets, in catalog order.
    pub sets: Vec<SetHistory>,
    /// The meaning of the behavior sets' levels.
    pub measure: LevelUnit,
    pub(super) has_motivations: bool,
    /// The index of the behavior set of the latest row. The next row is usually about the next set.
    latest_set: usize,
    /// Task claims from teammates, in order of receipt.
    pub received_claims: Vec<ReceivedClaim>,
    /// The position at the start of each tick.
    pub track: Vec<TrackPoint>,
    /// The claims in `received_claims`, plus messages of teammates that wait for a task. Under some presets, these messages also
    /// reset motivations.
    pub(super) may_reset: Vec<ReceivedClaim>,
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

/// A state of a behavior set that is not hibernating.
#[derive(Clone, Copy, Debug)]
pub(super) enum SetState {
    Active,
    Waiting,
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

/// The robot's row of poses.csv in one tick. A long run has millions of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPoint {
    /// Center of the body, m.
    pub x_m: f32,
    pub y_m: f32,
    /// `true` if the gripper held an item.
    pub carrying: bool,
    /// Energy left, J; `None` if energy is not simulated.
    pub energy_j: Option<f32>,
}

impl TrackPoint {
    /// Returns the center of the body, m.
    #[must_use]
    pub fn position(&self) -> (f64, f64) {
        (self.x_m.into(), self.y_m.into())
    }
}

impl RobotHistory {
    pub(super) fn new(name: String, sets: Vec<SetHistory>) -> Self {
        Self {
            name,
            present: Spans::default(),
            sets,
            measure: LevelUnit::Motivation,
            has_motivations: false,
            latest_set: 0,
            received_claims: Vec::new(),
            track: Vec::new(),
            may_reset: Vec::new(),
        }
    }

    /// Returns the behavior set with this name. The search starts at the latest one.
    pub(super) fn set_named(&mut self, name: &str) -> Option<&mut SetHistory> {
        let (before, from) = self.sets.split_at(self.latest_set);
        let found = from.iter().position(|set| set.name == name);
        self.latest_set = match found {
            Some(place) => self.latest_set + place,
            None => before.iter().position(|set| set.name == name)?,
        };
        self.sets.get_mut(self.latest_set)
    }

    pub(super) fn find_reset_senders(&mut self) {
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
    pub(super) fn new(name: String, task: TaskId, params: BehaviorParams) -> Self {
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

    /// Ends a time in which the set was active or waiting, if there is one.
    pub(super) fn end_state(&mut self, since: &mut Option<(SetState, SimTime)>, to: SimTime) {
        match since.take() {
            Some((SetState::Active, from)) => self.active.push(Span { from, to }),
            Some((SetState::Waiting, from)) => self.waiting.push(Span { from, to }),
            None => {}
        }
    }

    /// Keeps the first, last, lowest and highest level of each `step`. Returns the number of levels.
    pub(super) fn thin(&mut self, step: SimTime) -> usize {
        let groups = self
            .levels
            .chunk_by(|a, b| a.0.0 / step.0 == b.0.0 / step.0);
        self.levels = groups.flat_map(first_last_and_extremes).collect();
        self.levels.len()
    }

    pub(super) fn add(&mut self, tick: Span, row: &MotivationRow) {
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
