//! The waste clean-up (thesis §4.1, DESIGN §7): behavior sets and knowledge. Pure.
//!
//! - `briefing`: what a robot knows beforehand; `extremes`: what it learns about the border.
//! - `memory`: what it knows about the mission; `teammates`: what it last heard of the others.
//! - `find`, `spill`, `report`: the behavior sets. `perceive` and `act`, the two halves of a step, are in this file and use
//!   them all.

mod briefing;
mod extremes;
mod find;
mod memory;
mod report;
mod sight;
mod spill;
mod teammates;
mod views;

use alliance_proto::ids::{RobotId, SetId, TaskId};
use alliance_proto::readings::{Actuation, Gripper, Readings, Zone};
use alliance_proto::scenario::{BehaviorKind, Setup};
use alliance_proto::team::{Body, Broadcast, Knowledge, TaskState};
use alliance_proto::telemetry::{Note, NoteKind};
use alliance_proto::time::SimTime;
use glam::Vec2;

use crate::body::goal::length;
use crate::body::{Goal, Navigator, Status, Surroundings, Teammate};
use briefing::{Briefing, Places};
use extremes::Extremes;
use find::{Methodical, Search, Wander};
use memory::{Memory, SAME_PLACE_M};
use report::{Errand, errand};
use sight::Sight;
use spill::{Scene, SpillWork, Work, nearest_spill};
use teammates::Teammates;

/// How long a finder whose update was withdrawn leaves the search to others.
const STANDS_BACK: SimTime = SimTime(60_000);
/// An idle robot leaves this much room between itself and a teammate at work, m.
const ROOM_M: f32 = 0.2;
/// A spill sensed this much farther from its computed center than its radius is still that spill, m.
const SPILL_TOLERANCE_M: f32 = 0.2;
/// Result of [`WasteMission::perceive`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Perception {
    /// sensory_feedback (eq. 2.1) of each of the robot's sets, in the order of `Catalog::sets_of`.
    pub applicable: Vec<bool>,
    /// The tasks on which the robot had an effect on the world since the last step, one entry each.
    pub progressed: Vec<TaskId>,
    /// For the log.
    pub notes: Vec<Note>,
}

/// Result of [`WasteMission::act`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Action {
    /// What the body shall do.
    pub actuation: Actuation,
    /// What to broadcast beside heartbeats.
    pub bodies: Vec<Body>,
    /// For the log.
    pub notes: Vec<Note>,
}

/// One robot's mind for the waste clean-up.
#[derive(Clone, Debug)]
pub struct WasteMission {
    briefing: Briefing,
    own_sets: Vec<SetId>,
    memory: Memory,
    teammates: Teammates,
    extremes: Extremes,
    methodical: Methodical,
    wander: Wander,
    work: Option<SpillWork>,
    navigator: Navigator,
    status: Status,
    position: Option<Vec2>,
    holding: bool,
    /// The set that picked up what the robot holds.
    load_of: Option<SetId>,
    /// What it did in the last step and has not yet seen the effect of.
    pending: Option<Pending>,
    /// Effects on the world, seen but not yet reported to the motivational behaviors.
    progressed: Vec<TaskId>,
    /// Progress counts by task.
    progress: Vec<u32>,
    stands_back_since: Option<SimTime>,
}

/// An act whose effect shows in the next readings.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pending {
    Delivery(TaskId),
    Report(TaskId),
}

impl WasteMission {
    /// A new life of that robot: it knows nothing but its briefing.
    ///
    /// # Panics
    /// If the setup has no such robot.
    #[must_use]
    pub fn new(robot: RobotId, setup: &Setup) -> Self {
        let briefing = Briefing::new(robot, setup);
        let own = &setup.scenario.robots[robot.index()];
        Self {
            own_sets: briefing.catalog.sets_of(own).collect(),
            memory: Memory::new(robot, briefing.spill_count()),
            progress: vec![0; briefing.catalog.tasks.len()],
            briefing,
            teammates: Teammates::default(),
            extremes: Extremes::default(),
            methodical: Methodical::default(),
            wander: Wander::default(),
            work: None,
            navigator: Navigator::default(),
            status: Status::Going,
            position: None,
            holding: false,
            load_of: None,
            pending: None,
            progressed: Vec::new(),
            stands_back_since: None,
        }
    }

    /// What the robot knows, for its heartbeats.
    #[must_use]
    pub fn knowledge(&self) -> &Knowledge {
        self.memory.knowledge()
    }

