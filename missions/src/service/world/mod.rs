//! The world side of service: points arrive, robots within reach work on them, and points are done, expire and come
//! back.
//!
//! - `points`: all points; `point`: one of them. `board`: the announcements for robots. `log`: tables, figures and view.
//! - `limits`: points that the team cannot do. `crews`: robots that work together. `loads`: the loads of robots.
//!   `charging`: chargers.

mod board;
mod charging;
mod crews;
mod limits;
mod loads;
mod log;
mod point;
mod points;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use arrayvec::ArrayVec;
use glam::Vec2;
use proto::mission::{Action as AnyAction, SensorReading as AnyReading};
use proto::tick::Outcome;
use proto::view::View;
use rand_chacha::ChaCha8Rng;
use scenario::fault::MissionFault;
use scenario::ids::{RobotId, TaskId};
use scenario::rng::{Purpose, robot_stream};
use scenario::time::SimTime;
use scenario::{Problem, Setup};
use serde::Serialize;
use world_server::mission::{
    FigureValue, MissionWorld, StepEvents, TeamFigures, Validity, hash_state,
};
use world_server::world::{ChangeError, Floor, Places};

use super::bus::{Action, MAX_SENSED, PointFact, SensorReading};
use super::data::{self, DEADLOCKS, KnowledgeSource, PointSpec, ServiceSection, TaskGranularity};
use board::{Board, BoardFilter};
use charging::Stations;
use crews::{Crews, Gathered, Gathering, Member};
use limits::TeamLimits;
use log::Log;
use points::{Change, Points};

#[derive(Clone, Serialize)]
pub struct Service {
    #[serde(skip)]
    constants: Arc<Constants>,
    points: Points,
    board: Board,
    robots: Vec<Robot>,
    #[serde(skip_serializing_if = "Stations::is_empty")]
    stations: Stations,
    /// The number of workers per point in the current step. 0 between steps.
    #[serde(skip)]
    workers_on: Vec<u32>,
    /// The robots at points with slots in the current step. Empty between steps.
    #[serde(skip)]
    gathering: Gathering,
    #[serde(skip)]
    log: Log,
}

#[derive(Debug)]
struct Constants {
    section: ServiceSection,
    seed: u64,
    step_s: f64,
    step: SimTime,
    /// The points that the team cannot do, if points state properties.
    limits: Option<TeamLimits>,
    skills: Vec<Vec<f64>>,
    /// The capacity of each robot; `None` carries any load.
    capacities: Vec<Option<f64>>,
    readers: Vec<BoardFilter>,
    crews: Crews,
}

#[derive(Clone, Debug, Default, Serialize)]
struct Robot {
    /// The last board line that the robot has acknowledged.
    read: u32,
    worked: Option<u32>,
    /// The robot's own attempt, for kinds whose unfinished work is lost: the round of the point, and the work left, s
    /// at skill 1.
    attempt: (u32, f64),
    #[serde(skip)]
    works: Option<u32>,
    /// The point whose load the robot carries.
    #[serde(skip_serializing_if = "Option::is_none")]
    load: Option<u32>,
    /// The sum of the demands that the robot has taken for the rest of the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    taken: Option<f64>,
}

impl Constants {
    fn new(setup: &Setup, specs: &[PointSpec], floor: &Floor) -> Self {
        let (scenario, catalog) = (&setup.scenario, &setup.catalog);
        let section = ServiceSection::of(scenario).clone();
        let skills = scenario.robots.iter().map(|robot| {
            let kinds = section.kinds.iter();
            kinds
                .map(|kind| robot.skill(&kind.name).unwrap_or(1.0))
                .collect()
        });
        let crews = Crews::new(setup);
        let readers = scenario.robots.iter().map(|robot| {
            let tasks = catalog.behaviors_of(robot);
            let tasks: Vec<u32> = tasks.map(|id| catalog.sets[id.index()].task.0).collect();
            if tasks.len() == catalog.tasks.len() {
                return BoardFilter::All;
            }
            let points = tasks.iter().map(|task| crews.place(*task).0);
            BoardFilter::new(section.tasks, points.collect())
        });
        let has_properties = section.has_properties() || !section.chargers.is_empty();
        let limits = has_properties.then(|| {
            let robots = (0..floor.robot_count() as u32).map(RobotId);
            let starts: Vec<Vec2> = robots.map(|robot| floor.pose(robot).position).collect();
            TeamLimits::new(setup, specs, &starts)
        });
        Self {
            limits,
            step: SimTime(scenario.step_ms),
            skills: skills.collect(),
            capacities: scenario.robots.iter().map(|robot| robot.capacity).collect(),
            readers: readers.collect(),
            crews,
            seed: setup.seed,
            step_s: scenario.step_ms as f64 / 1000.0,
            section,
        }
    }
}

