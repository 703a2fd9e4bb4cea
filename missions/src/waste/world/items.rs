//! The contents of the floor: spills, deposits, items and report site (thesis §4.1.1).

use std::ops::Range;
use std::sync::OnceLock;

use crate::waste::data::ItemCounts;
use crate::waste::data::{Spill, WasteSection, report_site};
use glam::Vec2;
use proto::mission::items::Zone;
use rand::Rng;
use scenario::Scenario;
use scenario::ids::{ItemId, RobotId};
use scenario::rng::{self, Purpose};
use scenario::time::SimTime;
use xxhash_rust::xxh3::xxh3_64;

use world_server::world::{Floor, Grid, Outline};

/// The number of random places tried for an item. After that the item gets the nearest valid place to the spill's
/// center.
const TRIES: usize = 1000;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Item {
    /// The place of the item, m. For a carried item, the place where it was picked up.
    pub position: Vec2,
    pub carrier: Option<RobotId>,
}

/// The label and the items of a deposit or spill, for display.
#[derive(Clone, Debug)]
pub(super) struct ZoneInfo {
    pub name: String,
    /// The items that lay there at the start. Empty for a deposit.
    pub items: Range<usize>,
}

#[derive(Clone, Debug)]
pub(super) struct WasteFloor {
    items: Vec<Item>,
    hash: u64,
    /// The items on the floor, by place.
    floor: Grid,
    counts: ItemCounts,
    pub item_radius_m: f32,
    zones: Vec<(Zone, Outline)>,
    /// The names and items of `zones`, in the same order.
    places: Vec<ZoneInfo>,
    /// The indices of `zones` by center, and the largest radius of a zone, m.
    zone_centers: Grid,
    zone_reach_m: f32,
    report_site: Outline,
    /// The number of items per spill that lie outside the deposits. Filled on the first query.
    left: OnceLock<Vec<i32>>,
    /// The state of foraging. `None` if delivered items stay in the deposit.
    pub foraging: Option<Foraging>,
}

/// The state of a foraging mission, in which delivered items return to a spill.
#[derive(Clone, Debug)]
pub(super) struct Foraging {
    seed: u64,
    pub deliveries: u32,
    /// The duration of the run so far, in whole steps.
    pub elapsed: SimTime,
    step: SimTime,
    pub duration: SimTime,
}

impl Foraging {
    pub fn step(&mut self) {
        self.elapsed = self.elapsed + self.step;
    }
}

impl WasteFloor {
    pub fn new(scenario: &Scenario, seed: u64, floor: &Floor) -> Self {
        let waste = WasteSection::of(scenario);
        let spills = waste.spills.iter().map(Spill::spot);
        let spills = spills.map(|spot| (Zone::Source, spot, waste.spill_radius_m));
        let deposits = waste.deposits();
        let deposits = deposits.map(|spot| (Zone::Target, spot, waste.deposit.radius_m));
        let zone_reach_m = waste.spill_radius_m.max(waste.deposit.radius_m);
        let discs: Vec<_> = deposits.chain(spills).collect();
        let mut zone_centers = Grid::new(floor.room(), zone_reach_m, discs.len());
        let zones = discs.into_iter().enumerate();
        let zones = zones.map(|(index, (zone, spot, radius_m))| {
            let center = spot.in_room(&scenario.room);
            zone_centers.insert(index, center);
            (zone, Outline::Disc { center, radius_m })
        });
        let zones = zones.collect();
        let sensed_m = scenario.body.radius_m + scenario.sensors.item_range_m;
        let [min, max] = report_site(scenario);
        let places = places_of_items(scenario, seed, floor);
        let mut new = Self {
            items: Vec::new(),
            hash: 0,
            floor: Grid::new(floor.room(), sensed_m, places.len()),
            counts: ItemCounts::default(),
            item_radius_m: waste.item_radius_m,
            zones,
            places: named(waste),
            zone_centers,
            zone_reach_m,
            report_site: Outline::Rectangle { min, max },
            left: OnceLock::new(),
            foraging: waste.respawn.then(|| Foraging {
                seed,
                deliveries: 0,
                elapsed: SimTime::ZERO,
                step: SimTime(scenario.step_ms),
                duration: SimTime::from_secs_f64(waste.duration_s.unwrap_or(scenario.limit_s)),
            }),
        };
        for place in places {
            new.add(place);
        }
        new
    }

    pub fn items(&self) -> &[Item] {
        &self.items
    }

    /// Returns all deposits, then all spills.
    pub fn zones(&self) -> impl Iterator<Item = (&ZoneInfo, Zone, Outline)> {
        let zones = self.places.iter().zip(&self.zones);
        zones.map(|(place, &(zone, outline))| (place, zone, outline))
    }

    pub fn report_site(&self) -> Outline {
        self.report_site
    }

