//! The radio channel between two robots: fading by distance, and obstacles on the straight line between them.
//!
//! With Rayleigh fading the received power is exponentially distributed, with a mean that falls with the distance as
//! d^−α. A message is received if its power exceeds a threshold, so the probability of reception is
//!
//! ```text
//! P(d) = exp(−(d / d0)^α)
//! ```
//!
//! where d0 is the distance at which the mean power equals the threshold. Source: M. Haenggi, "On routing in random
//! Rayleigh fading networks", IEEE Trans. Wireless Communications 4(4), 2005, section II. Messages fade independently of
//! each other and in each direction, as if the channel changed from message to message (fast fading).
//!
//! The positions at the start of the tick whose manifest lists a message decide, as for link faults.

use proto::link::{LinkState, Probability};
use scenario::ids::RobotId;
use scenario::{Fading, Radio, Walls};

use super::Floor;

impl Floor {
    /// Returns the state of the radio channel between two robots. It is clear unless the scenario states fading or walls that
    /// block.
    #[must_use]
    #[inline]
    pub fn channel(&self, sender: RobotId, receiver: RobotId) -> LinkState {
        // Most runs have no limits of the channel.
        if self.radio.fading.is_none() && self.radio.walls == Walls::Pass {
            return LinkState::default();
        }
        self.limited_channel(sender.min(receiver), sender.max(receiver))
    }

    /// Returns the channel between two robots in order of rank, so that both directions round alike.
    fn limited_channel(&self, lower: RobotId, higher: RobotId) -> LinkState {
        let [from, to] = [lower, higher].map(|robot| self.robots[robot.index()].position());
        let Radio { fading, walls, .. } = self.radio;
        let loss = fading.map(|fading| 1.0 - reception(&fading, from.distance(to)));
        LinkState {
            fade: loss.map_or(Probability::NEVER, Probability::from_share),
            blocked: walls == Walls::Block && self.space.is_blocked(from, to),
            ..LinkState::default()
        }
    }
}

