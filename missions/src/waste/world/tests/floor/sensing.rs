//! Each sensor compared with values computed by hand.

use crate::waste::data::WasteSection;
use std::f32::consts::{FRAC_PI_2, PI};

use proto::mission::items::Zone;
use proto::readings::{Hit, Proximity};

use super::*;
use world_server::world::SKIN_M;

fn proximity(world: &World) -> Proximity {
    world
        .readings(BLUE)
        .proximity
        .expect("every robot has the sensor")
}

#[track_caller]
fn assert_hit(hit: Option<Hit>, distance_m: f32, normal_rad: f32) {
    let hit = hit.expect("the beam meets something");
    assert_near(hit.distance_m, distance_m);
    assert_near(hit.normal_rad, normal_rad);
}

#[test]
fn position_and_gripper() {
    let world = world(robots(&[(3.0, 4.5, 90.0)]));
    let readings = world.readings(BLUE);
    let pose = readings.pose.expect("every robot has the sensor");
    assert_at(pose.position, 3.0, 4.5);
    assert_near(pose.heading_rad, FRAC_PI_2);
    assert_eq!(readings.mission.items().holding, Some(false));
    assert_eq!(readings.energy_j, None);
}

#[test]
fn border_sensors_measure_from_the_edge_within_their_range() {
    // At (0.5, 8.4), facing the left wall: the upper wall is to the right, nothing to the left.
    let left = world(robots(&[(0.5, 8.4, 180.0), (0.5, 4.0, 180.0)]));
    let readings = left.readings(BLUE);
    assert_near(readings.front_border.flatten().expect("in range"), 0.3);
    assert_eq!(readings.side_border, Some(None));
    assert_eq!(left.readings(GOLD).side_border, None);

    let up = world(robots(&[(0.6, 8.4, 90.0)]));
    let readings = up.readings(BLUE);
    assert_near(readings.front_border.flatten().expect("in range"), 0.4);
    assert_near(readings.side_border.flatten().expect("in range"), 0.4);

    // At an angle, the distance is measured along the heading.
    let slanted = world(robots(&[(11.7, 4.0, 60.0)]));
    let readings = slanted.readings(BLUE);
    assert_near(
        readings.front_border.flatten().expect("in range"),
        0.6 - 0.2,
    );
}

#[test]
fn border_sensors_do_not_see_obstacles_and_end_at_their_range() {
    let world = world(|scenario| {
        robots(&[(0.71, 4.5, 180.0)])(scenario);
        scenario.obstacles = vec![rectangle(0.1, 4.0, 0.1, 1.0, 0.0)];
    });
    assert_eq!(world.readings(BLUE).front_border, Some(None));
}

#[test]
fn nothing_in_range_is_a_free_beam() {
    let world = world(robots(&[(6.0, 4.5, 33.0)]));
    assert_eq!(proximity(&world), Proximity::default());
}

#[test]
fn the_three_beams_ahead_meet_a_wall_at_right_angles() {
    let world = world(robots(&[(0.5, 4.5, 180.0)]));
    let Proximity { ahead, left, right } = proximity(&world);
    assert_hit(ahead[0], 0.3, PI);
    // The body stops a skin short of the wall.
    assert_hit(ahead[1], 0.3 - SKIN_M, PI);
    assert_hit(ahead[2], 0.3, PI);
    assert_eq!((left, right), ([None; 3], [None; 3]));
}

#[test]
fn a_slanted_wall_is_nearer_on_one_side() {
    // The heading is 30 degrees off the normal of the left wall, whose normal is then 150 degrees to the left of ahead.
    let world = world(robots(&[(0.4, 4.5, 210.0)]));
    let (sin, cos) = (0.5, 3.0_f32.sqrt() / 2.0);
    let Proximity { ahead, left, right } = proximity(&world);
    let normal = 150.0_f32.to_radians();
    // The left beam starts at x = 0.4 + 0.2 sin, the right one at 0.4 - 0.2 sin.
    assert_hit(ahead[0], (0.4 + 0.2 * sin) / cos - 0.2, normal);
    assert_hit(ahead[1], (0.2 - SKIN_M) / cos, normal);
    assert_hit(ahead[2], (0.4 - 0.2 * sin) / cos - 0.2, normal);
    assert_eq!(left, [None; 3]);
    // To the right is 120 degrees: the wall is in range of the front only, which is at x = 0.4 - 0.2 cos.
    assert_hit(right[0], (0.4 - 0.2 * cos) / sin - 0.2, normal);
    assert_eq!(right[1], None);
    assert_eq!(right[2], None);
}

#[test]
fn side_beams_distinguish_front_center_and_rear() {
    // The heading is along x, below an obstacle that ends between center and rear, 0.1 m from the edge of the body.
    let world = world(|scenario| {
        robots(&[(3.0, 4.5, 0.0)])(scenario);
        scenario.obstacles = vec![rectangle(2.9, 4.8, 2.0, 1.0, 0.0)];
    });
    let Proximity { ahead, left, right } = proximity(&world);
    assert_eq!(ahead, [None; 3]);
    assert_hit(left[0], 0.1, -FRAC_PI_2);
    assert_hit(left[1], 0.1, -FRAC_PI_2);
    assert_eq!(left[2], None);
    assert_eq!(right, [None; 3]);
}

