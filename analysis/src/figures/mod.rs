//! Tools for the figures of all commands: canvas, axes, marks, legends and colors.

pub mod canvas;
pub mod files;
mod hatching;
pub mod hints;
pub mod legend;
pub mod palette;
pub mod pdf;
pub mod pixels;
pub mod simplify;
pub mod size;

use std::path::Path;

use crate::columns::Table;
use crate::new_file::write_atomically;

pub struct Figure {
    /// The file name without extension, also used as anchor.
    pub name: String,
    /// The content and how to read it.
    pub caption: String,
    pub svg: String,
    /// The mission, the measure and so on that the figure shows, for the choice of a page's parts.
    pub about: Vec<(&'static str, String)>,
    /// The numbers that the figure shows, if it is not a drawing of a log.
    pub numbers: Option<Table>,
}

impl Figure {
    /// Writes the figure into a folder as `name.svg`.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        write_atomically(
            &folder.join(format!("{}.svg", self.name)),
            self.svg.as_bytes(),
        )
    }
}

/// Returns a name in a form for file names.
#[must_use]
pub fn plain(name: &str) -> String {
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric());
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    words.join("-")
}