impl Service {
    /// Logs and announces a change of a point.
    fn changed(&mut self, point: u32, change: Change, floor: &Floor, happened: &mut StepEvents) {
        let now = floor.now();
        self.log
            .add(&self.points, point, change, None, now, happened);
        self.announce(point, floor);
    }

    /// Announces a change of a point: on the board, or by invalidating the readings of robots in sight.
    fn announce(&mut self, point: u32, floor: &Floor) {
        match self.constants.section.known {
            KnowledgeSource::All => {
                self.board.write(point);
                let robots = (0..floor.robot_count() as u32).map(RobotId);
                robots.for_each(|robot| floor.invalidate_readings(robot));
            }
            KnowledgeSource::Sight => {
                floor.invalidate_readings_near(
                    self.points.at(point),
                    self.constants.section.sight_m,
                );
            }
        }
    }

    /// Lets a robot join the crew of a point, if it is within reach.
    fn fill(&mut self, robot: RobotId, point: u32, slot: usize, floor: &Floor) {
        let crews = &self.constants.crews;
        let distance = floor.pose(robot).position.distance(self.points.at(point));
        let is_open = self.points.open_kind(point).is_some();
        let is_in_window = floor.now() >= self.points.opens(point);
        let slots = crews.slots.of_point(point).len();
        let reach_m = match slots {
            1 => self.constants.section.reach_m,
            _ => crews.reach_m,
        };
        if !is_open || !is_in_window || distance > reach_m {
            return;
        }
        let has_worked = self.robots[robot.index()].worked == Some(point);
        let member = Member {
            robot,
            slot,
            has_worked,
        };
        self.gathering.add(point, member);
    }

    /// Lets the complete crews of a step work. A crew works at the pace of its slowest robot.
    fn work_together(&mut self, floor: &mut Floor, happened: &mut StepEvents) {
        if self.constants.crews.slots.is_empty() {
            return;
        }
        let constants = Arc::clone(&self.constants);
        let Gathered {
            complete,
            surplus,
            waits,
        } = self.gathering.take(&constants.crews);
        for robot in surplus {
            self.log.surplus_step(robot);
        }
        let now = floor.now();
        let mut robots = (0..floor.robot_count() as u32).map(RobotId);
        let is_stuck = waits
            && self.robots.iter().all(|robot| robot.works.is_none())
            && complete.is_empty()
            && robots.all(|robot| floor.speed_m_s(robot) == 0.0);
        if self.log.deadlocks.record(is_stuck, now) {
            happened.push_mission_event("deadlock", None);
        }
        for (point, crew) in complete {
            let mut pace = f64::INFINITY;
            for (slot, &robot) in crew.iter().enumerate() {
                let (skill, name) = constants.crews.skill(robot, point, slot);
                pace = pace.min(skill * floor.apply_skill(robot, name));
                let worker = &mut self.robots[robot.index()];
                if worker.worked != Some(point) {
                    happened.push_mission_event("begun", Some(robot)).subject = format!("p{point}");
                }
                worker.works = Some(point);
                self.log.work_step(robot);
            }
            let (_, arrived) = self.points.work_and_arrival(point);
            self.log.record_wait(point, now.since(arrived));
            let quarters = self.points.quarters_left(point);
            if self
                .points
                .reduce_work(point, pace * constants.step_s, now + constants.step)
            {
                let change = self.points.finish(point, now);
                let first = crew.first().copied();
                let event = self
                    .log
                    .add(&self.points, point, change, first, now, happened);
                event.detail += &format!(", by {}", constants.crews.names(&crew));
                self.announce(point, floor);
            } else if self.points.quarters_left(point) != quarters {
                // The robots measure the progress of a crew by the facts, because its pace depends on all of them.
                self.announce(point, floor);
            }
        }
    }

