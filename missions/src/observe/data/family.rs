//! Observe in any size (`--robots N --targets M`). The region grows with the team, so that robots cover the same
//! share of it.

use scenario::mission::section::MissionSection;
use scenario::{Radio, Robot, Room, Scenario};
use terminal::counted;

use super::{OBSERVE, ObserveSection, Policy, Region};

/// The team size for a region of `RADIUS_M`.
const ROBOTS: f32 = 5.0;
const RADIUS_M: f32 = 10.0;
const RADIO_M: f32 = 5.0;
const SPEED_M_S: f32 = 0.2;

/// Creates a scenario for 1 to 1,000,000 robots and targets.
pub(super) fn family(robots: usize, targets: usize) -> Scenario {
    let default = Scenario::default();
    let radius_m = RADIUS_M * (robots as f32 / ROBOTS).sqrt();
    // Rounds up to two decimals, for readers.
    let side_m = (200.0 * radius_m).ceil() / 100.0;
    let robot = |number| Robot {
        name: format!("r{number}"),
        ..Robot::default()
    };
    Scenario {
        name: OBSERVE.name().to_owned(),
        description: format!(
            "{}, {}: the region grows with the team.",
            counted(robots, "robot"),
            counted(targets, "moving target"),
        ),
        room: Room::of_size(side_m, side_m),
        body: scenario::Body {
            speed_m_s: SPEED_M_S,
            ..default.body
        },
        radio: Radio {
            range_m: Some(RADIO_M),
            ..Radio::default()
        },
        robots: (1..=robots).map(robot).collect(),
        mission: MissionSection::new(OBSERVE, section(targets)),
        ..default
    }
}

fn section(targets: usize) -> ObserveSection {
    ObserveSection {
        n: targets as u32,
        slowest_m_s: 0.0,
        fastest_m_s: 0.15,
        turn_hz: 0.05,
        turn_deg: 90.0,
        region: Region::Disc,
        range_m: 2.6,
        predict_m: 3.0,
        target_near_m: 0.4,
        target_full_m: 0.8,
        robot_near_m: 1.25,
        robot_far_m: 2.0,
        policy: Policy::ACmommt,
        shared_weight: 0.25,
        duration_s: 120.0,
    }
}
