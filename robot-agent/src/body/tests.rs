//! Body control with synthetic surroundings. The closed-loop tests cover entire ways around real obstacles.

use scenario::testkit::default_scenario;
use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec2;
use proptest::prelude::*;
use proto::readings::{Hit, Pose, Proximity};
use scenario::time::SimTime;

use super::chassis::FACING_RAD;
use super::detour::CLEARANCE_M;
use super::*;

const STEP_MS: u64 = 50;

fn chassis() -> Chassis {
    let scenario = default_scenario();
    Chassis::new(&scenario, &scenario.robots[0])
}

/// At the origin, heading along x, without obstacles.
fn in_the_open() -> Surroundings {
    Surroundings {
        pose: Pose::default(),
        proximity: Proximity::default(),
        border_ahead: None,
    }
}

fn hit(distance_m: f32, normal_rad: f32) -> Option<Hit> {
    Some(Hit {
        distance_m,
        normal_rad,
    })
}

/// A flat wall straight ahead, at the clearance.
fn before_a_wall() -> Surroundings {
    let mut around = in_the_open();
    around.proximity.ahead = [hit(CLEARANCE_M, PI); 3];
    around
}

/// A disc straight ahead at the clearance, which only the middle beam meets.
fn before_a_disc() -> Surroundings {
    let mut around = in_the_open();
    around.proximity.ahead = [None, hit(CLEARANCE_M, PI), None];
    around
}

/// A wall to the left, at the clearance from the hull.
fn beside_a_wall(at: Vec2, heading_rad: f32) -> Surroundings {
    let mut around = in_the_open();
    around.pose = Pose {
        position: at,
        heading_rad,
    };
    around.proximity.left = [hit(CLEARANCE_M, -FRAC_PI_2); 3];
    around
}

fn far_ahead() -> Goal {
    Goal::Place {
        at: Vec2::new(10.0, 0.0),
        within: 0.1,
    }
}

fn drive(navigator: &mut Navigator, goal: Goal, around: &Surroundings, now_ms: u64) -> Drive {
    navigator.drive(&chassis(), goal, around, [], SimTime(now_ms))
}

#[test]
fn an_object_beyond_the_goal_does_not_block_the_way() {
    let near = Goal::Place {
        at: Vec2::new(0.1, 0.0),
        within: 0.05,
    };
    let drive = drive(&mut Navigator::default(), near, &before_a_wall(), 0);
    assert_eq!(drive.detour, None);
    // The wall lies within the clearance.
    assert_eq!(drive.actuation.speed_m_s, chassis().speed_m_s);
}

#[test]
fn the_robot_keeps_right_if_no_side_is_better() {
    let drive = drive(&mut Navigator::default(), far_ahead(), &before_a_wall(), 0);
    assert_eq!(drive.detour, Some(Side::Left));
    assert!(drive.actuation.turn_rad_s < 0.0);
}

#[test]
fn the_robot_faces_its_goal_before_it_rests_at_the_border() {
    let mut around = before_a_wall();
    around.border_ahead = Some(CLEARANCE_M);
    around.pose.heading_rad = 0.157;
    let ahead = Goal::Direction(Vec2::X);
    let mut navigator = Navigator::default();
    let turns = drive(&mut navigator, ahead, &around, 0);
    assert_eq!(turns.status, Status::Going);
    assert_eq!(turns.actuation.speed_m_s, 0.0);
    assert!(turns.actuation.turn_rad_s < 0.0);
    around.pose.heading_rad = 0.0;
    let rests = drive(&mut navigator, ahead, &around, 50);
    assert_eq!(rests.status, Status::Blocked);
}

#[test]
fn a_detour_takes_the_side_that_leads_toward_the_goal() {
    for (normal, side) in [(PI - 0.5, Side::Right), (PI + 0.5, Side::Left)] {
        let mut around = before_a_wall();
        around.proximity.ahead = [hit(CLEARANCE_M, normal); 3];
        let drive = drive(&mut Navigator::default(), far_ahead(), &around, 0);
        // With the smaller angle the surface faces to the robot's right, and so leads to its left.
        let leads_on = side.along(normal).cos();
        assert!(leads_on > 0.0, "{normal}");
        assert_eq!(drive.detour, Some(side), "{normal}");
    }
}

#[test]
fn the_border_ahead_starts_no_detour() {
    let mut around = before_a_wall();
    around.border_ahead = Some(CLEARANCE_M);
    let mut navigator = Navigator::default();
    assert_eq!(
        drive(&mut navigator, far_ahead(), &around, 0).status,
        Status::Blocked
    );
    // The status is reported once; then the robot rests.
    let rest = drive(&mut navigator, far_ahead(), &around, 1_000);
    assert_eq!(
        (rest.status, rest.actuation),
        (Status::Going, Default::default())
    );
    assert_eq!(
        drive(&mut navigator, far_ahead(), &around, 2_000).status,
        Status::Blocked
    );
}

