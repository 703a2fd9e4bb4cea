//! Faults of the clean-up: added waste and moved items.

use scenario::Problem;
use scenario::fault::{EventTrigger, Fault, FaultArgument, FaultRange, FaultSpec, Order};

use super::check::{MAX_ITEMS, MAX_ITEMS_TOTAL};

pub const ADD_WASTE: &str = "waste";
pub const MOVE_WASTE: &str = "move-waste";

const X: FaultArgument = FaultArgument::new("x_m", "place, m", FaultRange::X, None);
const Y: FaultArgument = FaultArgument::new("y_m", "place, m", FaultRange::Y, None);

pub(super) const ALL: &[FaultSpec] = &[
    FaultSpec {
        name: ADD_WASTE,
        about: "put new waste on the floor",
        arguments: &[
            X,
            Y,
            FaultArgument::new(
                "items",
                "number of items",
                FaultRange::Whole(1, MAX_ITEMS),
                Some(1.0),
            ),
        ],
    },
    FaultSpec {
        name: MOVE_WASTE,
        about: "move an item that lies on the floor",
        arguments: &[
            FaultArgument::new(
                "item",
                "number of the item: 7 for the item-7 of events.csv",
                FaultRange::Item,
                None,
            ),
            X,
            Y,
        ],
    },
];

/// Rejects a repeated fault that would add too many items until the run ends.
pub(super) fn check(limit_s: f64, order: &Order) -> Result<(), Problem> {
    let (Fault::Mission(fault), Some(every_s)) = (&order.fault, order.every_s) else {
        return Ok(());
    };
    if fault.name != ADD_WASTE {
        return Ok(());
    }
    let at_once = fault.get("items").unwrap_or(1.0);
    let first_s = order.at_s.unwrap_or_default();
    let times = ((limit_s - first_s) / every_s).max(0.0).floor() + 1.0;
    let items = times * at_once;
    if items <= f64::from(MAX_ITEMS_TOTAL) {
        return Ok(());
    }
    let what = format!(
        "items = {at_once} every {every_s} s gives {items:.0} items until limit_s, {limit_s} s"
    );
    let remedy =
        format!("keep the total at most {MAX_ITEMS_TOTAL}: add fewer items, or less often");
    Err(Problem::at(["every_s"], what, remedy))
}

/// Rejects an object of a trigger that no event has. Faults add items, so that any number of an item is possible.
pub(super) fn check_trigger(when: &EventTrigger) -> Result<(), Problem> {
    let is_item = |object: &str| EventTrigger::number_of(object, "item-").is_some();
    match when.what.as_str() {
        "picks" | "drops" | "delivers" => {
            when.check_object(is_item, "name an item, such as item-7")
        }
        "reports" | "finds" => when.check_object(|_| false, "omit the object"),
        _ => Ok(()),
    }
}
