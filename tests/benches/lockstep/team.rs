//! Scenarios for teams of any size.

use missions::Registry;
use scenario::{Scenario, Setup};

pub struct Team {
    pub size: usize,
    pub text: String,
    pub setup: Setup,
}

impl Team {
    pub fn default_mission() -> Self {
        Self::of("name = \"default\"\n".to_owned(), 3)
    }

    /// Returns a team of `size` robots with the top speed and the items per spill. The first robot has blue's body,
    /// the others have gold's.
    pub fn busy(size: usize, speed_m_s: f64, items: usize, limit_s: f64) -> Self {
        let spills = [("top", 0.667), ("bottom", 0.333)].map(|(name, y)| {
            format!("[[waste.spills]]\nname = \"{name}\"\nitems = {items}\ny_fraction = {y}\n")
        });
        let robots: String = (0..size)
            .map(|rank| {
                let side_sensor = rank == 0;
                format!("[[robots]]\nname = \"r{rank}\"\nside_sensor = {side_sensor}\n")
            })
            .collect();
        let head = format!(
            "name = \"team-of-{size}\"\nlimit_s = {limit_s:.1}\n[body]\nspeed_m_s = {speed_m_s}\n"
        );
        Self::of(head + &spills.concat() + &robots, size)
    }

    fn of(text: String, size: usize) -> Self {
        let scenario =
            Scenario::parse("team.toml", &text, &Registry::built_in().vocabulary()).unwrap();
        let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        Self { size, text, setup }
    }
}
