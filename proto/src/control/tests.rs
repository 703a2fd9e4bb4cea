//! The published schema, and the page that tells people of the topic.

use std::collections::BTreeSet;

use super::*;
use crate::fault::{Fault, OrderError};
use crate::scenario::{Catalog, Scenario};

const PAGE: &str = include_str!("../../../docs/CONTROL.md");

/// Names of all faults, as the schema has them.
fn vocabulary() -> BTreeSet<String> {
    let schema = schema();
    let faults = schema["$defs"]["Fault"]["oneOf"].as_array().unwrap();
    let names = faults.iter().map(|fault| fault["required"][0].as_str());
    names.map(|name| name.unwrap().to_owned()).collect()
}

/// What the page's tables set in code, such as ``| `{"kill": "gold"}` | … |``.
fn cells() -> impl Iterator<Item = &'static str> {
    let rows = PAGE.lines().filter_map(|line| line.strip_prefix("| `"));
    rows.filter_map(|row| row.split('`').next())
        .filter(|cell| cell.starts_with('{') || cell.starts_with('"'))
}

/// Anybody's scenario in which each example of the page makes sense.
fn scenario() -> Scenario {
    let text = "[[robots]]\nname = \"blue\"\n[[robots]]\nname = \"gold\"\n[[robots]]\nname = \"green\"\n[[robots]]\nname = \"red\"\nabsent = true\n";
    Scenario::parse("team", text, &crate::testkit::vocabulary()).unwrap()
}

fn check(order: &Order) -> Result<(), OrderError> {
    let scenario = scenario();
    order.check(&scenario, &Catalog::of(&scenario))
}

#[test]
fn the_schema_tells_of_requests_and_replies() {
    let schema = schema();
    assert_eq!(schema["title"], "Request");
    assert_eq!(schema["reply"]["$ref"], "#/$defs/Reply");
    assert!(schema["$defs"]["Reply"]["oneOf"].is_array(), "{schema:#}");
    let nonce = &schema["properties"]["nonce"];
    assert_eq!(nonce["type"], "string");
    assert_eq!(vocabulary().len(), 25);
    assert!(vocabulary().contains("move-waste"));
}

/// Commands or faults; the examples of faults can all be ordered.
#[test]
fn the_page_has_an_example_of_every_fault() {
    let mut shown = BTreeSet::new();
    for cell in cells() {
        if let Ok(fault) = serde_json::from_str::<Fault>(cell) {
            shown.insert(fault.name().to_owned());
            assert_eq!(check(&Order::now(fault)), Ok(()), "{cell}");
        } else if let Err(error) = serde_json::from_str::<ControlCommand>(cell) {
            let reply = serde_json::from_str::<Reply>(cell);
            assert!(reply.is_ok(), "{error}: {cell}");
        }
    }
    assert_eq!(shown, vocabulary());
}
