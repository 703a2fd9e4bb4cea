//! The robot controller of service: goes to a point of the active task and works there.
//!
//! - `briefing`: the initial knowledge. `memory`: the knowledge about points. `place`: the places of points, with the
//!   ways to them. `wander`: movement without a task.
//! - `recharge`: the way to a charger. `progress`: the estimated progress of the current work. `load`: the load of the
//!   robot. `timing`: points with windows. `crew`, `together`, `appointments`: robots that work together.

mod appointments;
mod briefing;
mod crew;
mod load;
mod memory;
mod place;
mod progress;
mod recharge;
#[cfg(test)]
mod tests;
mod timing;
mod together;
mod wander;

use std::sync::Arc;

use glam::Vec2;
use proto::mission::{Action as AnyAction, SharedKnowledge as AnyKnowledge};
use proto::readings::{Actuation, Readings};
use proto::team::Broadcast;
use robot_agent::allocator::{Choice, OwnBehavior};
use robot_agent::body::{Driver, Surroundings};
use robot_agent::mission::{
    ControllerConstructor, ControllerInput, MissionController, Perception, StepOutput,
};
use scenario::Setup;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

use super::bus::{Action, MAX_SHARED, ObservedFact, PointFact, SensorReading};
use super::data::{self, KnowledgeSource, Origin, TaskGranularity};
use briefing::Briefing;
use crew::CrewMember;
use load::Load;
use memory::{KnownPoint, Memory, is_open};
use progress::Progress;
use recharge::Recharge;
use wander::Wander;

/// The maximum number of known points per step that are checked for absence, if there is no board.
const LOOKED_FOR: usize = 8;
/// The margin inside the sight range within which an open point is surely visible, m.
const CERTAIN_M: f32 = 0.3;
/// The distance from a point within which a teammate at work there may be in the way, m.
const QUEUE_M: f32 = 1.0;
/// The time for which a robot waits for a teammate that may be in its way, while the work left does not change.
const QUEUE_TIME: SimTime = SimTime(60_000);
/// The distance below which an idle robot moves aside, m. It is larger than the distance that robots keep when they
/// drive around something.
const ROOM_M: f32 = 0.15;

#[derive(Clone, Debug)]
struct ServiceController {
    robot: RobotId,
    briefing: Arc<Briefing>,
    memory: Memory,
    driver: Driver,
    wander: Wander,
    progress: Option<Progress>,
    /// The point on which the robot worked in the previous step, according to its own action.
    working: Option<u32>,
    target: Option<u32>,
    /// The point of the previous step's active task.
    heading_for: Option<u32>,
    crew: CrewMember,
    /// The point whose load the robot carries.
    laden: Option<u32>,
    load: Load,
    recharge: Recharge,
    /// The point to which the way was blocked, with the work left, s, and the time since when both are the same.
    blocked: Option<(u32, f32, SimTime)>,
    /// The number of the point from which the absence check continues.
    looked_for: u32,
    /// Memory for the facts in a message.
    received: Vec<ObservedFact>,
    now: SimTime,
}

impl ServiceController {
    fn new(robot: RobotId, setup: &Setup, briefing: &Arc<Briefing>) -> Self {
        let behaviors = OwnBehavior::of_robot(robot, setup);
        let skills = briefing.skills(robot, setup);
        let team = setup.scenario.robots.len();
        let points = behaviors
            .iter()
            .map(|behavior| briefing.point(behavior.task));
        let points = briefing.appointments.with_rounds(points);
        Self {
            robot,
            memory: Memory::new(behaviors.iter().map(|behavior| behavior.task), skills),
            driver: Driver::new(robot, setup),
            wander: Wander::new(setup.seed, robot),
            progress: None,
            working: None,
            target: None,
            heading_for: None,
            laden: None,
            load: Load::new(&setup.scenario.robots[robot.index()]),
            recharge: Recharge::default(),
            crew: CrewMember::new(robot, team, briefing.coalition_wait, points),
            blocked: None,
            looked_for: 0,
            received: Vec::new(),
            now: SimTime::ZERO,
            briefing: Arc::clone(briefing),
        }
    }

