//! Broken actuators: the conversion of commands into the actual motion of a body.
//!
//! Several faults of one robot act one after the other, in the order of arming.

use std::sync::Arc;

use proto::readings::Actuation;
use scenario::fault::{ActuatorMode, Fault, Side};
use scenario::ids::RobotId;
use scenario::{Body, Roster, Setup};

use super::schedule::FaultIndex;
use crate::mission::MissionWorld;
use crate::world::limit_command;

#[derive(Clone, Debug)]
pub struct Actuators {
    bodies: Vec<Body>,
    roster: Arc<Roster>,
    /// The defects in the order of arming.
    broken: Vec<(FaultIndex, RobotId, Defect)>,
}

#[derive(Clone, Copy, Debug)]
enum Defect {
    Actuator(ActuatorMode),
    /// The body ignores all commands.
    Unresponsive,
}

impl Actuators {
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        let bodies = scenario.robots.iter().map(|robot| scenario.body_of(robot));
        Self {
            bodies: bodies.collect(),
            roster: Arc::clone(&setup.roster),
            broken: Vec::new(),
        }
    }

    /// Sets the faults in force, in the order of arming.
    pub fn begin_tick<'f>(&mut self, in_force: impl Iterator<Item = (FaultIndex, &'f Fault)>) {
        self.broken.clear();
        for (index, fault) in in_force {
            let (name, defect) = match fault {
                Fault::Actuator(fault) => (&fault.robot, Defect::Actuator(fault.mode)),
                Fault::Power(robot) | Fault::Babble(robot) => (robot, Defect::Unresponsive),
                _ => continue,
            };
            if let Some(robot) = self.roster.find(name) {
                self.broken.push((index, robot, defect));
            }
        }
    }

    /// Checks whether a body executes any part of its commands.
    #[must_use]
    pub fn can_execute(&self, robot: RobotId) -> bool {
        !self.broken.iter().any(|(_, owner, defect)| {
            let is_unresponsive = matches!(
                defect,
                Defect::Unresponsive | Defect::Actuator(ActuatorMode::Dead)
            );
            *owner == robot && is_unresponsive
        })
    }

    /// Replaces the command of a robot by the actual motion. Returns the faults that changed it, in the order of arming.
    #[inline]
    pub fn apply_to(
        &self,
        mission: &dyn MissionWorld,
        robot: RobotId,
        command: &mut Option<Actuation>,
    ) -> Vec<FaultIndex> {
        match command {
            Some(command) if !self.broken.is_empty() => self.alter(mission, robot, command),
            // Most runs have no broken actuators.
            _ => Vec::new(),
        }
    }

    fn alter(
        &self,
        mission: &dyn MissionWorld,
        robot: RobotId,
        command: &mut Actuation,
    ) -> Vec<FaultIndex> {
        let body = &self.bodies[robot.index()];
        let mut hits = Vec::new();
        for (fault, _, defect) in self.broken.iter().filter(|(_, owner, _)| *owner == robot) {
            let intact = limit_command(body, *command);
            *command = limit_command(body, defect.act(mission, body, intact));
            if *command != intact {
                hits.push(*fault);
            }
        }
        hits
    }
}

impl Defect {
    fn act(self, mission: &dyn MissionWorld, body: &Body, mut command: Actuation) -> Actuation {
        let mode = match self {
            Self::Actuator(mode) => mode,
            Self::Unresponsive => return Actuation::default(),
        };
        match mode {
            ActuatorMode::Dead => slowed(command, 0.0),
            ActuatorMode::Slowed(share) => slowed(command, share),
            ActuatorMode::TurnBias(deg_s) => {
                let moves = command.speed_m_s != 0.0 || command.turn_rad_s != 0.0;
                let bias_rad_s = if moves { deg_s.to_radians() } else { 0.0 };
                Actuation {
                    turn_rad_s: command.turn_rad_s + bias_rad_s,
                    ..command
                }
            }
            ActuatorMode::OneWheel(dead) => one_wheel(body, command, dead),
            ActuatorMode::Gripper => {
                mission.remove_disabled("gripper", &mut command.action);
                command
            }
        }
    }
}

fn slowed(command: Actuation, share: f32) -> Actuation {
    Actuation {
        speed_m_s: command.speed_m_s * share,
        turn_rad_s: command.turn_rad_s * share,
        ..command
    }
}

/// Returns the motion of a differential drive whose dead wheel stands still. The wheels are a body's diameter apart.
fn one_wheel(body: &Body, command: Actuation, dead: Side) -> Actuation {
    let from_turning_m_s = command.turn_rad_s * body.radius_m;
    let (left_m_s, right_m_s) = match dead {
        Side::Left => (0.0, command.speed_m_s + from_turning_m_s),
        Side::Right => (command.speed_m_s - from_turning_m_s, 0.0),
    };
    Actuation {
        speed_m_s: f32::midpoint(left_m_s, right_m_s),
        turn_rad_s: (right_m_s - left_m_s) / (2.0 * body.radius_m),
        ..command
    }
}

#[cfg(test)]
mod tests {
    use scenario::fault::ActuatorFault;

    use scenario::testkit::default_setup;

