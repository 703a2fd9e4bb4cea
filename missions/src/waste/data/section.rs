//! `[waste]` of a scenario file.

use glam::Vec2;
use serde::{Deserialize, Serialize};

use alliance_proto::scenario::{Room, Scenario};

/// The hazardous waste clean-up (thesis §4.1).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WasteSection {
    /// The initial spill locations.
    pub spills: Vec<Spill>,
    /// Radius of each spill, m.
    pub spill_radius_m: f32,
    /// Radius of an item, m.
    pub item_radius_m: f32,
    /// The desired final spill location.
    pub deposit: Deposit,
    /// More deposits of the same radius, for large rooms: waste goes to the one nearest to its spill.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub further_deposits: Vec<Spot>,
    /// The report progress site.
    pub report_site: ReportSite,
    /// Wanted time between two progress reports, s.
    pub report_period_s: f64,
    /// Whether the robots know the border beforehand, and with it where everything is.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub border_known: bool,
    /// Whether what is delivered comes back at the spill, so that there is no end but time: foraging.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub respawn: bool,
    /// After this foraging is complete, s; absent: at the time limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
}

impl WasteSection {
    /// The section of a scenario of this mission.
    ///
    /// # Panics
    /// If the scenario is of another one: nobody but this mission asks.
    #[must_use]
    pub fn of(scenario: &Scenario) -> &Self {
        scenario.section()
    }

    /// The same, to be written to.
    ///
    /// # Panics
    /// As [`WasteSection::of`] does.
    pub fn of_mut(scenario: &mut Scenario) -> &mut Self {
        let section = scenario.mission.values_mut();
        section.expect("a scenario of the waste clean-up")
    }

    /// Centers of all deposits.
    pub fn deposits(&self) -> impl Iterator<Item = Spot> + '_ {
        let first = Spot {
            x_fraction: self.deposit.x_fraction,
            y_fraction: self.deposit.y_fraction,
        };
        std::iter::once(first).chain(self.further_deposits.iter().copied())
    }
}

/// A place in the room.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spot {
    /// As a fraction of the room's width.
    pub x_fraction: f32,
    /// As a fraction of the room's height.
    pub y_fraction: f32,
}

impl Spot {
    /// Where that is, m.
    #[must_use]
    pub fn in_room(self, room: &Room) -> Vec2 {
        Vec2::new(room.width_m, room.height_m) * Vec2::new(self.x_fraction, self.y_fraction)
    }
}

impl Spill {
    /// Its center.
    #[must_use]
    pub fn spot(&self) -> Spot {
        Spot {
            x_fraction: self.x_fraction,
            y_fraction: self.y_fraction,
        }
    }
}

impl Default for WasteSection {
    fn default() -> Self {
        let spill = |name: &str, y_fraction| Spill {
            name: name.to_owned(),
            items: 12,
            x_fraction: 1.0 / 3.0,
            y_fraction,
        };
        Self {
            spills: vec![spill("top", 2.0 / 3.0), spill("bottom", 1.0 / 3.0)],
            spill_radius_m: 0.8,
            item_radius_m: 0.05,
            deposit: Deposit::default(),
            further_deposits: Vec::new(),
            report_site: ReportSite::default(),
            report_period_s: 120.0,
            border_known: false,
            respawn: false,
            duration_s: None,
        }
    }
}

/// An initial spill location. Robots know the fractions, not the place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spill {
    /// Name of the spill; its task is `move-spill(NAME)`.
    pub name: String,
    /// Number of items at the start.
    pub items: u32,
    /// Centre, as a fraction of the room's width.
    pub x_fraction: f32,
    /// Centre, as a fraction of the room's height.
    pub y_fraction: f32,
}

impl Default for Spill {
    fn default() -> Self {
        Self {
            name: String::new(),
            items: 12,
            x_fraction: 1.0 / 3.0,
            y_fraction: 0.5,
        }
    }
}

/// The deposit: a disc.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Deposit {
    /// Radius, m.
    pub radius_m: f32,
    /// Centre, as a fraction of the room's width.
    pub x_fraction: f32,
    /// Centre, as a fraction of the room's height.
    pub y_fraction: f32,
}

impl Default for Deposit {
    fn default() -> Self {
        Self {
            radius_m: 1.0,
            x_fraction: 0.8,
            y_fraction: 0.5,
        }
    }
}

/// The report progress site: a rectangle at the left wall, centered in y, cut off at the border.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReportSite {
    /// Extent in x, m.
    pub width_m: f32,
    /// Extent in y, m.
    pub height_m: f32,
    /// How long it shows its changed color after a report, s.
    pub color_s: f64,
}

impl Default for ReportSite {
    fn default() -> Self {
        Self {
            width_m: 0.6,
            height_m: 3.0,
            color_s: 5.0,
        }
    }
}
