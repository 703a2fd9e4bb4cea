//! The figure of the study: time and energy of each rule relative to the optimum.

use plotters::style::RGBColor;

use super::results::{Measure, Study};
use crate::figures::canvas::{
    Area, Axes, DrawResult, FAINT, Frame, INK, Mark, TextLabel, WIDTH_PX, chart, curve,
    horizontal_line, line, part, svg,
};
use crate::figures::legend::{Legend, ROW_PX, Sample};
use crate::figures::palette::colors;

const LEFT_PX: f64 = 62.0;
const RIGHT_PX: f64 = 16.0;
const PLOT_PX: f64 = 230.0;
const GAP_PX: f64 = 14.0;
const LABELS_PX: f64 = 24.0;

/// The upper end of the y axis; larger values are drawn at the edge.
const HIGHEST: f64 = 2.5;
/// The lower end of the y axis, which keeps marks at 1 visible.
const LOWEST: f64 = 0.92;

/// The published upper bound of strategy IV's average.
const PUBLISHED: f64 = 1.2;

/// Half the width that the marks of a rule occupy, relative to the distance of two rules.
const HALF: f64 = 0.3;

/// Draws one mark per condition without faults and a bar at their mean, by rule: time above, energy below.
pub fn draw(study: &Study) -> anyhow::Result<String> {
    let panels: [(&str, Measure); 2] = [
        ("time / least time", |cell| cell.time),
        ("energy / least energy", |cell| cell.energy),
    ];
    let spreads = study.design.spreads.iter();
    let names: Vec<String> = spreads.map(|spread| format!("h = {spread}")).collect();
    let samples = spread_colors(study).into_iter().enumerate();
    let samples = samples.map(|(number, color)| Sample::Mark(Mark::of_series(number), color));
    let entries = samples.zip(names.iter().map(String::as_str));
    let legend = Legend::new(entries.collect(), LEFT_PX..WIDTH_PX);
    let note = format!(
        "one mark per size, at the edge if above {HIGHEST}; bar: mean; broken line: {PUBLISHED}, published for IV"
    );
    let note_px = legend.height_px() + ROW_PX / 2.0;
    let head_px = note_px + ROW_PX;
    let height_px = head_px + 2.0 * PLOT_PX + GAP_PX + LABELS_PX;
    let title = "Strategies of L-ALLIANCE relative to the optimum";
    svg(title, height_px, |area| {
        legend.draw(area, 0.0)?;
        TextLabel::LEFT.write(area, &note, (LEFT_PX, note_px))?;
        for (place, (what, value)) in panels.into_iter().enumerate() {
            let top_px = head_px + place as f64 * (PLOT_PX + GAP_PX);
            panel(area, study, top_px, what, value)?;
        }
        let width_px = (WIDTH_PX - LEFT_PX - RIGHT_PX) / study.design.rules.len() as f64;
        for (place, rule) in study.design.rules.iter().enumerate() {
            let x_px = LEFT_PX + width_px * (place as f64 + 0.5);
            let at = (x_px, height_px - LABELS_PX / 2.0);
            TextLabel::CENTERED.write(area, &rule.name, at)?;
        }
        Ok(())
    })
}

fn spread_colors(study: &Study) -> Vec<RGBColor> {
    colors(study.design.spreads.iter().map(|_| ""))
}

fn panel(area: &Area<'_>, study: &Study, top_px: f64, what: &str, value: Measure) -> DrawResult {
    let within = part(area, (0.0, top_px), (WIDTH_PX, PLOT_PX));
    let frame = Frame {
        left: LEFT_PX,
        right: RIGHT_PX,
        bottom: 0.0,
    };
    let x = -0.5..study.design.rules.len() as f64 - 0.5;
    let axes = Axes {
        x: (x.clone(), ""),
        y: (LOWEST..HIGHEST, what),
        y_labels: 8,
    };
    let chart = chart(&within, frame, &axes)?;
    curve(&chart, vec![(x.start, 1.0), (x.end, 1.0)], line(FAINT, 1.0))?;
    horizontal_line(&chart, x, PUBLISHED, line(FAINT, 1.0))?;
    let colors = spread_colors(study);
    for rule in 0..study.design.rules.len() {
        let cells: Vec<_> = study
            .without_faults(rule)
            .filter_map(|(condition, cell)| Some((condition.spread, value(&cell)?)))
            .collect();
        let count = cells.len() as f64;
        for (place, (spread, value)) in cells.iter().enumerate() {
            let x = rule as f64 + HALF * (2.0 * (place as f64 + 0.5) / count - 1.0);
            let mut spreads = study.design.spreads.iter();
            let of = spreads.position(|known| known == spread).unwrap_or(0);
            let at = (x, value.min(HIGHEST));
            Mark::of_series(of).draw_at(area, &chart, at, colors[of])?;
        }
        let mean = cells.iter().map(|(_, value)| value).sum::<f64>() / count;
        let at = rule as f64;
        if mean <= HIGHEST {
            let ends = vec![(at - HALF, mean), (at + HALF, mean)];
            curve(&chart, ends, line(INK, 2.0))?;
        }
    }
    Ok(())
}
