//! Each sensor compared with values computed by hand.

use std::f32::consts::{FRAC_PI_2, PI};

use proto::mission::items::{ItemsReading, Zone};
use proto::readings::{Hit, Proximity, Readings};

use super::*;

fn readings(start: (f32, f32, f32)) -> Readings {
    room(&[start], &[]).readings(BLUE)
}

/// Returns what the robot at `start` senses of obstacles.
fn proximity(start: (f32, f32, f32), obstacles: &[Obstacle]) -> Proximity {
    room(&[start], obstacles).readings(BLUE).proximity.unwrap()
}

#[track_caller]
fn assert_hit(hit: Option<Hit>, distance_m: f32, normal_rad: f32) {
    let hit = hit.expect("the beam meets something");
    assert_near(hit.distance_m, distance_m);
    assert_near(hit.normal_rad, normal_rad);
}

#[test]
fn position_and_gripper() {
    let readings = readings((3.0, 4.5, 90.0));
    let pose = readings.pose.unwrap();
    assert_at(pose.position, 3.0, 4.5);
    assert_near(pose.heading_rad, FRAC_PI_2);
    assert_eq!(readings.mission.items().holding, Some(false));
    assert_eq!(readings.energy_j, None);
}

#[test]
fn border_sensors_measure_from_the_edge_within_their_range() {
    // At (0.5, 8.4), facing the left wall: the upper wall is to the right, nothing to the left.
    let left = room(&[(0.5, 8.4, 180.0), (0.5, 4.0, 180.0)], &[]);
    assert_eq!(left.readings(BLUE).side_border, Some(None));
    assert_eq!(left.readings(GOLD).side_border, None);
    let front = |readings: &Readings| readings.front_border.flatten().unwrap();
    assert_near(front(&left.readings(BLUE)), 0.3);
    let up = readings((0.6, 8.4, 90.0));
    assert_near(front(&up), 0.4);
    assert_near(up.side_border.flatten().unwrap(), 0.4);
    // At an angle, the distance is measured along the heading.
    assert_near(front(&readings((11.7, 4.0, 60.0))), 0.6 - 0.2);
    // The sensors do not see obstacles.
    let beyond = room(&[(0.71, 4.5, 180.0)], &[solid(0.1, 4.0, 0.1, 1.0)]);
    assert_eq!(beyond.readings(BLUE).front_border, Some(None));
}

#[test]
fn the_three_beams_ahead_meet_a_wall_at_right_angles() {
    let Proximity { ahead, left, right } = proximity((0.5, 4.5, 180.0), &[]);
    // The body stops a skin short of the wall.
    for (hit, distance_m) in ahead.into_iter().zip([0.3, 0.3 - SKIN_M, 0.3]) {
        assert_hit(hit, distance_m, PI);
    }
    assert_eq!((left, right), ([None; 3], [None; 3]));
    assert_eq!(proximity((6.0, 4.5, 33.0), &[]), Proximity::default());
}

#[test]
fn a_slanted_wall_is_nearer_on_one_side() {
    // The heading is 30 degrees off the normal of the left wall, whose normal is then 150 degrees to the left of ahead.
    let Proximity { ahead, left, right } = proximity((0.4, 4.5, 210.0), &[]);
    let (sin, cos) = (0.5, 3.0_f32.sqrt() / 2.0);
    let normal = 150.0_f32.to_radians();
    // The left beam starts at x = 0.4 + 0.2 sin, the right one at 0.4 - 0.2 sin.
    assert_hit(ahead[0], (0.4 + 0.2 * sin) / cos - 0.2, normal);
    assert_hit(ahead[1], (0.2 - SKIN_M) / cos, normal);
    assert_hit(ahead[2], (0.4 - 0.2 * sin) / cos - 0.2, normal);
    // To the right is 120 degrees: the wall is in range of the front only, which is at x = 0.4 - 0.2 cos.
    assert_hit(right[0], (0.4 - 0.2 * cos) / sin - 0.2, normal);
    assert_eq!((left, &right[1..]), ([None; 3], &[None; 2][..]));
}

#[test]
fn side_beams_distinguish_front_center_and_rear() {
    // The heading is along x, below an obstacle that ends between center and rear, 0.1 m from the edge of the body.
    let above = solid(2.9, 4.8, 2.0, 1.0);
    let Proximity { ahead, left, right } = proximity((3.0, 4.5, 0.0), &[above]);
    assert_hit(left[0], 0.1, -FRAC_PI_2);
    assert_hit(left[1], 0.1, -FRAC_PI_2);
    assert_eq!((ahead, left[2], right), ([None; 3], None, [None; 3]));
}

