//! The world's side of the waste clean-up: spills, deposit, items and report site (thesis §4.1.1).

use alliance_proto::ids::{ItemId, RobotId};
use alliance_proto::readings::{Pose, Zone};
use alliance_proto::rng::{self, Purpose};
use alliance_proto::scenario::Scenario;
use alliance_proto::time::SimTime;
use alliance_proto::view::ItemCounts;
use glam::Vec2;
use rand::Rng;

use super::space::{Space, nearest_place};
use super::{Component, ComponentId, Outline, Penetrability, Shape};

/// Random places tried for an item before the nearest place to the spill's center that will do is taken.
const TRIES: usize = 1000;

/// A waste item.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Its body; while it is carried, its place is where it was picked up.
    pub component: Component,
    /// Who carries it.
    pub carrier: Option<RobotId>,
    id: ItemId,
}

impl Item {
    fn new(index: usize, at: Vec2, radius_m: f32) -> Self {
        let id = ItemId(index as u32);
        Self {
            id,
            carrier: None,
            component: Component {
                id: ComponentId::Item(id),
                pose: Pose {
                    position: at,
                    heading_rad: 0.0,
                },
                shape: Shape::Disc { radius_m },
                penetrability: Penetrability::NEUTRAL,
                aspects: Vec::new(),
            },
        }
    }

    /// Its id.
    #[must_use]
    pub fn id(&self) -> ItemId {
        self.id
    }

    /// Where it lies, or was picked up, m.
    #[must_use]
    pub fn position(&self) -> Vec2 {
        self.component.pose.position
    }
}

#[derive(Clone, Debug)]
pub(super) struct Waste {
    pub items: Vec<Item>,
    pub item_radius_m: f32,
    pub last_report: Option<SimTime>,
    spills: Vec<Outline>,
    deposit: Outline,
    report_site: Outline,
    color: SimTime,
}

impl Waste {
    pub fn new(scenario: &Scenario, seed: u64, space: &Space) -> Self {
        let waste = &scenario.waste;
        let disc = |x_fraction, y_fraction, radius_m| Outline::Disc {
            center: space.size * Vec2::new(x_fraction, y_fraction),
            radius_m,
        };
        let spills = waste
            .spills
            .iter()
            .map(|spill| disc(spill.x_fraction, spill.y_fraction, waste.spill_radius_m));
        let deposit = &waste.deposit;
        Self {
            items: place_items(scenario, seed, space),
            item_radius_m: waste.item_radius_m,
            last_report: None,
            spills: spills.collect(),
            deposit: disc(deposit.x_fraction, deposit.y_fraction, deposit.radius_m),
            report_site: report_site(scenario),
            color: SimTime::from_secs_f64(waste.report_site.color_s),
        }
    }

    pub fn on_floor(&self) -> impl Iterator<Item = &Item> + '_ {
        self.items.iter().filter(|item| item.carrier.is_none())
    }

    pub fn is_deposit(&self, point: Vec2) -> bool {
        self.deposit.contains(point)
    }

    pub fn is_report_site(&self, point: Vec2) -> bool {
        self.report_site.contains(point)
    }

    /// Where a spill overlaps the deposit, it is the deposit.
    pub fn zone(&self, point: Vec2) -> Zone {
        if self.is_deposit(point) {
            Zone::Deposit
        } else if self.spills.iter().any(|spill| spill.contains(point)) {
            Zone::Spill
        } else {
            Zone::None
        }
    }

    pub fn counts(&self) -> ItemCounts {
        let mut counts = ItemCounts::default();
        for item in &self.items {
            *match (item.carrier, self.zone(item.position())) {
                (Some(_), _) => &mut counts.carried,
                (None, Zone::Deposit) => &mut counts.delivered,
                (None, Zone::Spill) => &mut counts.in_spills,
                (None, Zone::None) => &mut counts.on_floor,
            } += 1;
        }
        counts
    }

    pub fn is_complete(&self) -> bool {
        self.items
            .iter()
            .all(|item| item.carrier.is_none() && self.is_deposit(item.position()))
    }

    /// A new item on the floor.
    pub fn add(&mut self, at: Vec2) -> ItemId {
        let item = Item::new(self.items.len(), at, self.item_radius_m);
        let id = item.id;
        self.items.push(item);
        id
    }

    pub fn pick_up(&mut self, item: ItemId, robot: RobotId) {
        self.items[item.0 as usize].carrier = Some(robot);
    }

    /// Whether it lies in the deposit now.
    pub fn put_down(&mut self, item: ItemId, at: Vec2) -> bool {
        let item = &mut self.items[item.0 as usize];
        item.carrier = None;
        item.component.pose.position = at;
        self.is_deposit(at)
    }

    pub fn site_colored(&self, now: SimTime) -> bool {
        self.last_report
            .is_some_and(|report| now.since(report) < self.color)
    }
}

/// At the left wall, centered in y, cut off at the border.
pub(super) fn report_site(scenario: &Scenario) -> Outline {
    let (room, site) = (scenario.room, scenario.waste.report_site);
    let (center_y, half_height) = (room.height_m / 2.0, site.height_m.min(room.height_m) / 2.0);
    Outline::Rectangle {
        min: Vec2::new(0.0, center_y - half_height),
        max: Vec2::new(site.width_m.min(room.width_m), center_y + half_height),
    }
}

/// Each item lies at a random place of its spill, inside the border and clear of solids, at which a robot can grip it.
fn place_items(scenario: &Scenario, seed: u64, space: &Space) -> Vec<Item> {
    let waste = &scenario.waste;
    let mut rng = rng::stream(seed, Purpose::Items);
    let will_do =
        |place: Vec2| space.can_be_gripped(place, waste.item_radius_m, &scenario.body, |_| true);
    let mut items = Vec::new();
    for spill in &waste.spills {
        let center = space.size * Vec2::new(spill.x_fraction, spill.y_fraction);
        for _ in 0..spill.items {
            let mut tries =
                (0..TRIES).map(|_| center + in_unit_disc(&mut rng) * waste.spill_radius_m);
            let place = tries
                .find(|place| will_do(*place))
                .or_else(|| nearest_place(center, space.size, will_do))
                .unwrap_or_else(|| center.clamp(Vec2::ZERO, space.size));
            items.push(Item::new(items.len(), place, waste.item_radius_m));
        }
    }
    items
}

/// Uniform: points of the square that are not in the disc are drawn again.
fn in_unit_disc(rng: &mut impl Rng) -> Vec2 {
    // The upper 24 bits are all that an f32 in [0, 1) can hold.
    let mut coordinate = || (rng.next_u32() >> 8) as f32 / (1 << 23) as f32 - 1.0;
    loop {
        let point = Vec2::new(coordinate(), coordinate());
        if point.length_squared() <= 1.0 {
            return point;
        }
    }
}
