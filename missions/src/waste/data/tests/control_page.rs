//! The examples in docs/CONTROL.md are valid for the default mission.

use std::collections::BTreeSet;

use cluster::rendezvous::Rendezvous;
use proto::control::{ControlCommand, Reply, Request};
use scenario::fault::{Fault, Order};
use scenario::{Catalog, Problem, Scenario};

use crate::Registry;
use crate::waste::data::WASTE;

const PAGE: &str = include_str!("../../../../../docs/CONTROL.md");

/// Returns the JSON blocks of the page.
fn blocks() -> Vec<&'static str> {
    let parts = PAGE.split("```json\n").skip(1);
    parts
        .map(|part| part.split("```").next().unwrap())
        .collect()
}

/// Returns the inline code in the first cells of the page's tables, such as ``| `{"kill": "gold"}` | … |``.
fn cells() -> impl Iterator<Item = &'static str> {
    let rows = PAGE.lines().filter_map(|line| line.strip_prefix("| `"));
    rows.filter_map(|row| row.split('`').next())
        .filter(|cell| cell.starts_with('{') || cell.starts_with('"'))
}

/// Checks an example against a scenario in which it is valid.
fn check(order: &Order) -> Result<(), Problem> {
    let text = "[[robots]]\nname = \"blue\"\nside_sensor = true\n[[robots]]\nname = \"gold\"\n[[robots]]\nname = \"green\"\n[[robots]]\nname = \"red\"\nabsent = true\n";
    let vocabulary = Registry::built_in().vocabulary();
    // The clean-up has no skills.
    let text = match &order.fault {
        Fault::Skill(_) => vocabulary.builtin("janitorial").unwrap().text,
        _ => text,
    };
    let scenario = Scenario::parse("team", text, &vocabulary).unwrap();
    order.check(&scenario, &Catalog::new(&scenario))
}

#[test]
fn every_block_of_the_page_is_valid() {
    let mut requests = 0;
    for block in blocks() {
        if let Ok(request) = serde_json::from_str::<Request>(block) {
            requests += 1;
            if let ControlCommand::Fault(order) = request.command {
                assert_eq!(check(&order), Ok(()), "{block}");
            }
        } else if serde_json::from_str::<Rendezvous>(block).is_err() {
            let reply = serde_json::from_str::<Reply>(block);
            assert!(reply.is_ok(), "{reply:?}: {block}");
        }
    }
    assert!(requests > 0);
}

/// Every table cell is a command, a reply or a fault, and each fault can be ordered.
#[test]
fn the_page_has_an_example_of_every_fault() {
    let mut shown = BTreeSet::new();
    for cell in cells() {
        if serde_json::from_str::<ControlCommand>(cell).is_ok()
            || serde_json::from_str::<Reply>(cell).is_ok()
        {
            continue;
        }
        let fault: Fault = serde_json::from_str(cell).unwrap();
        shown.insert(fault.name().to_owned());
        assert_eq!(check(&Order::now(fault)), Ok(()), "{cell}");
    }
    let own = WASTE.vocabulary().faults.iter().map(|spec| spec.name);
    let all = Fault::COMMON_NAMES.into_iter().chain(own);
    assert_eq!(shown, all.map(str::to_owned).collect());
}
