//! The transmissions between robots: lines for a few of them, rings around the senders for many.

use std::collections::BTreeSet;

use maud::{Markup, html};
use plotters::style::RGBColor;
use scenario::ids::RobotId;

use super::geometry::{Point, n};
use super::scene::Transmission;
use crate::figures::palette::{TROUBLE, css};

/// The largest number of transmissions that are drawn as lines.
const LINES_MAX: usize = 40;

/// The distance of a line from the middle of both robots, px, so that both directions are visible.
const BESIDE_PX: f64 = 3.0;

/// Draws the transmissions between robots at these places, by rank, with their colors and the radius of a robot, px.
/// The ring of a sender is dashed if a robot did not receive its message.
pub fn transmissions(
    all: &[Transmission],
    places: &[Point],
    colors: &[RGBColor],
    radius: f64,
) -> Markup {
    let color = |each: &Transmission| match each.is_lost {
        true => css(TROUBLE),
        false => css(colors[each.sender.index()]),
    };
    if all.len() <= LINES_MAX {
        return html! { @for each in all { (arrow(each, places, &color(each))) } };
    }
    let senders = |all: &mut dyn Iterator<Item = &Transmission>| -> BTreeSet<RobotId> {
        all.map(|each| each.sender).collect()
    };
    let with_losses = senders(&mut all.iter().filter(|each| each.is_lost));
    html! {
        @for sender in senders(&mut all.iter()) {
            @let (x, y) = places[sender.index()];
            @let has_losses = with_losses.contains(&sender);
            @let color = if has_losses { TROUBLE } else { colors[sender.index()] };
            circle cx=(n(x)) cy=(n(y)) r=(n(radius + 4.0)) fill="none" stroke=(css(color)) stroke-width="1.2"
                stroke-dasharray=[has_losses.then_some("3 2.5")] stroke-opacity="0.6" {}
        }
    }
}

/// Draws a line from the sender to the receiver with an arrow head. A lost message is a dashed line with a cross.
fn arrow(each: &Transmission, places: &[Point], color: &str) -> Markup {
    let (from, to) = (places[each.sender.index()], places[each.receiver.index()]);
    let way = (to.0 - from.0, to.1 - from.1);
    let length = (way.0 * way.0 + way.1 * way.1).sqrt();
    if length < 1.0 {
        return html! {};
    }
    let ahead = (way.0 / length, way.1 / length);
    let left = (-ahead.1, ahead.0);
    // A point of the line by the share of its length, and its distances along and beside the line, px.
    let at = |share: f64, along: f64, beside: f64| {
        let beside = beside + BESIDE_PX;
        let x = from.0 + share * way.0 + along * ahead.0 + beside * left.0;
        let y = from.1 + share * way.1 + along * ahead.1 + beside * left.1;
        format!("{} {}", n(x), n(y))
    };
    let line = format!("M{}L{}", at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0));
    if each.is_lost {
        let [a, b] = [(-4.0, -4.0), (4.0, 4.0)].map(|(along, beside)| at(0.5, along, beside));
        let [c, d] = [(-4.0, 4.0), (4.0, -4.0)].map(|(along, beside)| at(0.5, along, beside));
        return html! {
            g fill="none" stroke=(color) stroke-opacity="0.8" {
                path d=(line) stroke-dasharray="6 4" stroke-width="1.2" {}
                path d=(format!("M{a}L{b}M{c}L{d}")) stroke-width="2" {}
            }
        };
    }
    let head = [(5.0, 0.0), (-4.0, 3.5), (-4.0, -3.5)];
    let [tip, one, other] = head.map(|(along, beside)| at(0.66, along, beside));
    html! {
        path d=(line) fill="none" stroke=(color) stroke-opacity="0.45" {}
        path d=(format!("M{tip}L{one}L{other}Z")) fill=(color) fill-opacity="0.7" {}
    }
}