#[test]
fn a_solid_beside_the_start_of_a_beam_is_at_distance_0() {
    // The corner of an obstacle reaches between the hull ahead and the line of the left side.
    let corner = solid(3.15, 4.65, 1.0, 1.0);
    let Proximity { ahead, left, .. } = proximity((3.0, 4.5, 0.0), &[corner]);
    assert_hit(ahead[0], 0.0, PI);
    assert_hit(left[0], 0.0, -FRAC_PI_2);
    assert_eq!(left[1], None);
    // The corner is 0.15 m left of the center line. The normal points from it to the center of the body at contact.
    let contact = 0.2 + SKIN_M;
    let way = 0.15 - (contact * contact - 0.15 * 0.15_f32).sqrt();
    assert_hit(ahead[1], way, -PI + (0.15 / contact).asin());
}

#[test]
fn the_center_beam_is_as_wide_as_the_body() {
    // Only the center beam sees a post between the beams. It does not see a post just beside the body's way.
    let post = |y_m| proximity((3.0, 4.5, 0.0), &[solid(3.5, y_m, 0.02, 0.02)]).ahead;
    assert_eq!(post(4.55).map(|hit| hit.is_some()), [false, true, false]);
    assert_eq!(post(4.702), [None; 3]);
}

#[test]
fn teammates_are_solid_discs_unless_they_are_penetrable() {
    let place = |penetrability| {
        let world = world(|scenario| {
            robots(&[(3.0, 4.5, 0.0), (3.6, 4.55, 0.0), (3.0, 4.0, 0.0)])(scenario);
            scenario.body.robot_penetrability = penetrability;
        });
        world.readings(BLUE).proximity.unwrap()
    };
    let Proximity { ahead, left, right } = place(0.0);
    // The body ahead is 0.05 m left of the center line, 0.15 m from the left beam and 0.25 m from the right one.
    let contact = 0.4 + SKIN_M;
    let way = 0.6 - (contact * contact - 0.05 * 0.05_f32).sqrt();
    assert_hit(ahead[1], way, -PI + (0.05 / contact).asin());
    let way = 0.6 - (0.2 * 0.2 - 0.15 * 0.15_f32).sqrt();
    assert_hit(ahead[0], way - 0.2, PI - 0.75_f32.asin());
    assert_eq!((ahead[2], left), (None, [None; 3]));
    assert_hit(right[1], 0.1, FRAC_PI_2);
    assert_eq!(place(0.5), Proximity::default());
}

#[test]
fn waste_is_sensed_in_the_robots_frame_nearest_first_at_most_eight() {
    let world = world(|scenario| {
        robots(&[(4.0, 6.0, 90.0)])(scenario);
        spill(scenario, (4.0, 6.0), 12, 0.3);
    });
    let sensed = world.readings(BLUE);
    let sensed = sensed.mission.items().items.as_ref().unwrap();
    let offsets = world.items().iter();
    let mut offsets: Vec<Vec2> = offsets
        .map(|item| item.position - Vec2::new(4.0, 6.0))
        .collect();
    offsets.sort_by(|a, b| a.length().total_cmp(&b.length()));
    assert_eq!(sensed.len(), 8);
    for (sensed, offset) in sensed.iter().zip(&offsets) {
        // The robot faces up: ahead is y, and left is -x.
        assert_at(*sensed, offset.y, -offset.x);
    }
    // The range counts from the edge of the body.
    for (x, seen) in [(5.199, 1), (5.201, 0)] {
        let world = super::world(|scenario| {
            robots(&[(x, 6.0, 0.0)])(scenario);
            spill(scenario, (4.0, 6.0), 1, 0.000_01);
        });
        let sensed = world.readings(BLUE);
        let sensed = sensed.mission.items().items.as_ref().unwrap();
        assert_eq!(sensed.len(), seen, "at {x}");
    }
}

#[test]
fn zones_and_report_site_are_sensed_at_the_center() {
    let sensed = |x, y| -> ItemsReading { readings((x, y, 0.0)).mission.items().clone() };
    let zone = |x, y| sensed(x, y).zone;
    assert_eq!(zone(4.0 + 0.79, 6.0), Some(Zone::Source));
    assert_eq!(zone(4.0 + 0.81, 6.0), Some(Zone::None));
    assert_eq!(zone(9.6, 4.5 - 0.99), Some(Zone::Target));
    assert_eq!(zone(9.6, 4.5 - 1.01), Some(Zone::None));
    let site = |x, y| sensed(x, y).at_site;
    assert_eq!(site(0.59, 3.01), Some(true));
    assert_eq!(site(0.61, 3.01), Some(false));
    assert_eq!(site(0.59, 2.99), Some(false));
}
