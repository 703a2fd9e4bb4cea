//! The page that tells people of the control topic speaks of the default mission.

use alliance_proto::control::{ControlCommand, Reply, Request};
use alliance_proto::rendezvous::Rendezvous;
use alliance_proto::scenario::{Catalog, Scenario};

use crate::Registry;

const PAGE: &str = include_str!("../../../../../docs/CONTROL.md");

/// The page's blocks of JSON.
fn blocks() -> Vec<&'static str> {
    let parts = PAGE.split("```json\n").skip(1);
    parts
        .map(|part| part.split("```").next().unwrap())
        .collect()
}

#[test]
fn every_block_of_the_page_is_what_it_shows() {
    // Anybody's scenario in which each example of the page makes sense.
    let text = "[[robots]]\nname = \"blue\"\nside_sensor = true\n[[robots]]\nname = \"gold\"\n[[robots]]\nname = \"green\"\n[[robots]]\nname = \"red\"\nabsent = true\n";
    let scenario = Scenario::parse("team", text, &Registry::built_in().vocabulary()).unwrap();
    let catalog = Catalog::of(&scenario);
    let mut requests = 0;
    for block in blocks() {
        if let Ok(request) = serde_json::from_str::<Request>(block) {
            requests += 1;
            if let ControlCommand::Fault(order) = request.command {
                assert_eq!(order.check(&scenario, &catalog), Ok(()), "{block}");
            }
        } else if serde_json::from_str::<Rendezvous>(block).is_err() {
            let reply = serde_json::from_str::<Reply>(block);
            assert!(reply.is_ok(), "{reply:?}: {block}");
        }
    }
    assert!(requests > 0);
}