    /// Where the robot believes to be, m.
    #[must_use]
    pub fn position(&self) -> Option<Vec2> {
        self.position
    }

    /// Whether it carries an item.
    #[must_use]
    pub fn carrying(&self) -> bool {
        self.holding
    }

    /// First half of a step: joins what the robot senses and hears to what it knows.
    pub fn perceive(
        &mut self,
        now: SimTime,
        readings: &Readings,
        heard: &[Broadcast],
    ) -> Perception {
        let mut notes = Vec::new();
        self.position = readings.pose.map(|pose| pose.position);
        self.see_effects(now, readings);
        for broadcast in heard {
            self.hear(now, broadcast, &mut notes);
        }
        for place in self.teammates.fallen_silent(now, self.briefing.silence) {
            self.search_later(place, now);
        }
        self.extremes.join(readings, self.briefing.chassis.radius_m);
        self.see_waste(now, readings);
        self.memory.expire(now);
        for &task in &self.progressed {
            self.progress[task.index()] += 1;
            notes.push(Note {
                kind: NoteKind::Progress,
                detail: self.briefing.catalog.task_name(task).to_owned(),
            });
        }
        Perception {
            applicable: self
                .own_sets
                .iter()
                .map(|&set| self.is_applicable(set, now, readings))
                .collect(),
            progressed: std::mem::take(&mut self.progressed),
            notes,
        }
    }

    /// Second half of a step: does what the active set wants, on the readings that were perceived.
    pub fn act(&mut self, now: SimTime, active: Option<SetId>, readings: &Readings) -> Action {
        let mut action = Action::default();
        if self.holding && active != self.load_of {
            self.put_down(now, readings, &mut action);
            return action;
        }
        let Some(set) = active else {
            self.work = None;
            self.make_room(now, readings, &mut action);
            return action;
        };
        let spec = &self.briefing.catalog.sets[set.index()];
        let (kind, task) = (spec.kind, spec.task);
        if !matches!((kind, &self.work), (BehaviorKind::MoveSpill(spill), Some(work)) if work.spill() == usize::from(spill))
        {
            self.work = None;
        }
        match kind {
            BehaviorKind::FindLocationsMethodical => {
                let search = self.methodical.step(readings);
                self.search(now, set, task, search, readings, &mut action);
            }
            BehaviorKind::FindLocationsWander => {
                let step = SimTime::from_secs_f64(f64::from(self.briefing.chassis.step_s));
                let search = self
                    .wander
                    .step(readings, &self.extremes, step, self.status);
                self.search(now, set, task, search, readings, &mut action);
            }
            BehaviorKind::MoveSpill(spill) => {
                self.move_spill(now, set, task, usize::from(spill), readings, &mut action)
            }
            BehaviorKind::ReportProgress => self.report_progress(now, task, readings, &mut action),
        }
        action
    }

    fn places(&self) -> Option<Places> {
        let locations = self.memory.locations()?;
        Some(self.briefing.places(&locations.value))
    }

    fn see_effects(&mut self, now: SimTime, readings: &Readings) {
        let holding = readings.holding.unwrap_or(false);
        match self.pending.take() {
            Some(Pending::Delivery(task)) if self.holding && !holding => self.progressed.push(task),
            Some(Pending::Report(task)) => {
                self.memory.report(now);
                self.progressed.push(task);
            }
            _ => {}
        }
        self.holding = holding;
        if !holding {
            self.load_of = None;
        }
    }

    fn hear(&mut self, now: SimTime, broadcast: &Broadcast, notes: &mut Vec<Note>) {
        let find = TaskId(0);
        match &broadcast.body {
            Body::Heartbeat(heartbeat) => {
                if let Some(place) = self.teammates.hear(broadcast, heartbeat) {
                    self.search_later(place, now);
                }
                if heartbeat.task == Some(find) && heartbeat.state == TaskState::Executing {
                    self.stands_back_since = None;
                }
                if self.memory.hear(&heartbeat.knowledge, now) {
                    self.learned(broadcast.sender, notes);
                }
            }
            Body::PositionUpdate { locations, .. } => {
                if self.memory.hear_locations(*locations, now) {
                    self.learned(broadcast.sender, notes);
                }
            }
            Body::Withdrawal(withdrawal) => {
                if self.memory.hear_withdrawal(*withdrawal) {
                    self.stands_back_since = Some(now);
                }
            }
        }
    }