#[test]
fn the_robot_yields_to_a_teammate_for_a_limited_time() {
    let mut navigator = Navigator::default();
    let near = Teammate {
        position: Vec2::new(0.5, 0.0),
        received_at: SimTime(0),
    };
    let mut at = |now_ms| {
        let now = SimTime(now_ms);
        navigator.drive(&chassis(), far_ahead(), &before_a_disc(), [near], now)
    };
    for now_ms in (0..4_000).step_by(STEP_MS as usize) {
        assert_eq!(at(now_ms).actuation, Default::default(), "{now_ms}");
    }
    assert!(at(4_000).detour.is_some());
}

#[test]
fn a_wall_is_not_taken_for_a_teammate() {
    let near = Teammate {
        position: Vec2::new(0.5, 0.0),
        received_at: SimTime(0),
    };
    let mut navigator = Navigator::default();
    let drive = navigator.drive(
        &chassis(),
        far_ahead(),
        &before_a_wall(),
        [near],
        SimTime(0),
    );
    assert!(drive.detour.is_some());
}

/// A robot that met a wall at x = 0.28 and turned right, with the wall to its left.
fn on_a_detour() -> Navigator {
    let mut navigator = Navigator::default();
    let start = drive(&mut navigator, far_ahead(), &before_a_wall(), 0);
    assert_eq!(start.detour, Some(Side::Left));
    navigator
}

#[test]
fn a_robot_boxed_in_gives_up_for_a_while() {
    let mut navigator = Navigator::default();
    let mut heading = 0.0;
    let mut blocked = false;
    for step in 0..400 {
        let mut around = before_a_wall();
        around.pose.heading_rad = heading;
        let drive = drive(&mut navigator, far_ahead(), &around, step * STEP_MS);
        assert_eq!(drive.actuation.speed_m_s, 0.0);
        heading = wrap(heading + drive.actuation.turn_rad_s * chassis().step_s);
        blocked |= drive.status == Status::Blocked;
    }
    assert!(blocked);
}

#[test]
fn a_new_goal_ends_a_detour() {
    let mut navigator = on_a_detour();
    let elsewhere = Goal::Direction(Vec2::NEG_Y);
    let around = beside_a_wall(Vec2::new(0.0, -0.5), -FRAC_PI_2);
    let drive = drive(&mut navigator, elsewhere, &around, 1_000);
    assert_eq!(drive.actuation.speed_m_s, chassis().speed_m_s);
    assert_eq!(drive.actuation.turn_rad_s, 0.0);
}

#[test]
fn a_goal_that_shifts_a_little_counts_as_the_same() {
    let place = |x| Goal::Place {
        at: Vec2::new(x, 0.0),
        within: 0.1,
    };
    assert!(place(1.0).continues(&place(1.1)));
    assert!(!place(1.0).continues(&place(1.5)));
    assert!(!place(1.0).continues(&Goal::Direction(Vec2::X)));
    assert!(Goal::Direction(Vec2::X).continues(&Goal::Direction(Vec2::X)));
    assert!(!Goal::Direction(Vec2::X).continues(&Goal::Direction(Vec2::Y)));
}

proptest! {
    #[test]
    fn a_step_stays_within_the_limits_without_overshoot(
        bearing in -PI..PI,
        way in 0.0f32..10.0,
        step_ms in 1u64..=500,
    ) {
        let chassis = Chassis { step_s: step_ms as f32 / 1000.0, ..chassis() };
        let actuation = chassis.drive(bearing, way);
        prop_assert!(actuation.turn_rad_s.abs() <= chassis.turn_rad_s);
        prop_assert!(actuation.turn_rad_s.abs() * chassis.step_s <= bearing.abs() * 1.00001);
        prop_assert!((0.0..=chassis.speed_m_s).contains(&actuation.speed_m_s));
        prop_assert!(actuation.speed_m_s * chassis.step_s <= way * 1.00001);
        prop_assert!(bearing.abs() <= FACING_RAD || actuation.speed_m_s == 0.0);
    }

    #[test]
    fn a_wrapped_angle_is_the_same_direction(angle in -50.0f32..50.0) {
        let wrapped = wrap(angle);
        prop_assert!(wrapped.abs() <= PI + 1e-6);
        prop_assert!((libm::cosf(wrapped) - libm::cosf(angle)).abs() < 1e-4);
        prop_assert!((libm::sinf(wrapped) - libm::sinf(angle)).abs() < 1e-4);
    }

    #[test]
    fn the_obstacle_is_on_its_side_of_the_course(normal in -PI..PI) {
        let outward = Vec2::new(libm::cosf(normal), libm::sinf(normal));
        for side in [Side::Left, Side::Right] {
            let along = side.along(normal);
            let course = Vec2::new(libm::cosf(along), libm::sinf(along));
            let left = course.perp();
            prop_assert!(left.dot(-outward) * side.sign() > 0.999);
        }
    }
}
