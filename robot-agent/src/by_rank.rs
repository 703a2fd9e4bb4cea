//! What a robot keeps of each teammate: a list by rank, and apart from it the ranks themselves, so that a look for one of
//! them touches little memory.

use alliance_proto::ids::RobotId;

/// Values by rank, of those that there are.
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
    /// Where the value of a robot is, else where it would be.
    pub fn place(&self, robot: RobotId) -> Result<usize, usize> {
        // Where all teammates have a value, it is at the rank itself, or one before: the robot has none of its own.
        let rank = robot.index();
        let likely = [rank.wrapping_sub(1), rank].into_iter();
        let mut found = likely.filter(|&place| self.ranks.get(place) == Some(&robot));
        found
            .next()
            .map_or_else(|| self.ranks.binary_search(&robot), Ok)
    }

    /// The value at a [`ByRank::place`].
    pub fn at(&self, place: usize) -> &T {
        &self.values[place]
    }

    /// The same, to be changed.
    pub fn at_mut(&mut self, place: usize) -> &mut T {
        &mut self.values[place]
    }

    /// Puts in the first value of a robot, at its [`ByRank::place`].
    pub fn insert(&mut self, place: usize, robot: RobotId, value: T) {
        self.ranks.insert(place, robot);
        self.values.insert(place, value);
    }

    /// The value of a robot; `new` where there is none yet.
    pub fn get_or_insert_with(&mut self, robot: RobotId, new: impl FnOnce() -> T) -> &mut T {
        let place = match self.place(robot) {
            Ok(known) => known,
            Err(place) => {
                self.insert(place, robot, new());
                place
            }
        };
        &mut self.values[place]
    }

    /// All of them, by rank.
    pub fn iter(&self) -> impl Iterator<Item = (RobotId, &T)> {
        self.ranks.iter().copied().zip(&self.values)
    }

    /// The places of all.
    pub fn places(&self) -> std::ops::Range<usize> {
        0..self.ranks.len()
    }

    /// The robot whose value is at that place, and the value.
    pub fn entry_mut(&mut self, place: usize) -> (RobotId, &mut T) {
        (self.ranks[place], &mut self.values[place])
    }

    /// All values, by rank.
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
        /// Against a map.
        #[test]
        fn it_is_a_map_by_rank(
            many in any::<bool>(),
            entries in prop::collection::vec((0..20_u16, 0..100_u32), 0..60),
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
