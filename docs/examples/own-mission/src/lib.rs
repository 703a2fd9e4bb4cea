//! `visit`: places to be touched once, by whoever gets there.

pub mod data;
pub mod mind;
pub mod world;

use missions::MissionParts;

/// All of it.
pub const VISIT: MissionParts = MissionParts::of::<world::Visit, mind::Visitor>(data::VISIT);

#[cfg(test)]
mod tests {
    const SCENARIO: &str = include_str!("../visit.toml");

    #[test]
    fn visit_keeps_the_laws_of_every_mission() {
        missions::testkit::mission(super::VISIT, SCENARIO);
    }
}
