//! Tables for terminals.

use std::ops::RangeBounds;

use comfy_table::{
    CellAlignment, ColumnConstraint, ContentArrangement, LineStyle, Row, Table, TableStyle,
};
use scenario::mission::FigureValue;

/// The table style: a line below the header and no other borders.
const STYLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─'));
/// The number of spaces between columns.
const GAP: u16 = 2;

/// Creates a table with `header`. In a terminal it is at most as wide as the terminal. In a file or pipe, each row is
/// one line.
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

/// Prevents line breaks in columns that contain names, so that other columns shrink instead.
pub fn no_wrap(table: &mut Table, columns: &[usize]) {
    for &column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_constraint(ColumnConstraint::ContentWidth);
        }
    }
}

/// Aligns columns of numbers to the right.
pub fn align_right(table: &mut Table, columns: impl RangeBounds<usize>) {
    for (place, column) in table.column_iter_mut().enumerate() {
        if columns.contains(&place) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

/// Formats a figure of a mission for a cell.
#[must_use]
pub fn figure(value: FigureValue) -> String {
    match value {
        FigureValue::Count(count) => count.to_string(),
        FigureValue::Real(number) => format!("{number:.2}"),
        FigureValue::None => "–".to_owned(),
    }
}

/// Prevents line breaks in all columns. In a narrow terminal, hides as many of the columns `spare`, in this order, as the
/// others need.
pub fn hide_instead_of_wrap(table: &mut Table, spare: &[usize]) {
    for column in table.column_iter_mut() {
        column.set_constraint(ColumnConstraint::ContentWidth);
    }
    let Some(available) = table.width() else {
        return;
    };
    let widths = table.column_max_content_widths();
    let mut needed: u16 = widths.iter().map(|width| width + GAP).sum();
    for &column in spare {
        if needed > available
            && let Some(hidden) = table.column_mut(column)
        {
            hidden.set_constraint(ColumnConstraint::Hidden);
            needed -= widths[column] + GAP;
        }
    }
}

/// Lists names with their meanings, one per line. In a narrow terminal, a meaning continues below its own start.
pub fn list(named: impl IntoIterator<Item = (impl ToString, impl ToString)>) -> String {
    let rows = named
        .into_iter()
        .map(|(name, meaning)| [name.to_string(), meaning.to_string()]);
    let mut table = without_header(rows, GAP);
    no_wrap(&mut table, &[0]);
    table.trim_fmt() + "\n"
}

/// Breaks a text for stderr between words if it is a terminal. In a file or pipe it stays one line.
#[must_use]
pub fn paragraph(text: &str) -> String {
    paragraph_table(text).trim_fmt()
}

fn paragraph_table(text: &str) -> Table {
    let mut table = without_header([[text]], 0);
    table.use_stderr();
    table
}

/// Lists sentences for stderr, each after a hyphen. Each sentence is broken as a [`paragraph`].
#[must_use]
pub fn bullets<'s>(sentences: impl IntoIterator<Item = &'s String>) -> String {
    bullet_table(sentences).trim_fmt()
}

fn bullet_table<'s>(sentences: impl IntoIterator<Item = &'s String>) -> Table {
    let rows = sentences.into_iter().map(|sentence| ["-", sentence]);
    let mut table = without_header(rows, 1);
    table.use_stderr();
    no_wrap(&mut table, &[0]);
    table
}

/// Creates a table without header and borders, with `gap` spaces between columns.
fn without_header<R: Into<Row>>(rows: impl IntoIterator<Item = R>, gap: u16) -> Table {
    let mut table = Table::new();
    table
        .load_style(TableStyle::new())
        .set_content_arrangement(ContentArrangement::Dynamic)
        .add_rows(rows);
    for column in table.column_iter_mut() {
        column.set_padding((0, gap));
    }
    table
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
    fn a_paragraph_breaks_between_words() {
        let text = "process ids: world 12345, blue 12346, gold 12347";
        assert_eq!(paragraph_table(text).trim_fmt(), text);
        let mut narrow = paragraph_table(text);
        narrow.set_width(28);
        assert_eq!(
            narrow.trim_fmt(),
            "process ids: world 12345,\nblue 12346, gold 12347"
        );
    }

    #[test]
    fn a_sentence_continues_below_its_start() {
        let sentences = ["alliance has the best mean rank", "no data in 1 cell"];
        let sentences = sentences.map(str::to_owned);
        let [first, second] = &sentences;
        assert_eq!(bullets(&sentences), format!("- {first}\n- {second}"));
        let mut narrow = bullet_table(&sentences);
        narrow.set_width(24);
        assert_eq!(
            narrow.trim_fmt(),
            "- alliance has the best\n  mean rank\n- no data in 1 cell"
        );
    }

    #[test]
    fn a_narrow_terminal_hides_the_columns_that_can_be_spared() {
        let header_in = |width| {
            let mut table = new(["run", "scenario", "hash"]);
            table.add_row(["waste-cleanup-1", "waste-cleanup", "cf2fc051d99e95cf"]);
            table.set_width(width);
            hide_instead_of_wrap(&mut table, &[1, 2]);
            let header = table.lines().next().unwrap();
            header
                .split_whitespace()
                .map(str::to_owned)
                .collect::<Vec<_>>()
        };
        assert_eq!(header_in(50), ["run", "scenario", "hash"]);
        assert_eq!(header_in(49), ["run", "hash"]);
        assert_eq!(header_in(34), ["run"]);
    }

    #[test]
    fn a_table_fits_the_terminal() {
        let mut table = new(["id", "fault", "phase"]);
        let fault = "obstacle 0.62 6.55 0.2 1 --when \"gold picks from top\" --penetrability 0.3";
        table.add_row(["f1", fault, "in force"]);
        let width = |table: &Table| table.lines().map(|line| line.chars().count()).max();
        // Without a terminal, the table is as wide as its content.
        assert!(width(&table) > Some(80));
        assert!(width(table.set_width(80)) <= Some(80), "{table}");
    }
}