    fn learned(&mut self, from: RobotId, notes: &mut Vec<Note>) {
        self.stands_back_since = None;
        // Whoever searches again, because they prove wrong, starts anew.
        self.methodical = Methodical::default();
        self.extremes = Extremes::default();
        notes.push(Note {
            kind: NoteKind::LocationsLearned,
            detail: format!("from {from}"),
        });
    }

    /// A teammate lost its load somewhere on the way from here to the deposit, since its last heartbeat.
    fn search_later(&mut self, last_place: Vec2, now: SimTime) {
        let Some(places) = self.places() else { return };
        let way = self.briefing.chassis.speed_m_s * self.briefing.heartbeat.as_secs_f64() as f32;
        let offset = places.deposit - last_place;
        let distance = length(offset);
        let ahead = (way / 2.0).min((distance - self.briefing.deposit_radius_m).max(0.0));
        let place = last_place + offset * (ahead / distance.max(ahead).max(f32::EPSILON));
        self.memory.see_loose(place, true, now);
    }

    /// Own sight of the spills and of what lies loose.
    fn see_waste(&mut self, now: SimTime, readings: &Readings) {
        let (Some(pose), Some(places)) = (readings.pose, self.places()) else {
            return;
        };
        let own_spill = |at: Vec2, slack: f32| {
            nearest_spill(&places, at).filter(|&spill| {
                length(places.spills[spill] - at) <= self.briefing.spill_radius_m + slack
            })
        };
        if readings.zone == Some(Zone::Spill)
            && own_spill(pose.position, SPILL_TOLERANCE_M).is_some()
        {
            self.memory.confirm();
        }
        let Some(sight) = Sight::of(readings, &self.briefing, &places) else {
            return;
        };
        for &item in &sight.waste {
            match own_spill(item, 0.0) {
                Some(spill) => self.memory.see_spill(spill, false, now),
                None => self.memory.see_loose(item, true, now),
            }
        }
        let gone: Vec<Vec2> = self
            .memory
            .loose()
            .filter(|&place| sight.shows_nothing_at(place, SAME_PLACE_M))
            .collect();
        for place in gone {
            self.memory.see_loose(place, false, now);
        }
    }

    fn is_applicable(&self, set: SetId, now: SimTime, readings: &Readings) -> bool {
        let Some(places) = self.places() else {
            let sensors_work = readings.pose.is_some() && readings.front_border.is_some();
            let stands_back = self.briefing.team_size > 1
                && self
                    .stands_back_since
                    .is_some_and(|since| now.since(since) < STANDS_BACK);
            return match self.briefing.catalog.sets[set.index()].kind {
                BehaviorKind::FindLocationsMethodical => {
                    sensors_work && readings.side_border.is_some() && !stands_back
                }
                BehaviorKind::FindLocationsWander => sensors_work && !stands_back,
                _ => false,
            };
        };
        if readings.pose.is_none() {
            return false;
        }
        match self.briefing.catalog.sets[set.index()].kind {
            BehaviorKind::MoveSpill(spill) => {
                let spill = usize::from(spill);
                let loads = self.holding && self.load_of == Some(set);
                let loose = self
                    .memory
                    .loose()
                    .any(|place| nearest_spill(&places, place) == Some(spill));
                let works = readings.waste.is_some() && readings.holding.is_some();
                works && (loads || loose || !self.memory.believes_empty(spill, now))
            }
            BehaviorKind::ReportProgress => {
                now.since(self.memory.last_report()) >= self.briefing.report_period
            }
            _ => false,
        }
    }

    /// The set hibernates while the robot carries something: it puts that down and remembers where.
    fn put_down(&mut self, now: SimTime, readings: &Readings, action: &mut Action) {
        action.actuation.gripper = Gripper::Drop;
        self.work = None;
        let Some(pose) = readings.pose else { return };
        let ahead = Vec2::new(libm::cosf(pose.heading_rad), libm::sinf(pose.heading_rad));
        let at = pose.position + ahead * self.briefing.chassis.radius_m;
        action.notes.push(Note {
            kind: NoteKind::PutDown,
            detail: format!("at {:.2} {:.2}", at.x, at.y),
        });
        if readings.zone == Some(Zone::None) {
            self.memory.see_loose(at, true, now);
        }
    }

    /// Idle, it steps aside for a teammate at work that comes near: it may be what keeps that one in.
    fn make_room(&mut self, now: SimTime, readings: &Readings, action: &mut Action) {
        let Some(position) = self.position else {
            return;
        };
        let near = 2.0 * self.briefing.chassis.radius_m + ROOM_M;
        let Some(at_work) = self.teammates.nearest_at_work(position, now) else {
            return;
        };
        let away = position - at_work;
        let distance = length(away);
        if distance < near && distance > 0.0 {
            self.drive(now, Goal::Direction(away / distance), &[], readings, action);
        }
    }

