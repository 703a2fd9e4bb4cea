//! The fault `obstacle`.

use super::Target;
use crate::fault::Fault;
use crate::fault::checker::{Checked, Checker};
use crate::fault::spec::{FaultArgument, FaultGroup, FaultKind, FaultRange, FaultSpec};
use crate::limits::LONGEST_M;
use crate::{Obstacle, Problem};

const ANYWHERE: FaultRange = FaultRange::Within(-LONGEST_M, LONGEST_M);

pub(in crate::fault) const KIND: FaultKind = FaultKind {
    spec: FaultSpec {
        name: "obstacle",
        about: "Place an obstacle, or an area of slow or fast ground",
        arguments: &[
            FaultArgument::at("x_m", "Lower left corner: x, m", ANYWHERE),
            FaultArgument::at("y_m", "Lower left corner: y, m", ANYWHERE),
            FaultArgument::at("width_m", "Extent in x, m", FaultRange::Above(LONGEST_M)),
            FaultArgument::at("height_m", "Extent in y, m", FaultRange::Above(LONGEST_M)),
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
    let along = |from: f32, size: f32, room: f32| {
        (
            from + size >= 0.0 && from <= room,
            from <= 0.0 && from + size >= room,
        )
    };
    let (meets_x, fills_x) = along(rectangle.x_m, rectangle.width_m, room.width_m);
    let (meets_y, fills_y) = along(rectangle.y_m, rectangle.height_m, room.height_m);
    let what = if !(meets_x && meets_y) {
        "the obstacle is outside the room"
    } else if fills_x && fills_y {
        "the obstacle fills the room"
    } else {
        return Ok(());
    };
    let remedy = format!(
        "the room is {} m wide and {} m high",
        room.width_m, room.height_m
    );
    Err(Problem::at(["fault", "obstacle"], what, remedy))
}