    fn learn(&mut self, mut fact: PointFact, sensed: SimTime) {
        if self.briefing.is_plausible(&fact, self.now) {
            let (_, closes) = self.briefing.window(&fact);
            if closes.is_some_and(|closes| closes <= self.now) {
                fact.left_s = 0.0;
            }
            self.memory
                .merge(&self.briefing, ObservedFact { fact, sensed });
        }
    }

    /// Records the points that the robot reads on the board or sees.
    fn look(&mut self, sensed: &SensorReading, input: &ControllerInput<'_>) {
        let Some(points) = &sensed.points else {
            return;
        };
        if self.briefing.known == KnowledgeSource::All {
            points.iter().for_each(|fact| self.learn(*fact, input.now));
            return;
        }
        let Some(pose) = input.readings.pose else {
            return;
        };
        let ahead = Vec2::from_angle(pose.heading_rad);
        for fact in points {
            let at = pose.position + ahead.rotate(fact.at);
            let at = at.clamp(self.briefing.room.low(), self.briefing.room.high());
            self.learn(PointFact { at, ..*fact }, input.now);
        }
        self.miss(points, pose.position, input.now);
    }

    /// Marks known points as over that should be visible but are not.
    fn miss(&mut self, seen: &[PointFact], position: Vec2, now: SimTime) {
        let reach_m = match seen.last() {
            Some(last) if seen.len() == super::bus::MAX_SENSED => last.at.length(),
            _ => self.briefing.sight_m,
        };
        let mut missing: Vec<PointFact> = Vec::new();
        let mut looked_for = 0;
        for fact in self.memory.facts_from(self.looked_for).take(LOOKED_FOR) {
            looked_for = fact.point + 1;
            let is_near = position.distance(fact.at) < reach_m - CERTAIN_M;
            if is_open(fact) && is_near && !seen.iter().any(|seen| seen.point == fact.point) {
                missing.push(PointFact {
                    left_s: 0.0,
                    ..*fact
                });
            }
        }
        self.looked_for = looked_for;
        for fact in missing {
            self.learn(fact, now);
        }
    }

    /// Updates the progress of the current work. A quarter of a point is progress; if tasks are kinds, a whole point
    /// is.
    fn note_work(
        &mut self,
        effect: Option<u32>,
        input: &ControllerInput<'_>,
        perception: &mut Perception,
    ) {
        // Work on a point with a delivery, and its load, do not show that a way leads to the place of delivery.
        if let Some(point) = effect
            && self.briefing.terms(point).deliver_to.is_none()
        {
            self.memory.failed.succeed(point);
        }
        if self.note_crew(effect, perception) {
            self.progress = None;
            return;
        }
        let effect = effect.filter(|point| self.could_work(*point) && self.laden != Some(*point));
        if let (Some(progress), None) = (self.progress.clone(), effect)
            && self.working == Some(progress.point)
            && progress.next_step_completes()
            && let Some(&fact) = self.memory.fact(progress.point)
        {
            // No more work can be taken off.
            self.note_load(&fact, &progress, input.now);
            self.learn(
                PointFact {
                    left_s: 0.0,
                    ..fact
                },
                input.now,
            );
        }
        let Some(fact) = effect.and_then(|point| self.memory.fact(point)).copied() else {
            self.progress = None;
            return;
        };
        let is_same =
            |progress: &Progress| progress.point == fact.point && progress.round == fact.round;
        let mut progress = self
            .progress
            .take()
            .filter(is_same)
            .unwrap_or_else(|| Progress::new(&fact));
        let quarters =
            progress.work(self.memory.skill(&self.briefing, &fact) * self.briefing.step_s);
        let is_over = !is_open(&fact);
        let has_progressed = match self.briefing.tasks {
            TaskGranularity::Points => quarters || is_over,
            TaskGranularity::Kinds => is_over,
        };
        if is_over {
            self.note_load(&fact, &progress, input.now);
        }
        if has_progressed {
            perception.progressed.push(self.briefing.task(&fact));
        }
        if !is_over && self.briefing.kinds[fact.kind as usize].kept {
            self.memory.work_left(fact.point, progress.left_s());
            if quarters {
                self.memory.mark_changed(fact.point);
            }
        }
        self.progress = (!is_over).then_some(progress);
    }

