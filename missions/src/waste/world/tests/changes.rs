//! Faults that add and move waste.

use glam::Vec2;
use world_server::interruption::Interruption;
use world_server::world::World;

use super::waste;
use crate::waste::MISSION;
use crate::waste::data::default_setup;

fn interruption(json: &str) -> Interruption {
    let fault = serde_json::from_str(json).unwrap();
    Interruption::from_fault(&fault, &default_setup(1).roster)
}

fn world() -> World {
    World::new(&default_setup(1), MISSION.world)
}

#[test]
fn waste_is_added_and_moved_and_stays_after_the_fault() {
    let mut world = world();
    let mut added = interruption(r#"{"waste":{"x_m":6,"y_m":7,"items":2}}"#);
    assert_eq!(
        added.begin(&mut world).unwrap().unwrap(),
        "item-24 6 7, item-25 6.1 7"
    );
    added.end(&mut world);
    assert_eq!(waste(&world).counts().total(), 26);
    let mut moved = interruption(r#"{"move-waste":{"item":25,"x_m":2,"y_m":1}}"#);
    assert_eq!(moved.begin(&mut world).unwrap().unwrap(), "item-25 2 1");
    moved.end(&mut world);
    assert_eq!(waste(&world).items()[25].position, Vec2::new(2.0, 1.0));
    let mut none = interruption(r#"{"move-waste":{"item":26,"x_m":2,"y_m":1}}"#);
    let error = none.begin(&mut world).unwrap().unwrap_err();
    assert_eq!(error.to_string(), "there is no item-26");
}