    fn search(
        &mut self,
        now: SimTime,
        set: SetId,
        task: TaskId,
        search: Search,
        readings: &Readings,
        action: &mut Action,
    ) {
        let progress = match search {
            Search::Go { goal, progress } => {
                self.go(now, goal, readings, action);
                progress
            }
            Search::Finished { progress } => {
                self.methodical = Methodical::default();
                if let Some(border) = self.extremes.border() {
                    self.extremes = Extremes::default();
                    let locations = self.memory.find(border, now);
                    action.notes.push(Note {
                        kind: NoteKind::PositionUpdate,
                        detail: format!("{} to {}", border.min, border.max),
                    });
                    action.bodies.push(Body::PositionUpdate {
                        task,
                        set,
                        progress: self.progress[task.index()] + u32::from(progress),
                        locations,
                    });
                }
                progress
            }
        };
        if progress {
            self.progressed.push(task);
        }
    }

    fn move_spill(
        &mut self,
        now: SimTime,
        set: SetId,
        task: TaskId,
        spill: usize,
        readings: &Readings,
        action: &mut Action,
    ) {
        let Some(places) = self.places() else {
            return;
        };
        let Some(sight) = Sight::of(readings, &self.briefing, &places) else {
            return;
        };
        let scene = Scene {
            now,
            sight: &sight,
            holding: self.holding,
            in_deposit: readings.zone.map(|zone| zone == Zone::Deposit),
            in_spill: readings.zone.map(|zone| zone == Zone::Spill),
            status: self.status,
            places: &places,
        };
        let work = self
            .work
            .get_or_insert_with(|| SpillWork::new(spill, &self.briefing, &places));
        match work.step(&self.briefing, &scene, &mut self.memory) {
            Work::Go(goal) => self.go(now, goal, readings, action),
            Work::Grip(gripper) => {
                action.actuation.gripper = gripper;
                match gripper {
                    Gripper::Pick => self.load_of = Some(set),
                    _ => self.pending = Some(Pending::Delivery(task)),
                }
            }
            Work::Empty => {
                self.memory.see_spill(spill, true, now);
                action.notes.push(Note {
                    kind: NoteKind::SpillEmpty,
                    detail: self.briefing.catalog.task_name(task).to_owned(),
                });
            }
            Work::Wrong => self.withdraw(now, action),
        }
    }

    fn report_progress(
        &mut self,
        now: SimTime,
        task: TaskId,
        readings: &Readings,
        action: &mut Action,
    ) {
        let (Some(places), Some(pose)) = (self.places(), readings.pose) else {
            return;
        };
        match errand(
            &places,
            pose.position,
            readings.report_site,
            self.briefing.chassis.radius_m,
        ) {
            Errand::Go(goal) => self.go(now, goal, readings, action),
            Errand::Report => {
                action.actuation.report_progress = true;
                self.pending = Some(Pending::Report(task));
            }
            Errand::Wrong => self.withdraw(now, action),
        }
    }

    fn withdraw(&mut self, now: SimTime, action: &mut Action) {
        let Some(withdrawal) = self.memory.withdraw() else {
            return;
        };
        if withdrawal.finder == self.briefing.robot {
            self.stands_back_since = Some(now);
        }
        action.notes.push(Note {
            kind: NoteKind::LocationsWithdrawn,
            detail: format!("of {} at {}", withdrawal.finder, withdrawal.seen),
        });
        action.bodies.push(Body::Withdrawal(withdrawal));
    }

    fn go(&mut self, now: SimTime, goal: Goal, readings: &Readings, action: &mut Action) {
        let right_of_way = self.teammates.right_of_way(self.briefing.robot, now);
        self.drive(now, goal, &right_of_way, readings, action);
    }

    fn drive(
        &mut self,
        now: SimTime,
        goal: Goal,
        right_of_way: &[Teammate],
        readings: &Readings,
        action: &mut Action,
    ) {
        let Some(around) = Surroundings::of(readings) else {
            return;
        };
        let drive = self
            .navigator
            .drive(&self.briefing.chassis, goal, &around, right_of_way, now);
        self.status = drive.status;
        action.actuation = drive.actuation;
        if let Some(side) = drive.detour {
            action.notes.push(Note {
                kind: NoteKind::Detour,
                detail: format!("obstacle to the {}", side.as_str()),
            });
        }
    }
}
