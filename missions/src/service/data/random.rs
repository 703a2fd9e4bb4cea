//! Random service missions (`[random_mission] mission = "service"`). They cover every key of the section except `costs`
//! and demands, which in-process/tests/service_laws covers. Half of them have points with properties, such as windows and
//! needs, and a quarter has chargers.

use std::collections::BTreeMap;
use std::ops::Range;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use scenario::mission::section::MissionSection;
use scenario::{Energy, Scenario};

use super::check::beyond_the_team;
use super::room::has_room;
use super::{
    Charger, CostMeasure, Interval, Kind, KnowledgeSource, Point, RandomPoints, SERVICE,
    ServiceSection, TaskGranularity,
};

/// The latest arrival time, s.
const LAST_S: f64 = 240.0;
const SOME: f64 = 0.25;
const LACKED: f64 = 0.3;
/// The batteries of missions with chargers. They last for 50 s to 200 s.
const ENERGY: Energy = Energy {
    capacity_j: 1000.0,
    idle_w: 5.0,
    drive_w: 15.0,
};

/// Writes a random section and random skills into a scenario.
pub(super) fn draw_section(scenario: &mut Scenario, rng: &mut ChaCha8Rng) {
    let mut dice = Dice(rng);
    let count = dice.0.random_range(1..=4);
    let reach_m = match dice.0.random_range(0..8) {
        0 => 1000.0,
        _ => dice.between(0.25..1.5) as f32,
    };
    let kinds: Vec<Kind> = (1..=count).map(|number| dice.kind(number)).collect();
    let periodic = kinds.iter().any(|kind| kind.period_s.is_some());
    // A robot must be able to stand at each point.
    let radius_m = f64::from(scenario.body.radius_m);
    let (low, high) = (scenario.room.low(), scenario.room.high());
    let along = |low: f32, high: f32| f64::from(low) + radius_m..f64::from(high) - radius_m;
    let (along_x, along_y) = (along(low.x, high.x), along(low.y, high.y));
    let points = (0..dice.0.random_range(0..6)).map(|_| Point {
        kind: dice.name_of(&kinds),
        x_m: dice.between(along_x.clone()) as f32,
        y_m: dice.between(along_y.clone()) as f32,
        arrival_s: dice.maybe(0.0..LAST_S).unwrap_or(0.0),
        work_s: dice.maybe(1.0..20.0),
        ..Point::default()
    });
    let points = points.collect();
    let random = (0..dice.0.random_range(1..=3)).map(|_| RandomPoints {
        n: dice.0.random_range(1..=12),
        kind: dice.0.random_bool(0.5).then(|| dice.name_of(&kinds)),
        at_s: dice.maybe(0.0..LAST_S).unwrap_or(0.0),
        rate_hz: dice.maybe(0.02..1.0).unwrap_or(0.0),
    });
    let random = random.collect();
    let mut section = ServiceSection {
        tasks: dice.either(TaskGranularity::Points, TaskGranularity::Kinds),
        known: dice.either(KnowledgeSource::All, KnowledgeSource::Sight),
        reach_m,
        sight_m: dice.between(1.0..6.0) as f32,
        spare: dice.0.random_range(0..6),
        duration_s: (periodic || dice.0.random_bool(SOME)).then_some(LAST_S),
        uncovered: false,
        costs: CostMeasure::Line,
        coalition_wait_s: None,
        reserve: None,
        chargers: Vec::new(),
        kinds,
        points,
        random,
    };
    for kind in &mut section.kinds {
        let fits = |workers: &u32| has_room(scenario, reach_m, *workers);
        // One robot always has room.
        kind.workers = (1..=kind.workers).rev().find(fits).unwrap_or(1);
    }
    if dice.0.random_bool(0.5) {
        dice.add_properties(&mut section, [along_x.clone(), along_y.clone()]);
    }
    if dice.0.random_bool(SOME) {
        scenario.energy = Some(ENERGY);
        section.reserve = dice.maybe(0.2..0.6);
        section.chargers = dice.chargers([along_x, along_y]);
    }
    // A kind without points may have no task.
    let sure: Vec<usize> = section.kinds_of_points().collect();
    for robot in &mut scenario.robots {
        robot.skills = Some(dice.skills(&section.kinds, &sure));
    }
    scenario.mission = MissionSection::new(SERVICE, section.clone());
    section.uncovered = beyond_the_team(scenario).next().is_some();
    scenario.mission = MissionSection::new(SERVICE, section);
}

