//! Faults of the clean-up: waste that is strewn, and items that are put elsewhere.

use alliance_proto::fault::{
    Fault, FaultArgument, FaultRange, FaultSpec, MissionFault, Order, OrderError,
};

use super::check::{MAX_ITEMS, MAX_ITEMS_IN_ALL};

/// Name of the fault that strews waste.
pub const WASTE: &str = "waste";
/// Name of the fault that puts an item elsewhere.
pub const MOVE_WASTE: &str = "move-waste";

const X: FaultArgument = FaultArgument {
    key: "x_m",
    about: "where to, m",
    range: FaultRange::X,
    default: None,
};
const Y: FaultArgument = FaultArgument {
    key: "y_m",
    range: FaultRange::Y,
    ..X
};

/// All of them.
pub(super) const ALL: &[FaultSpec] = &[
    FaultSpec {
        name: WASTE,
        about: "put new waste on the floor",
        arguments: &[
            X,
            Y,
            FaultArgument {
                key: "items",
                about: "how many items",
                range: FaultRange::Whole(1, MAX_ITEMS),
                default: Some(1.0),
            },
        ],
    },
    FaultSpec {
        name: MOVE_WASTE,
        about: "put an item that lies on the floor elsewhere",
        arguments: &[
            FaultArgument {
                key: "item",
                about: "number of the item: 7 for the item-7 of events.csv",
                range: FaultRange::Item,
                default: None,
            },
            X,
            Y,
        ],
    },
];

/// So many items near a place, m.
#[must_use]
pub fn strew(x_m: f64, y_m: f64, items: u32) -> Fault {
    let values = [("x_m", x_m), ("y_m", y_m), ("items", items.into())];
    Fault::Mission(MissionFault::new(WASTE, &values))
}

/// An item near a place, m.
#[must_use]
pub fn move_waste(item: u32, x_m: f64, y_m: f64) -> Fault {
    let values = [("item", item.into()), ("x_m", x_m), ("y_m", y_m)];
    Fault::Mission(MissionFault::new(MOVE_WASTE, &values))
}

/// Refuses what is strewn again and again, and would be more and more until the run ends.
pub(super) fn check(limit_s: f64, order: &Order) -> Result<(), OrderError> {
    let (Fault::Mission(fault), Some(every_s)) = (&order.fault, order.every_s) else {
        return Ok(());
    };
    if fault.name != WASTE {
        return Ok(());
    }
    let at_once = fault.get("items").unwrap_or(1.0);
    let first_s = order.at_s.unwrap_or_default();
    let times = ((limit_s - first_s) / every_s).max(0.0).floor() + 1.0;
    let items = times * at_once;
    if items <= f64::from(MAX_ITEMS_IN_ALL) {
        return Ok(());
    }
    let what =
        format!("{at_once} items every {every_s} s are {items:.0} until limit_s, {limit_s} s");
    let remedy =
        format!("let it be at most {MAX_ITEMS_IN_ALL} in all: strew fewer, or more rarely");
    Err(OrderError::at(&["every_s"], what, &remedy))
}
