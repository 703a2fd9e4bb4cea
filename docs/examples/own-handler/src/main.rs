//! An interruption handler without agents: a door that opens and closes periodically.
//!
//! `cargo run -p own-handler`

use missions::waste::data::default_scenario;
use proto::readings::Actuation;
use run_log::recorder::{Event, EventKind, FaultEvent};
use scenario::ids::RobotId;
use scenario::time::SimTime;
use scenario::{Obstacle, Robot, Scenario, Setup, Start};
use world_server::interruption::InterruptionHandler;
use world_server::world::{ObstacleId, World};

/// A door that opens and closes once per `period`.
#[derive(Clone)]
struct Door {
    period: SimTime,
    leaf: Obstacle,
    closed: Option<ObstacleId>,
    due: SimTime,
}

impl InterruptionHandler for Door {
    fn trigger_event(&mut self, now: SimTime, world: &mut World) -> Vec<Event> {
        if now < self.due {
            return Vec::new();
        }
        self.due = self.due + self.period;
        let kind = match self.closed.take() {
            Some(leaf) => {
                world.remove_obstacle(leaf);
                FaultEvent::Healed
            }
            None => {
                self.closed = Some(world.add_obstacle(&self.leaf));
                FaultEvent::Applied
            }
        };
        vec![Event {
            subject: "door".to_owned(),
            ..Event::new(EventKind::Fault(kind), None)
        }]
    }
}

fn main() {
    for line in play() {
        println!("{line}");
    }
}

/// Returns the events of the first ten seconds, one line per event.
fn play() -> Vec<String> {
    let mut lines = Vec::new();
    let blue = RobotId(0);
    let scenario = Scenario {
        robots: vec![Robot {
            name: "blue".to_owned(),
            start: Some(Start {
                x_m: 1.0,
                y_m: 4.5,
                heading_deg: 0.0,
            }),
            ..Robot::default()
        }],
        ..default_scenario()
    };
    let setup = match Setup::resolve(scenario, 1, None) {
        Ok(resolved) => resolved.setup,
        Err(error) => panic!("{error}"),
    };
    let mut world = World::new(&setup, missions::waste::MISSION.world);
    let mut door = Door {
        period: SimTime(5000),
        leaf: Obstacle {
            x_m: 3.0,
            y_m: 4.0,
            width_m: 0.1,
            height_m: 1.0,
            penetrability: 0.0,
        },
        closed: None,
        due: SimTime(2000),
    };
    let ahead = Some(Actuation {
        speed_m_s: 0.5,
        ..Actuation::default()
    });
    for _ in 0..200 {
        let now = world.now();
        for event in door.trigger_event(now, &mut world) {
            let x_m = world.pose(blue).position.x;
            lines.push(format!(
                "{now}: {} {}, blue at x = {x_m} m",
                event.subject, event.kind
            ));
        }
        world.step(&[ahead]);
    }
    let x_m = world.pose(blue).position.x;
    lines.push(format!("{}: blue at x = {x_m} m", world.now()));
    lines
}

#[test]
fn blue_waits_behind_the_closed_door_and_goes_through_the_open_one() {
    let lines = play();
    assert_eq!(lines.len(), 3, "{lines:?}");
    assert!(lines[0].starts_with("2.000 s: door applied"), "{lines:?}");
    assert!(
        lines[1].starts_with("7.000 s: door healed, blue at x = 2.79"),
        "{lines:?}"
    );
    assert!(
        lines[2].starts_with("10.000 s: blue at x = 4."),
        "{lines:?}"
    );
}
