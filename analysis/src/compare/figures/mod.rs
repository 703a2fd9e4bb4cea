//! SVG figures of a comparison.

mod curves;
mod distributions;
mod heat;
mod ranks;

use super::analysis::Analysis;
use super::data::ComparisonData;
use crate::figures::{Figure, plain};

/// Draws critical differences, heat maps, curves and distributions, in this order. The first figure shows the main result.
pub fn figures(data: &ComparisonData, analysis: &Analysis) -> anyhow::Result<Vec<Figure>> {
    let mut all = ranks::draw(data, analysis)?;
    all.extend(heat::draw(data)?);
    all.extend(curves::draw(data, analysis)?);
    all.extend(distributions::draw(data, analysis)?);
    Ok(all)
}

/// Returns the missions with the indices of their blocks.
fn by_mission(data: &ComparisonData) -> Vec<(&str, Vec<usize>)> {
    let missions = data.missions().into_iter();
    let with_blocks = missions.map(|mission| {
        let all = 0..data.blocks.len();
        let blocks = all.filter(|block| data.blocks[*block].mission == mission);
        (mission, blocks.collect())
    });
    with_blocks.collect()
}

/// Returns a title followed by a name, which may be empty.
fn titled(title: &str, name: &str) -> String {
    match name {
        "" => title.to_owned(),
        _ => format!("{title}: {name}"),
    }
}

/// Returns `-name`, or an empty string.
fn ending(name: &str) -> String {
    match plain(name).as_str() {
        "" => String::new(),
        plain => format!("-{plain}"),
    }
}

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
