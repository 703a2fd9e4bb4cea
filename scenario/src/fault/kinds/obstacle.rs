//! The fault `obstacle`.

use glam::Vec2;

use super::Target;
use crate::fault::Fault;
use crate::fault::checker::{Checked, Checker};
use crate::fault::spec::{FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec};
use crate::limits::FARTHEST_M;
use crate::{Obstacle, Problem};

const ANYWHERE: FaultRange = FaultRange::Within(-FARTHEST_M, FARTHEST_M);

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "obstacle",
        about: "Place an obstacle, or an area of slow or fast ground",
        arguments: &[
            FaultArgument::at("x_m", "Lower left corner: x, m", ANYWHERE),
            FaultArgument::at("y_m", "Lower left corner: y, m", ANYWHERE),
            FaultArgument::at("width_m", "Extent in x, m", FaultRange::Above(FARTHEST_M)),
            FaultArgument::at("height_m", "Extent in y, m", FaultRange::Above(FARTHEST_M)),
            FaultArgument::at(
                "penetrability",
                "Speed factor on the rectangle: solid up to 0.1, slower below 1, faster above 1",
                FaultRange::Within(0.0, 100.0),
            )
            .option("penetrability")
            .default(0.0),
        ],
    },
    group: FaultGroup::World,
    healing: Some("it disappears"),
    takes_role: false,
    check,
    examples: &[
        (
            r#"{"obstacle": {"x_m": 5.0, "y_m": 4.0, "width_m": 0.5, "height_m": 1.0}}"#,
            "an obstacle, given by its lower left corner; healing removes it",
        ),
        (
            r#"{"obstacle": {"x_m": 5.0, "y_m": 4.0, "width_m": 2.0, "height_m": 1.0, "penetrability": 0.5}}"#,
            "a patch of ground: below 1 it slows robots by that factor, above 1 it speeds them up",
        ),
    ],
    commands: &[("obstacle 4 3 0.5 1", "0.5 m by 1 m, corner at (4, 3)")],
};

impl Target for Obstacle {}

/// Checks that an obstacle lies in the room and does not fill it.
fn check(fault: &Fault, checker: &Checker<'_>) -> Checked {
    let Fault::Obstacle(rectangle) = fault else {
        return Ok(());
    };
    let room = checker.scenario.room;
    let low = Vec2::new(rectangle.x_m, rectangle.y_m);
    let high = low + Vec2::new(rectangle.width_m, rectangle.height_m);
    let meets = high.cmpge(room.low()) & low.cmple(room.high());
    let what = if !meets.all() {
        "the obstacle is outside the room"
    } else if low.cmple(room.low()).all() && high.cmpge(room.high()).all() {
        "the obstacle fills the room"
    } else {
        return Ok(());
    };
    let mut remedy = format!(
        "the room is {} m wide and {} m high",
        room.width_m, room.height_m
    );
    if room.low() != Vec2::ZERO {
        remedy += &format!(", from ({}, {})", room.x_m, room.y_m);
    }
    Err(Problem::at(["fault", "obstacle"], what, remedy))
}
