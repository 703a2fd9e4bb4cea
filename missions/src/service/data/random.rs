//! Random service missions (`[random_mission] mission = "service"`). They cover every key of the section except the
//! properties of points, `costs` and the chargers, which in-process/tests/service_laws covers.

use std::collections::BTreeMap;
use std::ops::Range;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use scenario::Scenario;
use scenario::mission::section::MissionSection;

use super::check::covered;
use super::room::has_room;
use super::{
    CostMeasure, Interval, Kind, KnowledgeSource, Point, RandomPoints, SERVICE, ServiceSection,
    TaskGranularity,
};

/// The latest arrival time, s.
const LAST_S: f64 = 240.0;
const SOME: f64 = 0.25;
const LACKED: f64 = 0.3;

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
    let along = |size_m: f32| radius_m..f64::from(size_m) - radius_m;
    let (along_x, along_y) = (along(scenario.room.width_m), along(scenario.room.height_m));
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
    // A kind without points may have no task.
    let sure: Vec<usize> = section.kinds_of_points().collect();
    for robot in &mut scenario.robots {
        robot.skills = Some(dice.skills(&section.kinds, &sure));
    }
    scenario.mission = MissionSection::new(SERVICE, section.clone());
    section.uncovered = covered(scenario).is_err();
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
