//! Geometry that several missions use.

use arrayvec::ArrayVec;
use glam::Vec2;
use scenario::limits::LONGEST_M;

/// The largest coordinate of a received place, m. Faulty sensors report places outside the room, but not so far away.
const FARTHEST_M: f32 = 10.0 * LONGEST_M as f32;

/// Checks whether a received place can exist. A damaged or forged message may contain any numbers.
pub(crate) fn is_possible_place(at: Vec2) -> bool {
    at.abs().cmple(Vec2::splat(FARTHEST_M)).all()
}

/// Returns the first `N` of all found numbers with their squared distances, sorted by distance and then by number.
pub(crate) fn nearest<T: Copy + PartialOrd, const N: usize>(
    all: impl Iterator<Item = (f32, T)>,
) -> ArrayVec<(f32, T), N> {
    let mut nearest: ArrayVec<(f32, T), N> = ArrayVec::new();
    for found in all {
        let before = nearest.partition_point(|known| *known < found);
        if before == N {
            continue;
        }
        if nearest.is_full() {
            nearest.pop();
        }
        nearest.insert(before, found);
    }
    nearest
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn places_far_away_are_impossible() {
        for coordinate in [f32::NAN, f32::INFINITY, f32::MAX, -1e5] {
            let place = Vec2::new(1.0, coordinate);
            assert!(!is_possible_place(place), "{place}");
        }
        assert!(is_possible_place(Vec2::new(-3.0, 900.0)));
    }

    proptest! {
        #[test]
        fn the_nearest_come_first(places in prop::collection::vec((-3..4_i8, -3..4_i8), 0..40)) {
            let squared = |(x, y): &(i8, i8)| f32::from(x * x + y * y) / 9.0;
            let mut all: Vec<(f32, u32)> = places.iter().map(squared).zip(0..).collect();
            let nearest: ArrayVec<(f32, u32), 8> = nearest(all.iter().copied());
            all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            prop_assert_eq!(&nearest[..], &all[..all.len().min(8)]);
        }
    }
}