    /// Returns the items on the floor within reach of a point with their places, and some items slightly farther away.
    pub fn near(&self, point: Vec2, reach_m: f32) -> impl Iterator<Item = (ItemId, Vec2)> + '_ {
        let near = self.floor.near(point, reach_m);
        near.map(|(id, at)| (ItemId(id as u32), at))
    }

    pub fn is_deposit(&self, point: Vec2) -> bool {
        self.zone(point) == Zone::Target
    }

    pub fn is_report_site(&self, point: Vec2) -> bool {
        self.report_site.contains(point)
    }

    /// Returns the zone at a point. A deposit takes precedence over a spill.
    pub fn zone(&self, point: Vec2) -> Zone {
        self.zone_within(point, 0.0).0
    }

    /// Returns the zone at a point, and the distance to the nearest edge of a zone, at most `far_m`, m.
    pub fn zone_within(&self, point: Vec2, far_m: f32) -> (Zone, f32) {
        let (mut found, mut edge_m) = (Zone::None, far_m);
        for (index, _) in self.zone_centers.near(point, self.zone_reach_m + far_m) {
            let (zone, outline) = self.zones[index];
            let (distance_m, _) = outline.surface(point);
            edge_m = edge_m.min(distance_m.abs());
            if distance_m <= 0.0 && found != Zone::Target {
                found = zone;
            }
        }
        (found, edge_m)
    }

    /// Checks whether waste of a spill remains outside the deposits or is the given load. An item belongs to the spill
    /// that was nearest when the item was last touched, the first at equal distance.
    pub fn has_waste_of_spill(&self, spill: u32, load: Option<ItemId>) -> bool {
        let spill = spill as usize;
        let left = self.left.get_or_init(|| {
            let mut left = vec![0; self.zones.len()];
            let lie = self.items.iter().filter(|item| item.carrier.is_none());
            for spill in lie.filter_map(|item| self.spill_left_of(item.position)) {
                left[spill] += 1;
            }
            left
        });
        let belongs = |item: ItemId| {
            let from = self.items[item.0 as usize].position;
            self.nearest_spill(from)
                .is_some_and(|nearest| nearest.0 == spill)
        };
        left[spill] > 0 || load.is_some_and(belongs)
    }

    /// Returns the spill to which an item at this place belongs, or `None` in a deposit.
    fn spill_left_of(&self, at: Vec2) -> Option<usize> {
        let nearest = self.nearest_spill(at).filter(|_| !self.is_deposit(at));
        nearest.map(|(spill, ..)| spill)
    }

    /// Updates the number of remaining items when an item appears at a place or disappears.
    fn note_left(&mut self, at: Vec2, more: i32) {
        if self.left.get().is_none() {
            // No query was made yet, as in most runs.
            return;
        }
        let spill = self.spill_left_of(at);
        if let (Some(spill), Some(left)) = (spill, self.left.get_mut()) {
            left[spill] += more;
        }
    }

    /// Returns number, center and radius in m of the spill nearest to a place, the first at equal distance.
    fn nearest_spill(&self, at: Vec2) -> Option<(usize, Vec2, f32)> {
        let discs = self.zones.iter().filter(|(zone, _)| *zone == Zone::Source);
        let discs = discs.filter_map(|(_, outline)| match outline {
            Outline::Disc { center, radius_m } => Some((*center, *radius_m)),
            _ => None,
        });
        let spills = discs
            .enumerate()
            .map(|(spill, (center, radius_m))| (spill, center, radius_m));
        let squared_distance = |center: Vec2| center.distance_squared(at);
        spills.min_by(|a, b| squared_distance(a.1).total_cmp(&squared_distance(b.1)))
    }

    /// Returns the number of items per kind of place.
    pub fn counts(&self) -> ItemCounts {
        self.counts
    }

    /// Returns the item counts, with the total number of deliveries for a foraging mission.
    pub fn counts_with_all_deliveries(&self) -> ItemCounts {
        let foraging = self.foraging.as_ref();
        ItemCounts {
            delivered: foraging.map_or(self.counts.delivered, |foraging| foraging.deliveries),
            ..self.counts
        }
    }

    pub fn is_complete(&self, now: SimTime) -> bool {
        match &self.foraging {
            Some(foraging) => now >= foraging.duration,
            // Without any item the mission waits for added waste.
            None => !self.items.is_empty() && self.counts.delivered as usize == self.items.len(),
        }
    }

    /// Returns a delivered item to a random place of the spill nearest to where it was picked up. Returns that place,
    /// or `None` if the deposit keeps its items.
    pub fn respawn(&mut self, item: ItemId, picked_up: Vec2, floor: &Floor) -> Option<Vec2> {
        let (_, center, radius_m) = self.nearest_spill(picked_up)?;
        let foraging = self.foraging.as_mut()?;
        let mut rng = rng::stream(foraging.seed, Purpose::Mission);
        // Each delivery uses its own section of the random stream.
        rng.set_word_pos(u128::from(foraging.deliveries) << 16);
        foraging.deliveries += 1;
        let place = place_in_spill(center, radius_m, floor, &mut rng, |place| {
            // An item must not return to a place inside a deposit.
            !self.is_deposit(place) && floor.can_be_gripped(place, self.item_radius_m, |_| true)
        });
        self.relocate(item, place);
        Some(place)
    }

    pub fn add(&mut self, at: Vec2) -> ItemId {
        let id = ItemId(self.items.len() as u32);
        self.items.push(Item {
            position: at,
            carrier: None,
        });
        self.lay(id, at);
        id
    }

    pub fn pick_up(&mut self, item: ItemId, robot: RobotId) {
        self.take_up(item);
        self.items[item.0 as usize].carrier = Some(robot);
        self.counts.carried += 1;
        self.hash = self.hash.wrapping_add(self.hash_of(item));
    }

    /// Puts a carried item on the floor. Returns whether it lies in a deposit.
    pub fn put_down(&mut self, item: ItemId, at: Vec2) -> bool {
        self.hash = self.hash.wrapping_sub(self.hash_of(item));
        self.items[item.0 as usize].carrier = None;
        self.counts.carried -= 1;
        self.lay(item, at);
        self.is_deposit(at)
    }

    pub fn relocate(&mut self, item: ItemId, to: Vec2) {
        self.take_up(item);
        self.lay(item, to);
    }

    fn lay(&mut self, item: ItemId, at: Vec2) {
        let index = item.0 as usize;
        self.items[index].position = at;
        self.floor.insert(index, at);
        *self.count(at) += 1;
        self.note_left(at, 1);
        self.hash = self.hash.wrapping_add(self.hash_of(item));
    }

    fn take_up(&mut self, item: ItemId) {
        self.hash = self.hash.wrapping_sub(self.hash_of(item));
        let index = item.0 as usize;
        let from = self.items[index].position;
        self.floor.remove(index);
        *self.count(from) -= 1;
        self.note_left(from, -1);
    }

    /// Returns a hash of the places of all items, updated incrementally, and of the number of deliveries. That number
    /// determines where the next delivered item returns.
    pub fn hash(&self) -> u64 {
        let deliveries = self
            .foraging
            .as_ref()
            .map_or(0, |foraging| foraging.deliveries);
        self.hash ^ u64::from(deliveries).wrapping_mul(0xd6e8_feb8_6659_fd93)
    }

    fn hash_of(&self, item: ItemId) -> u64 {
        let Item { position, carrier } = self.items[item.0 as usize];
        let carrier = carrier.map_or(u32::MAX, |robot| robot.0);
        let words = [item.0, position.x.to_bits(), position.y.to_bits(), carrier];
        let mut bytes = [0; 16];
        for (place, word) in bytes.chunks_exact_mut(4).zip(words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        xxh3_64(&bytes)
    }

    /// Returns the counter of items for the zone at a point.
    fn count(&mut self, point: Vec2) -> &mut u32 {
        match self.zone(point) {
            Zone::Target => &mut self.counts.delivered,
            Zone::Source => &mut self.counts.in_spills,
            Zone::None => &mut self.counts.on_floor,
        }
    }
}