struct Dice<'a>(&'a mut ChaCha8Rng);

impl Dice<'_> {
    fn kind(&mut self, number: usize) -> Kind {
        let min = self.between(1.0..10.0);
        Kind {
            name: format!("k{number}"),
            work_s: Interval {
                min,
                max: min + self.maybe(0.0..20.0).unwrap_or(0.0),
            },
            workers: self.0.random_range(1..=3),
            kept: self.0.random_bool(0.5),
            deadline_s: self.maybe(20.0..120.0).map(|min| Interval {
                min,
                max: min + 60.0,
            }),
            period_s: self.maybe(20.0..120.0),
        }
    }

    /// Adds windows, values, priorities, precedence, needs and deliveries to stated points.
    fn add_properties(
        &mut self,
        section: &mut ServiceSection,
        [along_x, along_y]: [Range<f64>; 2],
    ) {
        let kinds = section.kinds.clone();
        let comes_back = |name: &str| {
            let kind = kinds.iter().find(|kind| kind.name == name);
            kind.is_some_and(|kind| kind.period_s.is_some())
        };
        let mut in_order: Vec<String> = Vec::new();
        for (number, point) in section.points.iter_mut().enumerate() {
            point.opens_s = self.maybe(0.0..60.0);
            let open_s = self.maybe(10.0..120.0);
            point.deadline_s = open_s.map(|open_s| point.opens_s.unwrap_or(0.0) + open_s);
            point.value = self.maybe(0.0..20.0);
            let priority = self.0.random_range(-3..=3);
            point.priority = self.0.random_bool(SOME).then_some(priority);
            if !comes_back(&point.kind) {
                point.after = in_order.clone();
                point.after.retain(|_| self.0.random_bool(SOME));
                in_order.push(format!("p{number}"));
            }
            if section.tasks == TaskGranularity::Points && self.0.random_bool(SOME) {
                let needs = kinds.iter().filter(|_| self.0.random_bool(0.5));
                point.needs = needs.map(|kind| (kind.name.clone(), 1)).collect();
                let copies = self.0.random_range(1..=2);
                point.needs.insert(point.kind.clone(), copies);
            } else if !comes_back(&point.kind) && self.0.random_bool(SOME) {
                let (x_m, y_m) = (self.between(along_x.clone()), self.between(along_y.clone()));
                point.deliver_to = Some([x_m as f32, y_m as f32]);
            }
        }
    }

    fn chargers(&mut self, [along_x, along_y]: [Range<f64>; 2]) -> Vec<Charger> {
        let chargers = (0..self.0.random_range(1..=2)).map(|_| Charger {
            x_m: self.between(along_x.clone()) as f32,
            y_m: self.between(along_y.clone()) as f32,
            rate_w: self.between(20.0..100.0),
            slots: 1,
        });
        chargers.collect()
    }

    /// Draws the skills of a robot. At least one skill is of a kind with points.
    fn skills(&mut self, kinds: &[Kind], sure: &[usize]) -> BTreeMap<String, f64> {
        let required = sure[self.0.random_range(0..sure.len())];
        let mut skills = BTreeMap::new();
        for (index, kind) in kinds.iter().enumerate() {
            let skill = self.between(0.2..2.0);
            if index == required || !self.0.random_bool(LACKED) {
                skills.insert(kind.name.clone(), skill);
            }
        }
        skills
    }

    fn name_of(&mut self, kinds: &[Kind]) -> String {
        kinds[self.0.random_range(0..kinds.len())].name.clone()
    }

    fn either<T>(&mut self, one: T, other: T) -> T {
        if self.0.random_bool(0.5) { one } else { other }
    }

    fn maybe(&mut self, range: Range<f64>) -> Option<f64> {
        self.0.random_bool(SOME).then(|| self.between(range))
    }

    /// Draws a number, rounded down to two decimals so that scenario files stay readable.
    fn between(&mut self, range: Range<f64>) -> f64 {
        let value: f64 = self.0.random_range(range.clone());
        ((value * 100.0).floor() / 100.0).max(range.start)
    }
}