#[test]
fn a_solid_beside_the_start_of_a_beam_is_at_distance_0() {
    // The corner of an obstacle reaches between the hull ahead and the line of the left side.
    let world = world(|scenario| {
        robots(&[(3.0, 4.5, 0.0)])(scenario);
        scenario.obstacles = vec![rectangle(3.15, 4.65, 1.0, 1.0, 0.0)];
    });
    let Proximity { ahead, left, .. } = proximity(&world);
    assert_hit(ahead[0], 0.0, PI);
    assert_hit(left[0], 0.0, -FRAC_PI_2);
    assert_eq!(left[1], None);
    // The corner is 0.15 m left of the center line.
    let contact = 0.2 + SKIN_M;
    let way = 0.15 - (contact * contact - 0.15 * 0.15_f32).sqrt();
    let hit = ahead[1].expect("the body cannot pass");
    assert_near(hit.distance_m, way);
    // The normal points from the corner to the center of the body at contact.
    assert_near(hit.normal_rad, -PI + (0.15 / contact).asin());
}

#[test]
fn the_center_beam_is_as_wide_as_the_body() {
    // Only the center beam sees a post between the beams. It does not see a post just beside the body's way.
    let post = |y_m| {
        world(|scenario| {
            robots(&[(3.0, 4.5, 0.0)])(scenario);
            scenario.obstacles = vec![rectangle(3.5, y_m, 0.02, 0.02, 0.0)];
        })
    };
    let ahead = proximity(&post(4.55)).ahead;
    assert_eq!((ahead[0], ahead[2]), (None, None));
    assert!(ahead[1].is_some());
    assert_eq!(proximity(&post(4.702)).ahead, [None; 3]);
}

#[test]
fn teammates_are_solid_discs_unless_they_are_penetrable() {
    let place = |penetrability| {
        world(|scenario| {
            robots(&[(3.0, 4.5, 0.0), (3.6, 4.55, 0.0), (3.0, 4.0, 0.0)])(scenario);
            scenario.body.robot_penetrability = penetrability;
        })
    };
    let Proximity { ahead, left, right } = proximity(&place(0.0));
    // The body ahead is 0.05 m left of the center line, 0.15 m from the left beam and 0.25 m from the right one.
    let contact = 0.4 + SKIN_M;
    let way = 0.6 - (contact * contact - 0.05 * 0.05_f32).sqrt();
    assert_hit(ahead[1], way, -PI + (0.05 / contact).asin());
    let way = 0.6 - (0.2 * 0.2 - 0.15 * 0.15_f32).sqrt();
    assert_hit(ahead[0], way - 0.2, PI - 0.75_f32.asin());
    assert_eq!((ahead[2], left), (None, [None; 3]));
    assert_hit(right[1], 0.1, FRAC_PI_2);
    assert_eq!(proximity(&place(0.5)), Proximity::default());
}

#[test]
fn waste_is_sensed_in_the_robots_frame_nearest_first_at_most_eight() {
    let world = world(|scenario| {
        robots(&[(4.0, 6.0, 90.0)])(scenario);
        WasteSection::of_mut(scenario).spills[0].items = 12;
        WasteSection::of_mut(scenario).spill_radius_m = 0.3;
    });
    let waste = world
        .readings(BLUE)
        .mission
        .items()
        .items
        .clone()
        .expect("every robot has the sensor");
    assert_eq!(waste.len(), 8);
    let mut distances = world
        .items()
        .iter()
        .map(|item| item.position.distance(Vec2::new(4.0, 6.0)));
    let mut sorted = distances.by_ref().collect::<Vec<_>>();
    sorted.sort_by(f32::total_cmp);
    for (offset, distance) in waste.iter().zip(&sorted) {
        assert_near(offset.length(), *distance);
    }
    let nearest = world.items().iter().min_by(|a, b| {
        let center = Vec2::new(4.0, 6.0);
        a.position
            .distance(center)
            .total_cmp(&b.position.distance(center))
    });
    let from = nearest.expect("there are items").position - Vec2::new(4.0, 6.0);
    // The robot faces up: ahead is y, and left is -x.
    assert_at(waste[0], from.y, -from.x);
}

#[test]
fn the_waste_sensor_counts_its_range_from_the_edge() {
    for (x, seen) in [(5.199, 1), (5.201, 0)] {
        let world = world(|scenario| {
            robots(&[(x, 6.0, 0.0)])(scenario);
            WasteSection::of_mut(scenario).spills[0].items = 1;
            WasteSection::of_mut(scenario).spill_radius_m = 0.000_01;
        });
        let waste = world
            .readings(BLUE)
            .mission
            .items()
            .items
            .clone()
            .expect("every robot has the sensor");
        assert_eq!(waste.len(), seen, "at {x}");
    }
}

#[test]
fn zones_and_report_site_are_sensed_at_the_center() {
    let zone = |x, y| {
        world(robots(&[(x, y, 0.0)]))
            .readings(BLUE)
            .mission
            .items()
            .zone
    };
    assert_eq!(zone(4.0 + 0.79, 6.0), Some(Zone::Source));
    assert_eq!(zone(4.0 + 0.81, 6.0), Some(Zone::None));
    assert_eq!(zone(9.6, 4.5 - 0.99), Some(Zone::Target));
    assert_eq!(zone(9.6, 4.5 - 1.01), Some(Zone::None));
    let site = |x, y| {
        world(robots(&[(x, y, 0.0)]))
            .readings(BLUE)
            .mission
            .items()
            .at_site
    };
    assert_eq!(site(0.59, 3.01), Some(true));
    assert_eq!(site(0.61, 3.01), Some(false));
    assert_eq!(site(0.59, 2.99), Some(false));
}
