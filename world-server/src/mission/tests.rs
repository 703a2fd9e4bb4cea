//! An example of a custom mission's world side: places to be touched once.

use proto::mission::Bytes;
use proto::readings::Actuation;
use proto::view::{Mark, MarkOutline, MarkRole, Work};
use scenario::testkit::{DRILL, default_setup, unlike_robots};
use scenario::{Robot, Start};
use serde::{Deserialize, Serialize};

use super::*;
use crate::world::World;

const BLUE: RobotId = RobotId(0);

const REACH_M: f32 = 0.3;

const VISIT: MissionWorld = MissionWorld::typed::<Visit>(DRILL);

/// The visited flags are the state; the places never change.
#[derive(Clone, Serialize)]
struct Visit {
    #[serde(skip)]
    places: Vec<Vec2>,
    visited: Vec<bool>,
    #[serde(skip)]
    visits: Vec<u32>,
}

/// The nearest place that is not visited yet.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
struct Near {
    place: Option<(u32, Vec2)>,
}

#[derive(Serialize, Deserialize)]
enum Touch {
    Place(u32),
}

impl TypedMission for Visit {
    type Reading = Near;
    type Action = Touch;

    fn new(_: &Setup, floor: &Floor) -> Self {
        Self {
            places: vec![Vec2::new(3.0, 2.0), Vec2::new(5.0, 2.0)],
            visited: vec![false; 2],
            visits: vec![0; floor.robot_count()],
        }
    }

    fn act(
        &mut self,
        robot: RobotId,
        Touch::Place(place): Touch,
        floor: &mut Floor,
        happened: &mut StepEvents,
    ) {
        let index = place as usize;
        let Some(at) = self.places.get(index) else {
            return;
        };
        if at.distance(floor.pose(robot).position) <= REACH_M && !self.visited[index] {
            self.visited[index] = true;
            self.visits[robot.index()] += 1;
            happened.push_mission_event("visited", Some(robot)).subject = format!("place-{place}");
            // Readings with this place are no longer valid.
            floor.invalidate_readings_near(*at, floor.size().length());
        }
    }

    fn sense(&self, robot: RobotId, floor: &Floor) -> (Near, Validity) {
        let position = floor.pose(robot).position;
        let places = (0..).zip(&self.places).zip(&self.visited);
        let open = places.filter(|(_, visited)| !**visited);
        let open = open.map(|((place, at), _)| (place, *at - position));
        let place = open.min_by(|a, b| a.1.length().total_cmp(&b.1.length()));
        (Near { place }, Validity::UntilChange)
    }

    fn end(&self, _now: SimTime) -> Option<Outcome> {
        let all = self.visited.iter().all(|visited| *visited);
        all.then_some(Outcome::Complete)
    }

    fn row(&self, row: &mut Vec<FigureValue>) {
        let visited = self.visited.iter().filter(|visited| **visited).count() as u64;
        row.extend([visited, self.places.len() as u64 - visited].map(FigureValue::from));
    }

    fn figures(&self, figures: &mut TeamFigures) {
        for (figures, visits) in figures.robots.iter_mut().zip(&self.visits) {
            figures.add("visits", *visits);
        }
    }

    fn add_to_view(&self, _floor: &Floor, view: &mut View) {
        for (id, (center, visited)) in self.places.iter().zip(&self.visited).enumerate() {
            view.mark(Mark {
                id: format!("place-{id}"),
                outline: MarkOutline::Disc {
                    center: *center,
                    radius_m: REACH_M,
                },
                role: MarkRole::Target,
                work: Work::left_or_done(!visited),
                label: String::new(),
            });
        }
    }
}

fn world() -> World {
    let mut setup = default_setup(1);
    setup.scenario.robots = vec![Robot {
        name: "blue".to_owned(),
        start: Some(Start {
            x_m: 1.0,
            y_m: 2.0,
            heading_deg: 0.0,
        }),
        ..Robot::default()
    }];
    World::new(&setup, VISIT)
}

fn sensed(world: &World) -> Near {
    match world.readings(BLUE).mission {
        SensorReading::Open(bytes) => bytes.decode().unwrap(),
        other => panic!("{other:?}"),
    }
}

fn touch(place: u32) -> Actuation {
    Actuation {
        speed_m_s: 0.5,
        action: Action::Open(Bytes::encode(&Touch::Place(place)).unwrap()),
        ..Actuation::default()
    }
}

#[test]
fn both_places_are_visited_and_the_mission_ends() {
    let mut world = world();
    assert_eq!(sensed(&world).place, Some((0, Vec2::new(2.0, 0.0))));
    let start = world.mission().state_hash();
    let mut rows = Vec::new();
    while world.mission().end(world.now()).is_none() {
        assert!(world.now() < SimTime(20_000));
        let (place, _) = sensed(&world).place.unwrap();
        let events = world.step(&[Some(touch(place))]);
        let events = events.iter();
        rows.extend(events.map(|event| format!("{} {}", event.kind, event.subject)));
    }
    assert_eq!(rows, ["visited place-0", "visited place-1"]);
    assert_eq!(sensed(&world), Near::default());
    assert_ne!(world.mission().state_hash(), start);
    let mut row = Vec::new();
    world.mission().row(&mut row);
    assert_eq!(row, [FigureValue::Count(2), FigureValue::Count(0)]);
    let mut figures = TeamFigures::new(1);
    world.mission().figures(&mut figures);
    assert_eq!(figures.robots[0].count("visits"), 2);
    let mut view = View::default();
    world.mission().add_to_view(&world, &mut view);
    assert_eq!(view.marks[1].work, Work::left_or_done(false));
}

#[test]
fn an_invalid_action_does_nothing() {
    let mut world = world();
    for action in [
        Action::Open(Bytes::encode(&9_u32).unwrap()),
        Action::Nothing,
    ] {
        let actuation = Actuation {
            action,
            ..Actuation::default()
        };
        assert_eq!(world.step(&[Some(actuation)]), []);
    }
}

/// Checks the data that `new` and every step of a mission receive.
#[test]
fn a_mission_receives_the_abilities_of_each_robot() {
    let setup = unlike_robots();
    let world = World::new(&setup, VISIT);
    let able = |robot: u16| {
        let spec = &setup.scenario.robots[usize::from(robot)];
        let body = world.body_of(RobotId(robot));
        let driving = (body.speed_m_s, body.push_m_s, body.turn_deg_s);
        (driving, spec.has_device("horn"), spec.skill("lift"))
    };
    assert_eq!(able(0), ((0.5, 0.3, 90.0), true, Some(2.0)));
    assert_eq!(able(1), ((0.25, 0.1, 45.0), false, Some(0.0)));
}
