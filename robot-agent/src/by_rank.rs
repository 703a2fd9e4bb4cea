//! Lists of values per teammate, sorted by rank. The ranks are stored apart from the values, so that a search touches
//! little memory.

use scenario::ids::RobotId;

/// The number of entries that a search reads before it searches the whole list.
const NEAR: usize = 4;

/// Returns the first place in a list sorted by rank whose rank is at least that of `robot`. The messages of a step are
/// sorted by sender, so a search from the place of the previous sender ends at once in most cases.
pub fn place_from<T>(
    list: &[T],
    near: usize,
    robot: RobotId,
    rank: impl Fn(&T) -> RobotId,
) -> usize {
    let is_before = |entry: &T| rank(entry) < robot;
    let previous = near.checked_sub(1);
    if previous.is_none_or(|previous| list.get(previous).is_some_and(is_before)) {
        let ahead = &list[near..];
        let found = ahead.iter().take(NEAR).position(|entry| !is_before(entry));
        if let Some(steps) = found {
            return near + steps;
        }
        if ahead.len() <= NEAR {
            return list.len();
        }
    }
    list.partition_point(is_before)
}

/// A sparse list of values, sorted by the rank of their robot.
#[derive(Clone, Debug, PartialEq)]
pub struct ByRank<T> {
    ranks: Vec<RobotId>,
    values: Vec<T>,
}

impl<T> Default for ByRank<T> {
    fn default() -> Self {
        Self {
            ranks: Vec::new(),
            values: Vec::new(),
        }
    }
}

impl<T> ByRank<T> {
    /// Returns the index of the robot's value, else the index at which to insert it.
    pub fn place(&self, robot: RobotId) -> Result<usize, usize> {
        // If all teammates have a value, it is at the rank or one before it, because the robot itself may have none.
        let rank = robot.index();
        let is_at = |place: usize| self.ranks.get(place) == Some(&robot);
        if is_at(rank) {
            Ok(rank)
        } else if is_at(rank.wrapping_sub(1)) {
            Ok(rank - 1)
        } else {
            self.ranks.binary_search(&robot)
        }
    }

    /// Returns the robot at an index from [`ByRank::place`].
    pub fn rank_at(&self, place: usize) -> RobotId {
        self.ranks[place]
    }

    /// Returns the value at an index from [`ByRank::place`].
    pub fn at(&self, place: usize) -> &T {
        &self.values[place]
    }

    /// Returns the value at an index from [`ByRank::place`], mutably.
    pub fn at_mut(&mut self, place: usize) -> &mut T {
        &mut self.values[place]
    }

    /// Inserts the first value of a robot at the index from [`ByRank::place`].
    pub fn insert(&mut self, place: usize, robot: RobotId, value: T) {
        self.ranks.insert(place, robot);
        self.values.insert(place, value);
    }

    pub fn remove(&mut self, place: usize) -> RobotId {
        self.values.remove(place);
        self.ranks.remove(place)
    }

    /// Returns the value of a robot. Inserts `new()` if it has none.
    pub fn get_or_insert_with(&mut self, robot: RobotId, new: impl FnOnce() -> T) -> &mut T {
        let place = match self.place(robot) {
            Ok(found) => found,
            Err(place) => {
                self.insert(place, robot, new());
                place
            }
        };
        &mut self.values[place]
    }

    pub fn iter(&self) -> impl Iterator<Item = (RobotId, &T)> {
        self.ranks.iter().copied().zip(&self.values)
    }

    pub fn places(&self) -> std::ops::Range<usize> {
        0..self.ranks.len()
    }

    pub fn entry_mut(&mut self, place: usize) -> (RobotId, &mut T) {
        (self.ranks[place], &mut self.values[place])
    }

    pub fn values_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.values.iter_mut()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_place_does_not_depend_on_the_start_of_its_search(
            ranks in prop::collection::vec(0..30_u32, 0..40),
            robot in 0..32_u32,
            near in 0..42_usize,
        ) {
            let mut ranks: Vec<RobotId> = ranks.into_iter().map(RobotId).collect();
            ranks.sort_unstable();
            let robot = RobotId(robot);
            let place = place_from(&ranks, near, robot, |&rank| rank);
            prop_assert_eq!(place, ranks.partition_point(|&rank| rank < robot));
        }

        #[test]
        fn list_behaves_like_a_map_by_rank(
            many in any::<bool>(),
            entries in prop::collection::vec((0..20_u32, 0..100_u32), 0..60),
        ) {
            let (mut list, mut map) = (ByRank::default(), BTreeMap::new());
            let others = (0..if many { 300 } else { 0 }).map(|rank| (3 * rank, 1));
            let entries = others.chain(entries);
            for (rank, value) in entries {
                *list.get_or_insert_with(RobotId(rank), || 0) += value;
                *map.entry(RobotId(rank)).or_insert(0) += value;
                let place = list.place(RobotId(rank));
                prop_assert_eq!(place.ok().map(|place| list.at(place)), map.get(&RobotId(rank)));
            }
            prop_assert!(list.iter().eq(map.iter().map(|(&rank, value)| (rank, value))));
            for value in list.values_mut() {
                *value += 1;
            }
            prop_assert!(list.iter().zip(map.values()).all(|((_, one), other)| *one == other + 1));
            prop_assert_eq!(list.place(RobotId(1000)), Err(map.len()));
        }
    }
}
