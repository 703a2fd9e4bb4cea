//! The options for the size of figures, the same in all commands.

use anyhow::bail;
use clap::Args;

use super::canvas::{Sheet, TEXT_PX, WIDTH_PX};

/// The minimum ratio of figure width to font size. A narrower figure has no room beside names and axes.
const LEAST_LETTERS: f64 = 33.0;

/// Options for the size of figures and of their letters.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct SizeOptions {
    /// Width of the figures, px [default: 960]
    #[arg(long, value_name = "PX")]
    pub width: Option<f64>,
    /// Font size, px; lines and marks scale with it [default: 12]
    #[arg(long, value_name = "PX")]
    pub font_size: Option<f64>,
}

impl SizeOptions {
    /// Returns the sheet for the chosen width and font size.
    ///
    /// # Errors
    /// Returns an error for a size that leaves no room for text.
    pub fn sheet(self) -> anyhow::Result<Sheet> {
        let width = self.width.unwrap_or(WIDTH_PX);
        let font = self.font_size.unwrap_or(TEXT_PX);
        if !(4.0..=72.0).contains(&font) {
            bail!("--font-size {font}: must be from 4 to 72");
        }
        let least = (font * LEAST_LETTERS).ceil();
        if !(least..=10_000.0).contains(&width) {
            bail!("--width {width}: must be from {least} (at font size {font} px) to 10000");
        }
        Ok(Sheet::new(width, font))
    }
}