    /// Lets a robot work on a point, if it is within reach and has the skill and the capacity.
    fn work(&mut self, robot: RobotId, point: u32, floor: &mut Floor, happened: &mut StepEvents) {
        let constants = Arc::clone(&self.constants);
        let Some(kind) = self.points.open_kind(point) else {
            return;
        };
        if self.points.carrier(point).is_some() {
            self.deliver(robot, point, floor, happened);
            return;
        }
        let distance = floor.pose(robot).position.distance(self.points.at(point));
        let skill = constants.skills[robot.index()][kind];
        let spec = &constants.section.kinds[kind];
        let can_take = self.has_capacity(robot, self.points.spec(point).demand);
        if distance > constants.section.reach_m || skill <= 0.0 || !can_take {
            return;
        }
        let (now, opens) = (floor.now(), self.points.opens(point));
        if now < opens {
            // The robot waits at its place.
            let attempt = (
                self.points.round(point),
                self.points.work_and_arrival(point).0,
            );
            let worker = &mut self.robots[robot.index()];
            (worker.works, worker.attempt) = (Some(point), attempt);
            return;
        }
        self.drop_load(robot, floor, happened);
        let workers = &mut self.workers_on[point as usize];
        *workers += 1;
        if *workers <= spec.workers {
            self.log.work_step(robot);
        } else {
            self.log.surplus_step(robot);
            if spec.kept {
                return;
            }
        }
        let worker = &mut self.robots[robot.index()];
        worker.works = Some(point);
        let is_new =
            worker.worked != Some(point) || self.points.opens_in(point, now, constants.step);
        if is_new {
            happened.push_mission_event("begun", Some(robot)).subject = format!("p{point}");
        }
        let (_, arrived) = self.points.work_and_arrival(point);
        self.log.record_wait(point, floor.now().since(arrived));
        let quarters = self.points.quarters_left(point);
        let skill = skill * floor.apply_skill(robot, &spec.name);
        let work_s = skill * constants.step_s;
        let is_done = if spec.kept {
            self.points.reduce_work(point, work_s, now + constants.step)
        } else {
            let round = self.points.round(point);
            if is_new || worker.attempt.0 != round {
                worker.attempt = (round, self.points.work_and_arrival(point).0);
            }
            worker.attempt.1 -= work_s;
            self.points
                .attempt(point, worker.attempt.1, now + constants.step)
        };
        if is_done && self.points.spec(point).deliver_to.is_some() {
            self.points.pick_up(point, robot);
            self.robots[robot.index()].load = Some(point);
            let event = happened.push_mission_event("picked-up", Some(robot));
            event.subject = format!("p{point}");
            if self.points.spec(point).demand > 0.0 {
                event.detail = format!("load {}", self.load_of(robot));
            }
            self.announce(point, floor);
        } else if is_done {
            let now = floor.now();
            let change = self.points.finish(point, now);
            let event = self
                .log
                .add(&self.points, point, change, Some(robot), now, happened);
            let demand = self.points.spec(point).demand;
            if demand > 0.0 {
                *self.robots[robot.index()].taken.get_or_insert(0.0) += demand;
                event.detail += &format!(", load {}", self.load_of(robot));
            }
            self.announce(point, floor);
        } else if self.points.quarters_left(point) != quarters
            && constants.section.known == KnowledgeSource::Sight
        {
            floor.invalidate_readings_near(self.points.at(point), constants.section.sight_m);
        }
    }

    /// Returns the visible points in the robot's own frame, nearest first.
    fn in_sight(&self, robot: RobotId, floor: &Floor) -> ArrayVec<PointFact, MAX_SENSED> {
        let (position, ahead) = (floor.pose(robot).position, floor.ahead(robot));
        let near = self
            .points
            .open_near(position, self.constants.section.sight_m);
        near.iter()
            .map(|&(_, point)| {
                let offset = self.points.at(point) - position;
                let at = Vec2::new(ahead.dot(offset), ahead.perp_dot(offset));
                PointFact {
                    at,
                    ..self.points.fact(point)
                }
            })
            .collect()
    }
}

impl MissionWorld for Service {
    fn new(setup: &Setup, floor: &Floor) -> Self {
        let specs = data::points(&setup.scenario, setup.seed);
        let constants = Arc::new(Constants::new(setup, &specs, floor));
        let points = Points::new(&constants.section, specs, floor.room());
        Self {
            robots: vec![Robot::default(); floor.robot_count()],
            workers_on: vec![0; points.len()],
            gathering: Gathering::default(),
            board: Board::default(),
            stations: Stations::new(&setup.scenario),
            log: Log::new(floor.robot_count(), constants.step_s),
            points,
            constants,
        }
    }