    use super::*;
    use crate::drill::DRILL;
    use crate::world::World;

    use ActuatorMode::{Dead, OneWheel, Slowed, TurnBias};

    const BLUE: RobotId = RobotId(0);

    /// Returns the actual speed and turn rate in degrees/s, and the faults that changed them. The limits are 0.5 m/s and
    /// 90 degrees/s, the radius is 0.2 m.
    fn drive(modes: &[ActuatorMode], speed_m_s: f32, turn_deg_s: f32) -> (f32, f32, Vec<usize>) {
        let command = Actuation {
            speed_m_s,
            turn_rad_s: turn_deg_s.to_radians(),
            ..Actuation::default()
        };
        let faults = modes.iter().map(|mode| actuator(*mode)).collect::<Vec<_>>();
        let (done, hits) = execute(&faults, BLUE, command);
        (done.speed_m_s, done.turn_rad_s.to_degrees(), hits)
    }

    fn actuator(mode: ActuatorMode) -> Fault {
        Fault::Actuator(ActuatorFault {
            robot: "blue".to_owned(),
            mode,
        })
    }

    fn execute(faults: &[Fault], robot: RobotId, ordered: Actuation) -> (Actuation, Vec<usize>) {
        let mut actuators = Actuators::new(&default_setup(1));
        let faults = faults.iter().enumerate();
        actuators.begin_tick(faults.map(|(index, fault)| (FaultIndex(index), fault)));
        let mut command = Some(ordered);
        let world = World::new(&default_setup(1), DRILL);
        let hits = actuators.apply_to(world.mission(), robot, &mut command);
        let hits = hits.into_iter().map(|fault| fault.0).collect();
        (command.unwrap(), hits)
    }

    #[track_caller]
    fn assert_drive(actual: (f32, f32, Vec<usize>), speed_m_s: f32, turn_deg_s: f32, hit: bool) {
        assert!((actual.0 - speed_m_s).abs() < 1e-6, "{actual:?}");
        assert!((actual.1 - turn_deg_s).abs() < 1e-3, "{actual:?}");
        assert_eq!(actual.2.is_empty(), !hit, "{actual:?}");
    }

    #[test]
    fn a_dead_drive_neither_turns_nor_moves() {
        assert_drive(drive(&[Dead], 0.5, 90.0), 0.0, 0.0, true);
        assert_drive(drive(&[Dead], 0.0, 0.0), 0.0, 0.0, false);
        // An intact drive does not reverse either.
        assert_drive(drive(&[Dead], -1.0, 0.0), 0.0, 0.0, false);
    }

    #[test]
    fn a_slow_drive_gives_its_share_of_what_an_intact_one_would() {
        let slow = [Slowed(0.2)];
        assert_drive(drive(&slow, 0.4, -30.0), 0.08, -6.0, true);
        assert_drive(drive(&slow, 9.0, 900.0), 0.1, 18.0, true);
        assert_drive(drive(&[Slowed(1.0)], 0.4, 9.0), 0.4, 9.0, false);
    }

    #[test]
    fn a_turn_bias_acts_while_the_robot_drives() {
        let bias = [TurnBias(-10.0)];
        assert_drive(drive(&bias, 0.4, 0.0), 0.4, -10.0, true);
        assert_drive(drive(&bias, 0.0, 30.0), 0.0, 20.0, true);
        assert_drive(drive(&bias, 0.0, 0.0), 0.0, 0.0, false);
        // The turn rate is at the limit already.
        assert_drive(drive(&bias, 0.0, -90.0), 0.0, -90.0, false);
    }

    #[test]
    fn a_robot_with_one_wheel_circles_the_other() {
        let left = [OneWheel(Side::Left)];
        let right = [OneWheel(Side::Right)];
        // The center circles the wheel at the edge: speed = turn rate · radius.
        let round = (0.25_f32 / 0.2).to_degrees();
        assert_drive(drive(&left, 0.5, 0.0), 0.25, round, true);
        assert_drive(drive(&right, 0.5, 0.0), 0.25, -round, true);
        let half = 22.5_f32.to_radians() * 0.2;
        assert_drive(drive(&left, 0.0, 45.0), half, 22.5, true);
        // The other wheel would go backwards, so the body only turns.
        assert_drive(drive(&right, 0.0, 45.0), 0.0, 22.5, true);
        assert_drive(drive(&left, 0.0, 0.0), 0.0, 0.0, false);
    }

    #[test]
    fn faults_act_in_the_order_of_arming() {
        let slow = Slowed(0.5);
        let bias = TurnBias(10.0);
        assert_drive(drive(&[slow, bias], 0.4, 20.0), 0.2, 20.0, true);
        assert_drive(drive(&[bias, slow], 0.4, 20.0), 0.2, 15.0, true);
        assert_eq!(drive(&[Dead, slow], 0.4, 0.0).2, [0]);
    }

    #[test]
    fn intact_actuators_do_not_change_commands() {
        let command = Actuation {
            speed_m_s: 99.0,
            turn_rad_s: f32::INFINITY,
            ..Actuation::default()
        };
        assert_eq!(execute(&[], BLUE, command), (command, vec![]));
    }
}