    fn target(&mut self, task: TaskId, position: Vec2) -> Option<PointFact> {
        let open = |fact: &&PointFact| is_open(fact);
        match self.briefing.tasks {
            TaskGranularity::Points => {
                let point = self.briefing.point(task);
                self.memory.fact(point).filter(open).copied()
            }
            TaskGranularity::Kinds => {
                let chosen = self.target.and_then(|target| self.memory.fact(target));
                let chosen = chosen
                    .filter(open)
                    .filter(|fact| fact.kind == task.0)
                    .filter(|fact| !self.memory.failed.is_suspended(fact.point, self.now));
                let of_task = || Some(&self.point_of(task, position)?.fact);
                let fact = chosen.or_else(of_task).copied();
                self.target = fact.map(|fact| fact.point);
                fact
            }
        }
    }

    /// Records that the way to a point is blocked. The attempt has failed, unless a teammate at the point may be in the way.
    fn note_blocked(&mut self, fact: &PointFact, position: Vec2, now: SimTime) {
        let is_same = |known: &(u32, f32, SimTime)| (known.0, known.1) == (fact.point, fact.left_s);
        let known = self.blocked.filter(is_same);
        let blocked = known.unwrap_or((fact.point, fact.left_s, now));
        let reach_m = self.briefing.reach_m_of(fact.point);
        let may_queue = position.distance(fact.at) <= reach_m + QUEUE_M;
        if may_queue && now.since(blocked.2) < QUEUE_TIME {
            self.blocked = Some(blocked);
        } else {
            self.blocked = None;
            self.memory.failed.fail(fact.point, now);
        }
    }

    /// Computes the movement of a robot without a task. Without a board it explores. With a board it stands still until
    /// something comes near: a teammate may need its place, and may be detected by sensors only.
    fn idle(&mut self, position: Vec2, readings: &Readings, now: SimTime) -> Actuation {
        let near_m = self.briefing.sight_m.min(1.0);
        let goes = self.briefing.known == KnowledgeSource::Sight
            || self.wander.is_driving(position, near_m, now)
            || Surroundings::from_readings(readings)
                .is_some_and(|around| around.nearest_m() < ROOM_M);
        if !goes {
            return Actuation::default();
        }
        let to = self.wander.next(position, near_m, &self.briefing.room, now);
        self.driver.drive_to(to, near_m / 2.0, readings, now)
    }

    /// Estimates the way to a point at top speed, s. `None` without a way.
    fn drive_s(&self, from: Vec2, known: &KnownPoint) -> Option<f64> {
        let way_m = self.briefing.way_to_m(from, &known.place)?;
        let way_m = (way_m - self.briefing.reach_m_of(known.fact.point)).max(0.0);
        Some(self.driver.seconds(Vec2::ZERO, Vec2::new(way_m, 0.0)))
    }

    /// Returns whether ways lead to a point and to its delivery.
    fn is_reachable(&self, from: &Origin, known: &KnownPoint) -> bool {
        !self.briefing.has_paths()
            || self.briefing.has_way_to(from, &known.place) && self.can_deliver(known)
    }

    /// Estimates the cost of a point: the way at top speed and all work left, s. `None` without the skill or a way.
    fn cost_s(&self, from: Vec2, known: &KnownPoint) -> Option<f64> {
        let skill = self.memory.skill(&self.briefing, &known.fact);
        let drive_s = self.drive_s(from, known)?;
        (skill > 0.0).then(|| drive_s + f64::from(known.fact.left_s / skill))
    }

    /// Returns whether the window of a point was open in the previous step. Before, a robot at the point only waits.
    fn could_work(&self, point: u32) -> bool {
        let fact = self.memory.fact(point);
        let opens = fact.map_or(SimTime::ZERO, |fact| self.briefing.window(fact).0);
        opens == SimTime::ZERO || opens + self.briefing.step <= self.now
    }

    /// Returns the start of a point's current round, at most the current time.
    fn round_of(&self, known: Option<&KnownPoint>, now: SimTime) -> SimTime {
        known
            .map_or(SimTime::ZERO, |known| self.came_back(&known.fact))
            .min(now)
    }
}