    fn begin(&mut self, floor: &mut Floor, happened: &mut StepEvents) {
        while let Some((point, change)) = self.points.next_change(floor.now()) {
            for robot in &mut self.robots {
                // The load of an expired point is gone.
                robot.load = robot
                    .load
                    .filter(|load| change != Change::Expired || *load != point);
            }
            self.changed(point, change, floor, happened);
        }
    }

    fn act(
        &mut self,
        robot: RobotId,
        action: &AnyAction,
        floor: &mut Floor,
        happened: &mut StepEvents,
    ) {
        let Some(action) = action.value::<Action>() else {
            return;
        };
        let reader = &mut self.robots[robot.index()];
        if let Some(read) = action.read.filter(|read| *read > reader.read) {
            reader.read = read.min(self.board.latest());
            floor.invalidate_readings(robot);
        }
        if let Some(task) = action.work {
            match self.constants.crews.place(task) {
                (point, Some(slot)) => self.fill(robot, point, slot, floor),
                (point, None) => self.work(robot, point, floor, happened),
            }
        }
    }

    /// Records a robot that has stopped working as leaving, unless the point is over.
    fn settle(&mut self, floor: &mut Floor, happened: &mut StepEvents) {
        self.work_together(floor, happened);
        for rank in 0..self.robots.len() {
            let robot = RobotId(rank as u32);
            self.log.moved(robot, floor.speed_m_s(robot));
            let worker = &mut self.robots[rank];
            let (before, now) = (worker.worked, worker.works.take());
            worker.worked = now;
            if before != now {
                floor.invalidate_readings(robot);
            }
            let is_carried = |point: &u32| self.points.carrier(*point).is_some();
            let left = before.filter(|before| Some(*before) != now && !is_carried(before));
            let Some(left) = left else {
                continue;
            };
            let has_worked = self.points.was_open(left, floor.now(), self.constants.step);
            if let Some(kind) = self.points.open_kind(left).filter(|_| has_worked) {
                happened.push_mission_event("left", Some(robot)).subject = format!("p{left}");
                if !self.constants.section.kinds[kind].kept {
                    self.points.start_over(left);
                }
            }
        }
        let is_free = |robot: RobotId| self.robots[robot.index()].worked.is_none();
        self.stations
            .charge(self.constants.step_s, is_free, floor, happened);
        for robot in &self.robots {
            let Some(point) = robot.worked else { continue };
            self.workers_on[point as usize] = 0;
            let kind = self.points.open_kind(point);
            let is_alone = self.constants.crews.slots.of_point(point).is_empty();
            if is_alone && kind.is_some_and(|kind| !self.constants.section.kinds[kind].kept) {
                self.points
                    .attempt(point, robot.attempt.1, floor.now() + self.constants.step);
            }
        }
    }

    fn sense(&self, robot: RobotId, floor: &Floor, sensed: &mut AnyReading) -> Validity {
        let state = &self.robots[robot.index()];
        let (points, board_line) = match self.constants.section.known {
            KnowledgeSource::All => {
                let reader = &self.constants.readers[robot.index()];
                let news = self.board.new_facts(reader, &self.points, state.read);
                (news.facts, (news.upto > state.read).then_some(news.upto))
            }
            KnowledgeSource::Sight => (self.in_sight(robot, floor), None),
        };
        *sensed.value_mut() = SensorReading {
            points: Some(points),
            board_line,
            effect: state.worked.or(state.load),
        };
        Validity::UntilChange
    }

    /// Loses the load of the robot, and resets the board position: the next incarnation of the robot has read nothing.
    fn release_load(&mut self, robot: RobotId, floor: &mut Floor, happened: &mut StepEvents) {
        self.drop_load(robot, floor, happened);
        self.robots[robot.index()].read = 0;
        floor.invalidate_readings(robot);
    }

