//! How tables look in a terminal.

use comfy_table::presets::UTF8_FULL_CONDENSED;
use comfy_table::{ContentArrangement, Row, Table};

/// A table with that header. In a terminal it is no wider than that, and no wider than it needs to be; what goes into a file
/// or a pipe has each row in one line.
pub fn new(header: impl Into<Row>) -> Table {
    let mut table = Table::new();
    table
        .load_style(UTF8_FULL_CONDENSED)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .use_stderr()
        .set_header(header);
    table
}

#[cfg(test)]
mod tests {
    use super::*;

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
