//! Faults of the world itself, as changes that begin and end.

use glam::Vec2;
use scenario::fault::{Fault, MoveRobot};
use scenario::ids::RobotId;
use scenario::{Obstacle, Roster};

use crate::world::{ChangeError, ComponentId, ObstacleId, World};

/// A change of the world by a fault.
#[derive(Clone, Debug)]
pub struct Interruption(Change);

#[derive(Clone, Debug)]
enum Change {
    Obstacle {
        obstacle: Obstacle,
        /// The id of the obstacle while it exists.
        id: Option<ObstacleId>,
    },
    MoveRobot {
        robot: RobotId,
        to: MoveRobot,
    },
    /// A fault that the mission applies.
    Mission(Fault),
}

impl Interruption {
    /// Checks whether the state of the world may rule out a fault's effect.
    #[must_use]
    pub fn may_fail(fault: &Fault) -> bool {
        matches!(
            fault,
            Fault::Add(_)
                | Fault::Remove(_)
                | Fault::Restart(_)
                | Fault::MoveRobot(_)
                | Fault::Mission(_)
        )
    }

    /// Applies what a fault changes in the world, without its effects on processes and messages.
    ///
    /// # Errors
    /// Fails if the state of the world rules out the effect.
    pub fn try_on(world: &mut World, fault: &Fault, roster: &Roster) -> Result<(), ChangeError> {
        let robot = fault.robot().and_then(|name| roster.find(name));
        match (fault, robot) {
            (Fault::Add(_), Some(robot)) => world.add_robot(robot).map(drop),
            (Fault::Remove(_) | Fault::Restart(_), Some(robot)) if !world.is_present(robot) => {
                Err(ChangeError::Absent)
            }
            (Fault::Remove(_), Some(robot)) => {
                world.remove_robot(robot);
                Ok(())
            }
            _ => Self::from_fault(fault, roster)
                .begin(world)
                .transpose()
                .map(drop),
        }
    }

    /// Creates the change of a fault whose order has been [checked](scenario::fault::Order::check).
    #[must_use]
    pub fn from_fault(fault: &Fault, roster: &Roster) -> Self {
        Self(match fault {
            Fault::Obstacle(obstacle) => Change::Obstacle {
                obstacle: *obstacle,
                id: None,
            },
            Fault::MoveRobot(to) => match roster.find(&to.robot) {
                Some(robot) => Change::MoveRobot {
                    robot,
                    to: to.clone(),
                },
                None => Change::Mission(fault.clone()),
            },
            other => Change::Mission(other.clone()),
        })
    }

    /// Applies the change. Returns the detail for the log (the new places, in m), or the reason for a failure, which leaves the
    /// world unchanged. Returns `None` if the fault does not concern the world itself.
    pub fn begin(&mut self, world: &mut World) -> Option<Result<String, ChangeError>> {
        match &mut self.0 {
            Change::Obstacle { obstacle, id } => {
                let new = world.add_obstacle(obstacle);
                *id = Some(new);
                Some(Ok(ComponentId::Obstacle(new).to_string()))
            }
            Change::MoveRobot { robot, to } => {
                let place = Vec2::new(to.x_m, to.y_m);
                let moved = world.move_robot(*robot, place, to.heading_deg.map(f32::to_radians));
                Some(moved.map(|()| format!("{} {} {}", to.robot, place.x, place.y)))
            }
            Change::Mission(fault) => world.change(fault),
        }
    }

    /// Removes the obstacle of this change. Other changes are permanent.
    pub fn end(&mut self, world: &mut World) {
        if let Change::Obstacle { id, .. } = &mut self.0
            && let Some(id) = id.take()
        {
            world.remove_obstacle(id);
        }
    }
}

#[cfg(test)]
mod tests {

    use scenario::testkit::default_setup;

    use super::*;
    use crate::drill::DRILL;

    fn interruption(json: &str) -> Interruption {
        let fault = serde_json::from_str(json).unwrap();
        Interruption::from_fault(&fault, &default_setup(1).roster)
    }

    fn world() -> World {
        World::new(&default_setup(1), DRILL)
    }

    #[test]
    fn an_obstacle_comes_goes_and_comes_again() {
        let mut world = world();
        let json = r#"{"obstacle":{"x_m":5,"y_m":4,"width_m":1,"height_m":2,"penetrability":0.5}}"#;
        let (mut one, mut other) = (interruption(json), interruption(json));
        assert_eq!(one.begin(&mut world).unwrap().unwrap(), "obstacle-0");
        assert_eq!(other.begin(&mut world).unwrap().unwrap(), "obstacle-1");
        one.end(&mut world);
        one.end(&mut world);
        let left: Vec<_> = world.obstacles().iter().map(|each| each.id).collect();
        assert_eq!(left, [ComponentId::Obstacle(ObstacleId(1))]);
        assert_eq!(world.obstacles()[0].penetrability.0, 0.5);
        assert_eq!(world.obstacles()[0].pose.position, Vec2::new(5.5, 5.0));
        assert_eq!(one.begin(&mut world).unwrap().unwrap(), "obstacle-2");
    }

    #[test]
    fn a_robot_is_moved_only_to_a_free_place() {
        let mut world = world();
        let at = |x: f32| {
            format!(r#"{{"move-robot":{{"robot":"gold","x_m":{x},"y_m":4.5,"heading_deg":90}}}}"#)
        };
        assert_eq!(
            interruption(&at(6.0)).begin(&mut world).unwrap().unwrap(),
            "gold 6 4.5"
        );
        let pose = world.pose(RobotId(1));
        assert_eq!(pose.position, Vec2::new(6.0, 4.5));
        assert!((pose.heading_rad - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
        let error = interruption(&at(0.1))
            .begin(&mut world)
            .unwrap()
            .unwrap_err();
        assert_eq!(error, ChangeError::Occupied);
        assert_eq!(world.pose(RobotId(1)), pose);
    }

    #[test]
    fn what_the_world_rules_out_is_known_beforehand() {
        let roster = default_setup(1).roster;
        let mut world = world();
        let mut tried = |json: &str| {
            let fault = serde_json::from_str(json).unwrap();
            assert!(Interruption::may_fail(&fault));
            Interruption::try_on(&mut world, &fault, &roster)
        };
        let to = |robot: &str| format!(r#"{{"move-robot":{{"robot":"{robot}","x_m":6,"y_m":4}}}}"#);
        assert_eq!(tried(&to("gold")), Ok(()));
        assert_eq!(tried(&to("blue")), Err(ChangeError::Occupied));
        assert_eq!(tried(r#"{"add":"blue"}"#), Err(ChangeError::Present));
        assert_eq!(tried(r#"{"remove":"gold"}"#), Ok(()));
        for json in [r#"{"remove":"gold"}"#, r#"{"restart":"gold"}"#, &to("gold")] {
            assert_eq!(tried(json), Err(ChangeError::Absent), "{json}");
        }
        assert_eq!(tried(r#"{"add":"gold"}"#), Ok(()));
    }

    #[test]
    fn other_faults_do_not_change_the_world() {
        let roster = default_setup(1).roster;
        let mut mute = Interruption::from_fault(&Fault::Mute("blue".to_owned()), &roster);
        assert!(mute.begin(&mut world()).is_none());
    }
}
