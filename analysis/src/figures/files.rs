//! The files of the figures of a study: SVG, PNG and PDF, and the numbers as CSV.

use std::path::Path;

use anyhow::Context;

use super::Figure;
use super::pdf;
use super::pixels::{PRINT_PIXELS, Pixels};
use crate::new_file::write_atomically;

/// The name of the script of [`write_script`].
pub const SCRIPT: &str = "plot.py";

/// Writes a figure into a folder in all formats, each as `name` with the ending of the format.
///
/// # Errors
/// Returns an error if the figure cannot be converted or a file cannot be written.
pub fn write(figure: &Figure, folder: &Path) -> anyhow::Result<()> {
    figure.write(folder)?;
    let path = |ending: &str| folder.join(format!("{}.{ending}", figure.name));
    let name = || figure.name.clone();
    let png = Pixels::draw(&figure.svg, PRINT_PIXELS).and_then(|pixels| pixels.png());
    write_atomically(&path("png"), &png.with_context(name)?)?;
    // The results of a study repeat byte for byte.
    let pdf = pdf::outlined(&figure.svg).with_context(name)?;
    write_atomically(&path("pdf"), &pdf)?;
    match &figure.numbers {
        Some(numbers) => numbers.write_csv(folder, &figure.name),
        None => Ok(()),
    }
}

/// Writes a script that draws the numbers of all figures in the folder with matplotlib.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn write_script(folder: &Path) -> anyhow::Result<()> {
    write_atomically(&folder.join(SCRIPT), include_bytes!("plot.py"))
}

/// Returns the names of the files that [`write`] creates, each with its format.
#[must_use]
pub fn names(figure: &Figure) -> Vec<(&'static str, String)> {
    let csv = figure.numbers.as_ref().map(|_| ("CSV", "csv"));
    let formats = [("SVG", "svg"), ("PNG", "png"), ("PDF", "pdf")].into_iter();
    formats
        .chain(csv)
        .map(|(format, ending)| (format, format!("{}.{ending}", figure.name)))
        .collect()
}