impl MissionController for ServiceController {
    fn perceive(
        &mut self,
        input: &ControllerInput<'_>,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        self.now = input.now;
        let sensed = input.reading::<SensorReading>();
        self.look(&sensed, input);
        let mut shared = std::mem::take(&mut self.received);
        for broadcast in received {
            broadcast.read_shared_items(MAX_SHARED, &mut shared);
            for known in &shared {
                // An observation cannot be in the future.
                self.learn(known.fact, known.sensed.min(input.now));
            }
        }
        self.received = shared;
        let load = sensed.effect.and_then(|point| self.memory.fact(point));
        self.laden = load
            .filter(|fact| self.is_load(fact))
            .map(|fact| fact.point);
        self.note_work(sensed.effect, input, perception);
        if self.briefing.has_terms() {
            self.close_expired(input.now);
            self.update_appointment(input.position(), input.now);
        }
        let position = input.position();
        let can_go = position.is_some();
        let applicable = self.memory.applicable(&self.briefing, self.now);
        let applicable = applicable.map(|is_open| is_open && can_go);
        perception.applicable.extend(applicable);
        if self.briefing.has_terms() || self.briefing.has_paths() {
            let own = input.behaviors.iter().zip(&mut perception.applicable);
            let origin = position.map(|at| self.briefing.origin(at));
            for (behavior, applicable) in own.filter(|(_, applicable)| **applicable) {
                *applicable = self.may_begin(behavior.task, origin.as_ref());
            }
        }
        self.update_charging(input.readings, input.now);
        if self.recharge.charger.is_some() {
            perception.applicable.fill(false);
        }
    }

    fn choices(&self, input: &ControllerInput<'_>, applicable: &[bool], choices: &mut Vec<Choice>) {
        if self.briefing.has_terms() {
            self.choices_in_windows(input, choices);
            return;
        }
        let from = input.position();
        for (behavior, &applicable) in input.behaviors.iter().zip(applicable) {
            choices.push(Choice {
                behavior: behavior.id,
                task: behavior.task,
                round: self.round(input, behavior.task),
                applicable,
                cost_s: self.seconds(from, &[], behavior.task),
                opens_in_s: 0.0,
                reward: 1.0,
                priority: behavior.priority,
                max_robots: behavior.max_robots,
            });
        }
    }

    fn round(&self, input: &ControllerInput<'_>, task: TaskId) -> SimTime {
        let from = input.position();
        let known = from.and_then(|from| self.point_of(task, from));
        self.round_of(known, input.now)
    }

    /// Drives toward the point until its work has an effect, because the robot only estimates whether it is within
    /// reach.
    fn act(
        &mut self,
        input: &ControllerInput<'_>,
        active: Option<BehaviorId>,
        output: &mut StepOutput,
    ) {
        let sensed = input.reading::<SensorReading>();
        self.crew.task = input.task_of(active);
        let target = self.crew.task.zip(input.position());
        let target = target.and_then(|(task, position)| self.target(task, position));
        let mut action = Action {
            work: None,
            read: sensed.board_line,
        };
        let mut working = None;
        self.heading_for = target.map(|fact| fact.point);
        if let (Some(fact), Some(position)) = (target, input.position()) {
            self.wander.end();
            let near_m = self.briefing.reach_m_of(fact.point);
            let distance_m = position.distance(fact.at);
            let slot = self
                .crew
                .task
                .filter(|_| self.briefing.has_slots(fact.point));
            if distance_m <= near_m + CERTAIN_M {
                action.work = Some(slot.map_or(fact.point, |slot| slot.0));
                working = Some(fact.point);
            }
            let works = sensed.effect == Some(fact.point);
            self.note_wait(&fact, works, distance_m, input.now);
            self.note_refusal(&fact, works, distance_m <= near_m, input.now);
            let delivers = self.laden == Some(fact.point) && distance_m > near_m / 2.0;
            if delivers || !works && !self.stands_in_crew(&fact, distance_m) {
                let (readings, now) = (input.readings, input.now);
                output.actuation = self.driver.drive_to(fact.at, near_m / 2.0, readings, now);
                if self.driver.is_blocked() {
                    self.note_blocked(&fact, position, now);
                }
            }
        } else if let Some(position) = input.position() {
            self.crew.note_wait(None, input.now);
            self.load.forget_refusal();
            output.actuation = match self.recharge.charger {
                Some(charger) => {
                    self.drive_to_charger(charger, position, input.readings, input.now)
                }
                None => self.idle(position, input.readings, input.now),
            };
        }
        self.working = working;
        if action != Action::default() {
            output.actuation.action = AnyAction::new(&action);
        }
    }

