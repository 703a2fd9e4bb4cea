//! How tables look in a terminal.

use comfy_table::{ColumnConstraint, ContentArrangement, LineStyle, Row, Table, TableStyle};

/// A line below the header, and nothing else that would take room.
const STYLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─'));
/// Spaces between columns.
const GAP: u16 = 2;

/// A table with that header. In a terminal it is no wider than that, and no wider than it needs to be; what goes into a file
/// or a pipe has each row in one line.
pub fn new(header: impl Into<Row>) -> Table {
    let mut table = Table::new();
    table
        .load_style(STYLE)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .use_stderr()
        .set_header(header);
    for column in table.column_iter_mut() {
        column.set_padding((0, GAP));
    }
    table
}

/// Columns whose words are names: they are not broken, so that other columns give way.
pub fn keep_whole(table: &mut Table, columns: &[usize]) {
    for &column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_constraint(ColumnConstraint::ContentWidth);
        }
    }
}

/// Leaves out a column where a terminal has no room for all of them.
pub fn spare(table: &mut Table, column: usize) {
    let widths = table.column_max_content_widths();
    let needed: u16 = widths.iter().map(|width| width + GAP).sum();
    if table.width().is_some_and(|there_is| there_is < needed)
        && let Some(column) = table.column_mut(column)
    {
        column.set_constraint(ColumnConstraint::Hidden);
    }
}

/// Names with what each means, a line each; in a terminal that is too narrow the meaning goes on below itself.
pub fn list(named: impl IntoIterator<Item = (impl ToString, impl ToString)>) -> String {
    let mut table = Table::new();
    table
        .load_style(TableStyle::new())
        .set_content_arrangement(ContentArrangement::Dynamic);
    for (name, meaning) in named {
        table.add_row([name.to_string(), meaning.to_string()]);
    }
    for column in table.column_iter_mut() {
        column.set_padding((0, GAP));
    }
    if let Some(names) = table.column_mut(0) {
        names.set_constraint(ColumnConstraint::ContentWidth);
    }
    table.trim_fmt() + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_has_a_line_for_each_name() {
        let listed = list([
            ("cbba", "bids for a bundle"),
            ("nearest-silent", "the radio is off"),
        ]);
        assert_eq!(
            listed,
            "cbba            bids for a bundle\nnearest-silent  the radio is off\n"
        );
    }

    #[test]
    fn a_narrow_terminal_goes_without_what_can_be_spared() {
        let table_in = |width| {
            let mut table = new(["run", "scenario", "hash"]);
            table.add_row(["waste-cleanup-1", "waste-cleanup", "cf2fc051d99e95cf"]);
            table.set_width(width);
            keep_whole(&mut table, &[0]);
            spare(&mut table, 1);
            table.to_string()
        };
        assert!(table_in(50).contains(" waste-cleanup "), "{}", table_in(50));
        let narrow = table_in(49);
        assert!(!narrow.contains("scenario"), "{narrow}");
        assert!(
            narrow.contains("waste-cleanup-1  cf2fc051d99e95cf"),
            "{narrow}"
        );
    }

    #[test]
    fn a_table_fits_the_terminal() {
        let mut table = new(["id", "fault", "phase"]);
        let fault = "obstacle 0.62 6.55 0.2 1 --when \"gold picks from top\" --penetrability 0.3";
        table.add_row(["f1", fault, "in force"]);
        let width = |table: &Table| table.lines().map(|line| line.chars().count()).max();
        // No terminal: as wide as it needs to be.
        assert!(width(&table) > Some(80));
        assert!(width(table.set_width(80)) <= Some(80), "{table}");
    }
}
