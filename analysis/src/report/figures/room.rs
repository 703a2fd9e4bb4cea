//! The room at one time: robots, items, tasks and recent paths.

use std::ops::Range;

use glam::Vec2;
use plotters::element::{Circle, PathElement};
use plotters::style::Color;
use proto::control::AgentState;
use proto::view::{ItemView, View};

use super::RunFigures;
use super::map::{Detail, Map, Scene, beside, map_height_px, track};
use crate::figures::canvas::{
    Area, Chart, DrawResult, FAINT, INK, Mark, TextLabel, WHITE, line, part, px,
};
use crate::figures::palette;

/// Duration of the paths before the shown time, s.
pub const TRAIL_S: f64 = 30.0;

const TITLE_PX: f64 = 22.0;

#[derive(Clone, Debug)]
pub struct Room {
    pub view: View,
}

impl Room {
    #[must_use]
    pub fn name(&self) -> String {
        format!("room-at-{}s", self.at_s())
    }

    #[must_use]
    pub fn at_s(&self) -> f64 {
        self.view.now.as_secs_f64()
    }
}

pub fn draw(run: &RunFigures<'_>, room: &Room) -> anyhow::Result<String> {
    let width = run.sheet.width_px;
    let height = map_height_px(run, width, width * 0.75);
    let title = format!("The room at {} s", room.at_s());
    run.sheet.svg(&title, TITLE_PX + height, |area| {
        let letters = TextLabel::BOLD;
        letters.write(area, &title, (58.0, TITLE_PX / 2.0))?;
        let panel = part(area, (0.0, TITLE_PX), (width, height));
        let map = Map::new(run, area, &panel, (width, height), Detail::All)?;
        let view = &room.view;
        let on_floor = view.items.iter().filter(|item| item.carrier.is_none());
        let items: Vec<ItemView> = on_floor.copied().collect();
        map.scene(&Scene {
            marks: &view.marks,
            items: &items,
            obstacles: &view.obstacles,
        })?;
        let before: Range<f64> = (room.at_s() - TRAIL_S).max(0.0)..room.at_s();
        for rank in 0..view.robots.len() {
            map.track(rank, track(run, rank, &before))?;
        }
        let mut names = Vec::new();
        for rank in 0..view.robots.len() {
            names.extend(robot(run, area, &map.chart, (view, rank))?);
        }
        let (left, _) = map.chart.plotting_area().map_coordinate(&(0.0, 0.0));
        let radius_m = f64::from(run.history.setup.scenario.body.radius_m);
        let (right, _) = map.chart.plotting_area().map_coordinate(&(radius_m, 0.0));
        beside(area, &names, (right - left).max(px(6.0)))
    })
}

/// Candidate texts, and the point that they label.
type Label = (Vec<String>, (i32, i32));

/// Draws a robot in its true size, with heading and load. Returns its candidate labels and their point.
fn robot(
    run: &RunFigures<'_>,
    area: &Area<'_>,
    chart: &Chart<'_>,
    (view, rank): (&View, usize),
) -> DrawResult<Option<Label>> {
    let robot = &view.robots[rank];
    if robot.state == AgentState::Absent {
        return Ok(None);
    }
    let plot = chart.plotting_area();
    let place = |at: Vec2| plot.map_coordinate(&(f64::from(at.x), f64::from(at.y)));
    let at = place(robot.pose.position);
    let radius_m = run.history.setup.scenario.body.radius_m;
    let edge = place(robot.pose.position + Vec2::new(radius_m, 0.0));
    let radius = (edge.0 - at.0).max(px(3.0));
    let present = robot.state == AgentState::Present;
    let color = if present { run.colors[rank] } else { FAINT };
    area.draw(&Circle::new(at, radius, color.filled()))?;
    area.draw(&Circle::new(at, radius, line(INK, 0.75)))?;
    let (sin, cos) = libm::sincosf(robot.pose.heading_rad);
    let reach = radius as f32;
    let nose = (at.0 + (cos * reach) as i32, at.1 - (sin * reach) as i32);
    area.draw(&PathElement::new([at, nose], line(WHITE, 1.5)))?;
    if robot.carrying.is_some() {
        Mark::Square.draw_sized(area, at, palette::ITEM, 2.5)?;
    }
    let name = &run.history.robots[rank].name;
    let (mark, doing) = match robot.state {
        AgentState::Dead => (Some((Mark::Cross, INK)), Some("dead")),
        AgentState::Silent => (Some((Mark::Square, WHITE)), Some("stopped")),
        _ => {
            let set = robot
                .active
                .map(|set| &run.history.catalog.sets[set.index()]);
            (None, set.map(|set| set.name.as_str()))
        }
    };
    if let Some((mark, color)) = mark {
        mark.draw(area, at, color)?;
    }
    let doing = doing.map(|doing| format!("{name}: {doing}"));
    let names = doing.into_iter().chain([name.clone()]);
    Ok(Some((names.collect(), at)))
}