    /// Adds a point now.
    fn change(
        &mut self,
        fault: &MissionFault,
        floor: &mut Floor,
    ) -> Option<Result<String, ChangeError>> {
        // The order was checked before: only values with a default may be missing.
        let number = |key| fault.get(key).unwrap_or(0.0);
        let section = &self.constants.section;
        let kind = fault
            .get_name("kind")
            .map_or(Some(0), |name| section.kind_named(name));
        let refused = |why: String| Some(Err(ChangeError::Mission(why)));
        let Some(kind) = kind else {
            return refused("there is no such kind of work".to_owned());
        };
        if self.points.len() >= section.max_points() {
            return refused(match section.tasks {
                TaskGranularity::Points => {
                    format!("all {} tasks of service.spare are in use", section.spare)
                }
                TaskGranularity::Kinds => format!("there are {} points", self.points.len()),
            });
        }
        let at = Vec2::new(number("x_m") as f32, number("y_m") as f32);
        if !floor.can_be_worked_on(at, section.reach_m) {
            return refused(format!("no robot can work at ({}, {})", at.x, at.y));
        }
        // The streams of robots are unused here, so the point's number selects one.
        let mut rng: ChaCha8Rng = robot_stream(
            self.constants.seed,
            Purpose::Mission,
            RobotId(self.points.len() as u32),
        );
        let spec = PointSpec::drawn(&section.kinds, kind, at, floor.now(), &mut rng);
        let point = self.points.add(spec);
        self.workers_on.push(0);
        Some(Ok(format!("p{point} {} {}", at.x, at.y)))
    }

    fn refuse_order(
        &self,
        fault: &MissionFault,
        times: u64,
        ordered: &[(&MissionFault, u64)],
        places: &Places,
    ) -> Option<Problem> {
        let (section, points) = (&self.constants.section, self.points.len());
        data::refuse_order(section, points, fault, times, ordered, places)
    }

    fn copy_device(&self, device: &str, from: &AnyReading, to: &mut AnyReading) {
        let from = from.value::<SensorReading>();
        let to = to.value_mut::<SensorReading>();
        match device {
            "points" => {
                to.points.clone_from(&from.points);
                to.board_line = from.board_line;
            }
            "effect" => to.effect = from.effect,
            _ => {}
        }
    }

    /// Adds errors to visible points. The board contains no measurements.
    fn add_error(&self, device: &str, sensed: &mut AnyReading, error_m: &mut dyn FnMut() -> f32) {
        if device != "points" || self.constants.section.known == KnowledgeSource::All {
            return;
        }
        if let Some(points) = &mut sensed.value_mut::<SensorReading>().points {
            for fact in points.iter_mut() {
                fact.at.x += error_m();
                fact.at.y += error_m();
            }
            points.sort_by(|a, b| a.at.length_squared().total_cmp(&b.at.length_squared()));
        }
    }

    fn end(&self, _: SimTime) -> Option<Outcome> {
        self.points.outcome()
    }

    fn has_work(&self, task: TaskId, _: RobotId, _: &Floor) -> bool {
        match self.constants.section.tasks {
            TaskGranularity::Points => {
                let (point, _) = self.constants.crews.place(task.0);
                self.points.open_kind(point).is_some()
            }
            TaskGranularity::Kinds => self.points.open_of_kind(task.index()) > 0,
        }
    }

    fn row(&self, row: &mut Vec<FigureValue>) {
        self.points.write_row(row);
    }

    fn state_hash(&self) -> u64 {
        hash_state(self)
    }

    fn figures(&self, figures: &mut TeamFigures) {
        let limits = self.constants.limits.as_ref();
        self.points.write_figures(limits, figures);
        if !self.constants.crews.slots.is_empty() {
            figures.mission.add(DEADLOCKS, self.log.deadlocks.count);
        }
        let is_complete = self.points.outcome() == Some(Outcome::Complete);
        self.log.write_figures(is_complete, figures);
    }

    fn add_to_view(&self, floor: &Floor, view: &mut View) {
        let section = &self.constants.section;
        self.points.show(section, floor.now(), view);
        log::show_chargers(&section.chargers, view);
        if section.known == KnowledgeSource::Sight {
            log::show_sensed(view);
        }
    }

    fn check_invariants(&self, _: &Floor) -> Result<(), String> {
        self.points.holds()?;
        self.check_loads()?;
        match self.workers_on.iter().position(|workers| *workers != 0) {
            None => Ok(()),
            Some(point) => Err(format!("p{point} has workers between steps")),
        }
    }
}
