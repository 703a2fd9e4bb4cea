//! The blocks of a design: combinations of all factors except allocator and seed.

use crate::sweep::design::{Design, Factor};

/// The column of the compared allocator.
pub const ALLOCATOR: &str = "allocator";

/// Returns the index of the factor that varies the allocator.
#[must_use]
pub fn allocators(design: &Design) -> Option<usize> {
    let mut factors = design.factors.iter();
    factors.position(|factor| factor.columns.iter().any(|column| column == ALLOCATOR))
}

#[must_use]
pub fn names(factor: &Factor) -> Vec<String> {
    let names = factor.levels.iter().map(|level| {
        let cells: Vec<String> = level.cells.iter().map(ToString::to_string).collect();
        cells.join(" ")
    });
    names.collect()
}

/// Returns the factors of blocks, which are all except allocator and seed, with their indices.
pub fn settings(design: &Design) -> impl Iterator<Item = (usize, &Factor)> {
    let rivals = allocators(design);
    let seeds = design.factors.len().saturating_sub(1);
    let factors = design.factors.iter().enumerate();
    factors.filter(move |(place, _)| Some(*place) != rivals && *place != seeds)
}

#[must_use]
pub fn blocks(design: &Design) -> usize {
    settings(design)
        .map(|(_, factor)| factor.levels.len())
        .product()
}

/// Returns the index of the block that contains a run.
#[must_use]
pub fn block_of(design: &Design, places: &[usize]) -> usize {
    settings(design).fold(0, |number, (place, factor)| {
        number * factor.levels.len() + places[place]
    })
}

#[must_use]
pub fn first_run(design: &Design, block: usize) -> usize {
    let mut rest = block;
    let mut places = vec![0; design.factors.len()];
    let factors: Vec<(usize, &Factor)> = settings(design).collect();
    for (place, factor) in factors.into_iter().rev() {
        places[place] = rest % factor.levels.len();
        rest /= factor.levels.len();
    }
    let factors = design.factors.iter().zip(places);
    factors.fold(0, |run, (factor, place)| run * factor.levels.len() + place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::results::tests::design;

    #[test]
    fn the_first_run_of_each_block_does_not_depend_on_the_column_order() {
        let design = design(
            "seeds = 2\n[grid]\nroom.width_m = [12.0, 14.0]\nallocator = ['alliance', 'nearest']\nbody.speed_m_s = [0.4, 0.5]\n",
        );
        let found = [0, 1, 2, 3].map(|block| first_run(&design, block));
        assert_eq!((blocks(&design), found), (4, [0, 2, 8, 10]));
        let blocks = found.map(|run| block_of(&design, &design.level_indices(run)));
        assert_eq!(blocks, [0, 1, 2, 3]);
    }
}
