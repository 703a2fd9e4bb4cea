//! Faults that add or move items. They never lose or duplicate an item.

use glam::Vec2;
use scenario::fault::MissionFault;
use scenario::ids::ItemId;

use super::Waste;
use crate::waste::data::{ADD_WASTE, MOVE_WASTE};
use world_server::world::{ChangeError, Floor, ROUNDING_M};

/// The reason why a fault cannot place an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlaceError {
    #[error("there is no {0}")]
    NoItem(ItemId),
    #[error("{0} is being carried")]
    Carried(ItemId),
    /// The item lies in a deposit, which keeps its items.
    #[error("{0} is in the deposit")]
    Delivered(ItemId),
    /// No free place for an item exists in the room.
    #[error("no place is left where a robot could grip an item")]
    NoPlace,
}

impl From<PlaceError> for ChangeError {
    fn from(error: PlaceError) -> Self {
        Self::Mission(error.to_string())
    }
}

impl Waste {
    pub(super) fn apply_fault(
        &mut self,
        fault: &MissionFault,
        floor: &Floor,
    ) -> Option<Result<String, ChangeError>> {
        // The order was checked before: required values are present, and the only optional value defaults to 1.
        let number = |key| fault.get(key).unwrap_or(1.0);
        let near = Vec2::new(number("x_m") as f32, number("y_m") as f32);
        let placed = match fault.name.as_str() {
            ADD_WASTE => {
                // Once one item has a place, the next has one too: at worst the items overlap.
                let added = (0..number("items") as u32).map(|_| {
                    let item = self.add_item(near, floor)?;
                    Ok(item_at(item, self.floor.items()[item.0 as usize].position))
                });
                added
                    .collect::<Result<Vec<_>, _>>()
                    .map(|items| items.join(", "))
            }
            MOVE_WASTE => {
                let item = ItemId(number("item") as u32);
                let at = self.move_item(item, near, floor);
                at.map(|at| item_at(item, at))
            }
            _ => return None,
        };
        Some(placed.map_err(PlaceError::into))
    }

    /// Puts a new item on the floor, at the nearest place to `near` at which a robot can grip it. Avoids other items if
    /// there is room. The mission is complete only after this item is delivered, too.
    pub(crate) fn add_item(&mut self, near: Vec2, floor: &Floor) -> Result<ItemId, PlaceError> {
        let place = self.place_for_item(near, None, floor)?;
        let item = self.floor.add(place);
        self.item_added(place, floor);
        Ok(item)
    }

    /// Moves an item that lies on the floor, under the rules for a new one. Returns its new place, m.
    pub(crate) fn move_item(
        &mut self,
        item: ItemId,
        near: Vec2,
        floor: &Floor,
    ) -> Result<Vec2, PlaceError> {
        let found = self.floor.items().get(item.0 as usize).copied();
        let found = found.ok_or(PlaceError::NoItem(item))?;
        if found.carrier.is_some() {
            return Err(PlaceError::Carried(item));
        }
        let from = found.position;
        if self.floor.is_deposit(from) {
            return Err(PlaceError::Delivered(item));
        }
        let place = self.place_for_item(near, Some(item), floor)?;
        self.item_removed(from, floor);
        self.floor.relocate(item, place);
        self.item_added(place, floor);
        Ok(place)
    }

    fn place_for_item(
        &self,
        near: Vec2,
        moved: Option<ItemId>,
        floor: &Floor,
    ) -> Result<Vec2, PlaceError> {
        let radius_m = self.floor.item_radius_m;
        let will_do = |place| floor.can_be_gripped(place, radius_m, |_| true);
        let least_m = 2.0 * radius_m - ROUNDING_M;
        let is_apart = |place: Vec2| {
            let items = self.floor.near(place, least_m);
            let mut others = items.filter(|(item, _)| Some(*item) != moved);
            others.all(|(_, at)| at.distance(place) >= least_m)
        };
        floor
            .nearest_place(near, |place| is_apart(place) && will_do(place))
            .or_else(|| floor.nearest_place(near, will_do))
            .ok_or(PlaceError::NoPlace)
    }
}

fn item_at(item: ItemId, at: Vec2) -> String {
    format!("{item} {} {}", at.x, at.y)
}
