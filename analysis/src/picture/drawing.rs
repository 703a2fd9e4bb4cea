//! A picture as SVG: a pure function of a scene.

use maud::{Markup, html};
use plotters::style::RGBColor;
use proto::control::AgentState;
use scenario::Setup;
use scenario::time::SimTime;

use super::bodies::{Named, body, names, trail};
use super::frame::{FOOT_PX, HEAD_PX, MARGIN_PX, foot, head};
use super::geometry::{Point, Projection, Taken, n};
use super::scene::Scene;
use super::{floor, radio};
use crate::figures::canvas::{Sheet, WHITE};
use crate::figures::palette::{colors, css};

/// The largest ratio of the height of the room to its width.
const HIGHEST: f64 = 1.2;

/// The least radius of a robot, px. A smaller one would hide its color.
const LEAST_RADIUS_PX: f64 = 4.0;

/// The pictures of one run: all have the same size and colors.
pub struct Drawing<'r> {
    setup: &'r Setup,
    /// The end of the run.
    end: SimTime,
    sheet: Sheet,
    colors: Vec<RGBColor>,
    projection: Projection,
}

impl<'r> Drawing<'r> {
    #[must_use]
    pub fn new(setup: &'r Setup, end: SimTime, sheet: Sheet) -> Self {
        let room = setup.scenario.room;
        let [room_width, room_height] = room.size().to_array().map(f64::from);
        let width = sheet.width_px - 2.0 * MARGIN_PX;
        let scale = (width / room_width).min(HIGHEST * width / room_height);
        let left = (sheet.width_px - scale * room_width) / 2.0;
        let robots = setup.scenario.robots.iter();
        Self {
            setup,
            end,
            sheet,
            colors: colors(robots.map(|robot| robot.name.as_str())),
            projection: Projection {
                scale,
                room,
                corner: (left, HEAD_PX),
            },
        }
    }

    /// Returns the height of the layout, px.
    fn height_px(&self) -> f64 {
        (self.projection.extent().bottom + FOOT_PX).round()
    }

    /// Returns the position of a point of the room, m, in the picture, px.
    #[cfg(test)]
    pub fn place(&self, at: glam::Vec2) -> Point {
        self.projection.point(at)
    }

    /// Returns the colors of the robots, by rank.
    #[must_use]
    pub fn colors(&self) -> &[RGBColor] {
        &self.colors
    }

    /// Returns the drawing of a scene.
    #[must_use]
    pub fn svg(&self, scene: &Scene) -> String {
        let (width, height) = (self.sheet.width_px, self.height_px());
        let [shown_width, shown_height] = self.sheet.shown_px(height).map(n);
        let title = format!("{} at {}", self.setup.scenario.name, scene.view.now);
        let view_box = format!("0 0 {} {}", n(width), n(height));
        let head = head(self.setup, &scene.view, self.end, width);
        let foot = foot(&scene.view, (self.projection.extent().bottom, width));
        let svg = html! {
            svg xmlns="http://www.w3.org/2000/svg" width=(shown_width) height=(shown_height) viewBox=(view_box)
                role="img" font-family="sans-serif" {
                title { (title) }
                rect width=(n(width)) height=(n(height)) fill=(css(WHITE)) {}
                (head)
                (self.room(scene))
                (foot)
            }
        };
        svg.into_string() + "\n"
    }

    fn room(&self, scene: &Scene) -> Markup {
        let (p, view) = (&self.projection, &scene.view);
        let radius_m = self.setup.scenario.body.radius_m;
        let radius = p.length(radius_m).max(LEAST_RADIUS_PX);
        let places: Vec<Point> = view
            .robots
            .iter()
            .map(|robot| p.point(robot.pose.position))
            .collect();
        let robots = self
            .setup
            .scenario
            .robots
            .iter()
            .zip(&view.robots)
            .zip(&places);
        let robots: Vec<Named<'_>> = robots
            .map(|((spec, robot), at)| Named {
                name: &spec.name,
                doing: match (robot.state, robot.active) {
                    (AgentState::Present, Some(set)) => self.setup.catalog.behavior_name(set),
                    (AgentState::Present, None) => "",
                    (state, _) => state.as_str(),
                },
                robot,
                at: *at,
            })
            .collect();
        let mut taken = Taken::new(p.extent());
        let scale = floor::scale(p, &mut taken);
        let names = names(&robots, radius, &mut taken);
        let labels = floor::mark_labels(p, &view.marks, &mut taken);
        let room = p.extent();
        let (width, height) = (n(room.right - room.left), n(room.bottom - room.top));
        let (left, top) = (n(room.left), n(room.top));
        html! {
            // An inner drawing ends at its edges, so that no mark reaches out of the room.
            svg x=(left) y=(top) width=(width) height=(height) viewBox={ (left) " " (top) " " (width) " " (height) } {
                (floor::ground(p))
                (floor::marks(p, &view.marks))
                (floor::obstacles(p, &view.obstacles))
            }
            (floor::wall(p))
            @for (rank, points) in scene.trails.iter().enumerate() { (trail(p, points, self.colors[rank])) }
            (radio::transmissions(&scene.transmissions, &places, &self.colors, radius))
            (floor::items(p, view, radius_m))
            (labels)
            @for (rank, named) in robots.iter().enumerate() {
                @if named.robot.state != AgentState::Absent {
                    (body(named.at, named.robot.pose.heading_rad, radius, named.robot.state, self.colors[rank]))
                }
            }
            (scale)
            (names)
        }
    }
}