    fn shared_knowledge(&self, _: &ControllerInput<'_>, knowledge: &mut AnyKnowledge) {
        knowledge.set(&self.memory.shared_knowledge(&self.briefing, self.now));
    }

    fn is_laden(&self) -> bool {
        self.laden.is_some()
    }

    fn seconds(&self, from: Option<Vec2>, after: &[TaskId], task: TaskId) -> Option<f64> {
        let mut from = from?;
        if self.briefing.has_terms() {
            return self.seconds_in_window(from, after, task);
        }
        if let Some(last) = after.last() {
            from = self.point_of(*last, from)?.fact.at;
        }
        self.cost_s(from, self.point_of(task, from)?)
    }

    fn place(&self, from: Option<Vec2>, task: TaskId) -> Option<Vec2> {
        let known = self.point_of(task, from?)?;
        is_open(&known.fact).then_some(known.fact.at)
    }

    fn travel_s(&self, from: Option<Vec2>, task: TaskId) -> Option<f64> {
        let known = self.point_of(task, from?)?;
        is_open(&known.fact).then(|| self.drive_s(from?, known))?
    }
}

impl ServiceController {
    /// Returns the earliest start of a point's current round if each point is a task. All robots compute the same time.
    fn came_back(&self, fact: &PointFact) -> SimTime {
        let period = self.briefing.kinds[fact.kind as usize].period;
        match (self.briefing.tasks, period) {
            (TaskGranularity::Points, Some(period)) => SimTime(period.0 * u64::from(fact.round)),
            _ => SimTime::ZERO,
        }
    }
}

/// Returns the constructor of a run's controllers, which share the briefing.
pub(super) fn constructor(setup: &Setup) -> ControllerConstructor {
    let briefing = Arc::new(Briefing::from_setup(setup));
    ControllerConstructor::new(move |robot, setup| ServiceController::new(robot, setup, &briefing))
}

/// Estimates the cost of each task from the robot's start: the way and all work, for a kind its cheapest point.
pub(super) fn planned_cost_ms(setup: &Setup) -> Vec<Vec<Option<i64>>> {
    let (scenario, catalog) = (&setup.scenario, &setup.catalog);
    let briefing = Briefing::from_setup(setup);
    let points = data::points(scenario, setup.seed);
    let row = |(robot, rank): (&scenario::Robot, u32)| {
        let skills = briefing.skills(RobotId(rank), setup);
        let door = briefing.room.at(Vec2::new(0.0, 0.5));
        let start = robot.start.map_or(door, |start| start.position());
        let speed_m_s = scenario.body_of(robot).speed_m_s;
        let cost_ms = |(number, point): (u32, &data::PointSpec)| {
            let way_m = briefing.way_m(start, point.at).unwrap_or(0.0);
            let way_m = (way_m - briefing.reach_m_of(number)).max(0.0);
            let mut start_s = f64::from(way_m / speed_m_s);
            if point.opens_after > SimTime::ZERO {
                start_s = start_s.max((point.arrives + point.opens_after).as_secs_f64());
            }
            let skill = if briefing.has_slots(number) {
                1.0
            } else {
                skills[point.kind]
            };
            let work_s = point.work_s / f64::from(skill);
            (1000.0 * (start_s + work_s)) as i64
        };
        let mut row = vec![None; catalog.tasks.len()];
        for id in catalog.behaviors_of(robot) {
            let task = catalog.sets[id.index()].task.index();
            let able = |(number, point): &(u32, &data::PointSpec)| {
                let has_skill = briefing.has_slots(*number) || skills[point.kind] > 0.0;
                let has_capacity = data::fits(0.0, point.demand, robot.capacity);
                has_skill && has_capacity && briefing.way_m(start, point.at).is_some()
            };
            row[task] = match briefing.tasks {
                TaskGranularity::Points => {
                    let number = briefing.point(TaskId(task as u32));
                    let point = points.get(number as usize);
                    point.map(|point| (number, point)).filter(able).map(cost_ms)
                }
                TaskGranularity::Kinds => {
                    let points = (0..).zip(&points);
                    let of_kind = points.filter(|(_, point)| point.kind == task);
                    of_kind.filter(able).map(cost_ms).min()
                }
            };
        }
        row
    };
    scenario.robots.iter().zip(0..).map(row).collect()
}