/// Returns the probability that a message is received at a distance.
fn reception(fading: &Fading, distance_m: f32) -> f64 {
    let ratio = f64::from(distance_m) / f64::from(fading.d0_m);
    libm::exp(-libm::pow(ratio, f64::from(fading.path_loss_exponent)))
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use proptest::prelude::*;
    use scenario::testkit::default_scenario;
    use scenario::{Obstacle, Robot, Scenario, Setup, Start};

    use super::*;
    use crate::drill::DRILL;
    use crate::world::World;

    const BLUE: RobotId = RobotId(0);
    const GOLD: RobotId = RobotId(1);

    fn obstacle(x_m: f32, y_m: f32, width_m: f32, height_m: f32) -> Obstacle {
        Obstacle {
            x_m,
            y_m,
            width_m,
            height_m,
            penetrability: 0.0,
        }
    }

    fn world(radio: Radio, places: [Vec2; 2], obstacles: Vec<Obstacle>) -> World {
        let robots = [("blue", places[0]), ("gold", places[1])];
        let robots = robots.map(|(name, place)| Robot {
            name: name.to_owned(),
            start: Some(Start {
                x_m: place.x,
                y_m: place.y,
                heading_deg: 0.0,
            }),
            ..Robot::default()
        });
        let mut scenario = Scenario {
            radio,
            robots: robots.to_vec(),
            obstacles,
            ..default_scenario()
        };
        scenario.body.robot_penetrability = 1.0;
        World::new(&Setup::resolve(scenario, 1, None).unwrap().setup, DRILL)
    }

    fn blocking() -> Radio {
        Radio {
            walls: Walls::Block,
            ..Radio::default()
        }
    }

    #[test]
    fn reception_matches_values_computed_by_hand() {
        let fading = |d0_m, path_loss_exponent| Fading {
            d0_m,
            path_loss_exponent,
        };
        for (fading, distance_m, expected) in [
            (fading(5.0, 2.0), 0.0, 1.0),
            (fading(5.0, 3.0), 5.0, 0.367_879),
            // exp(−1/4), exp(−1/16), exp(−4) and exp(−16).
            (fading(8.0, 2.0), 4.0, 0.778_801),
            (fading(8.0, 4.0), 4.0, 0.939_413),
            (fading(2.0, 2.0), 4.0, 0.018_316),
            (fading(2.0, 4.0), 4.0, 1.125e-7),
        ] {
            let chance = reception(&fading, distance_m);
            assert!(
                (chance - expected).abs() < 1e-6,
                "{fading:?} {distance_m}: {chance}"
            );
        }
    }

    #[test]
    fn fading_follows_the_distance_of_moving_robots() {
        let radio = Radio {
            fading: Some(Fading {
                d0_m: 4.0,
                path_loss_exponent: 2.0,
            }),
            ..Radio::default()
        };
        let mut world = world(
            radio,
            [Vec2::new(2.0, 2.0), Vec2::new(6.0, 2.0)],
            Vec::new(),
        );
        let fade = |share: f64| Probability::from_share(1.0 - share);
        assert_eq!(world.channel(BLUE, GOLD).fade, fade(libm::exp(-1.0)));
        assert_eq!(world.channel(GOLD, BLUE), world.channel(BLUE, GOLD));
        world.move_robot(GOLD, Vec2::new(4.0, 2.0), None).unwrap();
        assert_eq!(world.channel(BLUE, GOLD).fade, fade(libm::exp(-0.25)));
    }

    #[test]
    fn obstacles_block_while_they_lie_between_the_robots() {
        let places = [Vec2::new(2.0, 4.0), Vec2::new(8.0, 4.0)];
        let mut world = world(blocking(), places, vec![obstacle(4.0, 6.0, 1.0, 1.0)]);
        assert!(world.channel(BLUE, GOLD).is_clear(), "beside the line");
        let patch = Obstacle {
            penetrability: 0.5,
            ..obstacle(3.0, 3.0, 1.0, 2.0)
        };
        world.add_obstacle(&patch);
        assert!(world.channel(BLUE, GOLD).is_clear(), "a patch is not solid");
        let id = world.add_obstacle(&obstacle(5.0, 3.0, 0.1, 2.0));
        assert!(world.channel(BLUE, GOLD).blocked && world.channel(GOLD, BLUE).blocked);
        world.move_robot(GOLD, Vec2::new(4.5, 4.0), None).unwrap();
        assert!(
            world.channel(BLUE, GOLD).is_clear(),
            "in front of the obstacle"
        );
        world.move_robot(GOLD, Vec2::new(8.0, 4.0), None).unwrap();
        assert!(world.remove_obstacle(id));
        assert!(world.channel(BLUE, GOLD).is_clear());
    }

    proptest! {
        /// Compares the test of a segment with points on it, apart from those at the edge of the obstacle.
        #[test]
        fn a_blocked_line_has_a_point_in_an_obstacle(
            from in (0.5..11.5_f32, 0.5..8.5_f32),
            to in (0.5..11.5_f32, 0.5..8.5_f32),
            at in (4.0..7.0_f32, 3.0..5.0_f32),
            size in (0.1..2.0_f32, 0.1..2.0_f32),
        ) {
            const EDGE_M: f32 = 0.01;
            let (from, to) = (Vec2::from(from), Vec2::from(to));
            let (low, high) = (Vec2::from(at), Vec2::from(at) + Vec2::from(size));
            // The robots have a start only outside the obstacle.
            prop_assume!([from, to].iter().all(|place| place.distance(place.clamp(low, high)) > 0.3));
            let world = world(blocking(), [from, to], vec![obstacle(at.0, at.1, size.0, size.1)]);
            let points = (0..=2000).map(|part| from.lerp(to, part as f32 / 2000.0));
            let depth = |point: Vec2| (point - low).min(high - point).min_element();
            let deepest = points.map(depth).fold(f32::MIN, f32::max);
            prop_assume!(deepest.abs() > EDGE_M);
            prop_assert_eq!(world.channel(BLUE, GOLD).blocked, deepest > 0.0);
            prop_assert_eq!(world.channel(GOLD, BLUE).blocked, deepest > 0.0);
        }
    }
}
