//! The section `[waste]` of a scenario file.

use glam::Vec2;
use serde::{Deserialize, Serialize};

use scenario::{Room, Scenario};

/// The distance inside the deposit's edge at which a robot that faces inward drops its load, m.
pub(in crate::waste) const INSIDE_DEPOSIT_M: f32 = 0.1;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WasteSection {
    pub spills: Vec<Spill>,
    pub spill_radius_m: f32,
    pub item_radius_m: f32,
    pub deposit: Deposit,
    /// More deposits of the same radius, for large rooms. Waste goes to the deposit nearest to its spill.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub further_deposits: Vec<Spot>,
    pub report_site: ReportSite,
    pub report_period_s: f64,
    /// True if the briefing contains the border, and with it all places.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub border_known: bool,
    /// True if delivered items return to a spill (foraging). The run then ends only by time.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub respawn: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
}

impl WasteSection {
    #[must_use]
    pub fn of(scenario: &Scenario) -> &Self {
        scenario.section()
    }

    /// Returns the section of a scenario of this mission for writing.
    ///
    /// # Panics
    /// If the scenario is of another mission.
    pub fn of_mut(scenario: &mut Scenario) -> &mut Self {
        let section = scenario.mission.values_mut();
        section.expect("a scenario of the waste clean-up")
    }

    pub fn deposits(&self) -> impl Iterator<Item = Spot> + '_ {
        let first = Spot {
            x_fraction: self.deposit.x_fraction,
            y_fraction: self.deposit.y_fraction,
        };
        std::iter::once(first).chain(self.further_deposits.iter().copied())
    }
}

/// Returns the lower left and upper right corner of the report site, m. The site lies at the left wall, centered in y,
/// and is cut off at the border.
pub(in crate::waste) fn report_site(scenario: &Scenario) -> [Vec2; 2] {
    let (room, site) = (scenario.room, WasteSection::of(scenario).report_site);
    let (center_y, half_height) = (room.middle().y, site.height_m.min(room.height_m) / 2.0);
    [
        Vec2::new(room.x_m, center_y - half_height),
        Vec2::new(
            room.x_m + site.width_m.min(room.width_m),
            center_y + half_height,
        ),
    ]
}

/// A place in the room, independent of the room's size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spot {
    /// The fraction of the room's width, from the left.
    pub x_fraction: f32,
    /// The fraction of the room's height, from the bottom.
    pub y_fraction: f32,
}

impl Spot {
    /// Returns the place in a given room, m.
    #[must_use]
    pub fn in_room(self, room: &Room) -> Vec2 {
        room.at(Vec2::new(self.x_fraction, self.y_fraction))
    }
}

impl Spill {
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

/// An initial spill. The briefing contains the fractions, but not the place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spill {
    pub name: String,
    pub items: u32,
    pub x_fraction: f32,
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

/// A disc to which waste is carried.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Deposit {
    pub radius_m: f32,
    pub x_fraction: f32,
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

/// The report site: a rectangle at the left wall, centered in y, cut off at the border.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReportSite {
    pub width_m: f32,
    pub height_m: f32,
    /// The time for which the site shows its changed color after a report, s.
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
