//! A grid of cells as few disjoint rectangles.

use std::collections::BTreeMap;

/// A grid of cells, each set or not. Row 0 is the bottom.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cells {
    width: usize,
    set: Vec<bool>,
}

/// A rectangle of cells, from its lower left cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellRectangle {
    pub column: usize,
    pub row: usize,
    pub columns: usize,
    pub rows: usize,
}

impl Cells {
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            set: vec![false; width * height],
        }
    }

    pub fn set(&mut self, column: usize, row: usize, is_set: bool) {
        self.set[row * self.width + column] = is_set;
    }

    #[must_use]
    pub fn is_set(&self, column: usize, row: usize) -> bool {
        self.set[row * self.width + column]
    }

    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    #[must_use]
    pub fn height(&self) -> usize {
        self.set.len() / self.width.max(1)
    }

    /// Returns the number of set cells.
    #[must_use]
    pub fn count(&self) -> usize {
        self.set.iter().filter(|is_set| **is_set).count()
    }

    fn transposed(&self) -> Self {
        let mut transposed = Self::new(self.height(), self.width());
        for row in 0..self.height() {
            for column in 0..self.width {
                transposed.set(row, column, self.is_set(column, row));
            }
        }
        transposed
    }
}

/// Covers the set cells with disjoint rectangles. The runs of rows, or of columns, are joined while they have the same
/// ends; the direction with fewer rectangles counts.
#[must_use]
pub fn rectangles(cells: &Cells) -> Vec<CellRectangle> {
    let by_rows = joined_rows(cells);
    let by_columns = joined_rows(&cells.transposed());
    if by_rows.len() <= by_columns.len() {
        return by_rows;
    }
    let back = by_columns.into_iter().map(|each| CellRectangle {
        column: each.row,
        row: each.column,
        columns: each.rows,
        rows: each.columns,
    });
    back.collect()
}

fn joined_rows(cells: &Cells) -> Vec<CellRectangle> {
    let mut found = Vec::new();
    // The rectangles that reach up to the previous row, by their first column and their width.
    let mut open: BTreeMap<(usize, usize), CellRectangle> = BTreeMap::new();
    for row in 0..cells.height() {
        let mut next = BTreeMap::new();
        for run in runs(cells, row) {
            let (column, columns) = run;
            let rectangle = open.remove(&run).unwrap_or(CellRectangle {
                column,
                row,
                columns,
                rows: 0,
            });
            let rows = rectangle.rows + 1;
            next.insert(run, CellRectangle { rows, ..rectangle });
        }
        found.extend(std::mem::replace(&mut open, next).into_values());
    }
    found.extend(open.into_values());
    found
}

/// Returns the runs of set cells in a row: first column and width.
fn runs(cells: &Cells, row: usize) -> Vec<(usize, usize)> {
    let mut runs = Vec::new();
    let mut column = 0;
    while column < cells.width {
        let is_set = |column: &usize| cells.is_set(*column, row);
        let width = (column..cells.width).take_while(is_set).count();
        if width > 0 {
            runs.push((column, width));
        }
        column += width + 1;
    }
    runs
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    fn picture(rows: &[&str]) -> Cells {
        let mut cells = Cells::new(rows[0].len(), rows.len());
        for (from_top, row) in rows.iter().enumerate() {
            for (column, letter) in row.bytes().enumerate() {
                cells.set(column, rows.len() - 1 - from_top, letter == b'#');
            }
        }
        cells
    }

    #[test]
    fn the_walls_of_a_room_are_four_rectangles() {
        let cells = picture(&["######", "#    #", "#    #", "######"]);
        assert_eq!(rectangles(&cells).len(), 4);
        assert_eq!(rectangles(&picture(&["####"])).len(), 1);
        assert_eq!(rectangles(&picture(&["    "])), []);
        // Columns of unequal height, which rows would cut.
        let comb = picture(&["# #  ", "# # #", "# # #"]);
        assert_eq!(rectangles(&comb).len(), 3);
    }

    proptest! {
        #[test]
        fn each_set_cell_is_in_exactly_one_rectangle(
            (width, set) in (1_usize..12).prop_flat_map(|width| {
                (Just(width), (0_usize..12).prop_flat_map(move |rows| vec(any::<bool>(), width * rows)))
            }),
        ) {
            let cells = Cells { width, set };
            let mut covered = vec![0; cells.set.len()];
            for each in rectangles(&cells) {
                for row in each.row..each.row + each.rows {
                    for column in each.column..each.column + each.columns {
                        covered[row * width + column] += 1;
                    }
                }
            }
            let expected: Vec<u8> = cells.set.iter().map(|is_set| u8::from(*is_set)).collect();
            prop_assert_eq!(covered, expected);
        }
    }
}
