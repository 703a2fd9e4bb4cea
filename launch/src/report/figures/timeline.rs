//! What figures over time have in common: the strip of faults above, the lines that go down from it, and the legend.

use std::ops::Range;

use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor};

use super::canvas::{
    Area, Drawn, FAINT, INK, Lettering, Mark, Panel, fill, hatch, line, part, px, rows_for,
    upright,
};
use crate::report::faults::{Fault, Phase};

/// Height of a row of the legend or of a fault's label, px.
const ROW_PX: f64 = 16.0;

/// Rows for labels of faults.
const LABEL_ROWS: usize = 3;