/// Returns the names and item ids of all deposits, then of all spills. Item ids follow the order of the spills.
fn named(waste: &WasteSection) -> Vec<ZoneInfo> {
    let mut next = 0;
    let deposits = waste.deposits().map(|_| ZoneInfo {
        name: "deposit".to_owned(),
        items: 0..0,
    });
    let spills = waste.spills.iter().map(|spill| {
        let items = next..next + spill.items as usize;
        next = items.end;
        ZoneInfo {
            name: format!("spill ({})", spill.name),
            items,
        }
    });
    deposits.chain(spills).collect()
}

/// Draws a place for each item: inside its spill and the border, free of solids, and reachable for a gripper.
fn places_of_items(scenario: &Scenario, seed: u64, floor: &Floor) -> Vec<Vec2> {
    let waste = WasteSection::of(scenario);
    let mut rng = rng::stream(seed, Purpose::Items);
    let radius_m = waste.spill_radius_m;
    let will_do = |place: Vec2| floor.can_be_gripped(place, waste.item_radius_m, |_| true);
    let mut places = Vec::new();
    for spill in &waste.spills {
        let center = spill.spot().in_room(floor.room());
        for _ in 0..spill.items {
            places.push(place_in_spill(center, radius_m, floor, &mut rng, will_do));
        }
    }
    places
}

/// Draws a valid place in a spill. Falls back to the nearest valid place to its center.
fn place_in_spill(
    center: Vec2,
    radius_m: f32,
    floor: &Floor,
    rng: &mut impl Rng,
    will_do: impl Fn(Vec2) -> bool,
) -> Vec2 {
    let mut tries = (0..TRIES).map(|_| center + in_unit_disc(rng) * radius_m);
    tries
        .find(|place| will_do(*place))
        .or_else(|| floor.nearest_place(center, will_do))
        .unwrap_or_else(|| center.clamp(floor.room().low(), floor.room().high()))
}

/// Draws a uniformly distributed point in the unit disc by rejection.
fn in_unit_disc(rng: &mut impl Rng) -> Vec2 {
    // An f32 in [0, 1) holds 24 bits, so the upper 24 bits suffice.
    let mut coordinate = || (rng.next_u32() >> 8) as f32 / (1 << 23) as f32 - 1.0;
    loop {
        let point = Vec2::new(coordinate(), coordinate());
        if point.length_squared() <= 1.0 {
            return point;
        }
    }
}
