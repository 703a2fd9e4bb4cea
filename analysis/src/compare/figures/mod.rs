//! SVG figures of a comparison.

mod curves;
mod distributions;
mod heat;
mod ranks;

use plotters::style::RGBColor;
use plotters::style::text_anchor::{HPos, VPos};

use super::analysis::Analysis;
use super::data::ComparisonData;
use crate::report::figures::canvas::{INK, TEXT_PX, TextLabel};

pub struct Figure {
    pub name: String,
    pub caption: String,
    pub svg: String,
}

/// Draws critical differences, heat maps, curves and distributions, in this order. The first figure shows the main result.
pub fn figures(data: &ComparisonData, analysis: &Analysis) -> anyhow::Result<Vec<Figure>> {
    let mut all = ranks::draw(data, analysis)?;
    all.extend(heat::draw(data)?);
    all.extend(curves::draw(data, analysis)?);
    all.extend(distributions::draw(data, analysis)?);
    Ok(all)
}

fn plain(name: &str) -> String {
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric());
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    words.join("-")
}

/// Returns `-name`, or an empty string.
fn ending(name: &str) -> String {
    match plain(name).as_str() {
        "" => String::new(),
        plain => format!("-{plain}"),
    }
}

const fn lettering(h: HPos, color: RGBColor) -> TextLabel {
    TextLabel {
        size_px: TEXT_PX,
        bold: false,
        color,
        anchor: (h, VPos::Center),
        upright: false,
    }
}

const AT_LEFT: TextLabel = lettering(HPos::Left, INK);
const AT_RIGHT: TextLabel = lettering(HPos::Right, INK);
const CENTERED: TextLabel = lettering(HPos::Center, INK);

/// Rounds up to 1, 2, 2.5 or 5 times a power of ten.
fn round_up(number: f64) -> f64 {
    if number <= 0.0 || !number.is_finite() {
        return 1.0;
    }
    let power = 10_f64.powf(number.log10().floor());
    let steps = [1.0, 2.0, 2.5, 5.0, 10.0];
    let step = steps.into_iter().find(|step| step * power >= number);
    step.unwrap_or(10.0) * power
}
