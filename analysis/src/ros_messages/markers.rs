//! The visible scene: room, marks, obstacles, items and robots.

use std::collections::BTreeMap;

use glam::Vec2;
use plotters::style::RGBColor;
use proto::control::AgentState;
use proto::view::{ItemView, Mark, MarkOutline, RobotView, View};
use ros::Qos;
use ros::messages::{ColorRgba, Marker, MarkerArray, Point, Vector3};
use scenario::{Obstacle, Setup};

use super::convert::{MAP_FRAME, body_frame, color, point, pose, stamp};
use super::destination::{Destination, Topic};
use crate::export::look::{
    self, BORDER, FLAT, FLOOR, HEIGHT, LETTERS, ROBOT_LETTERS_HEIGHT, THIN, activity, mark_opacity,
    robot_opacity,
};
use crate::figures::canvas::INK;
use crate::figures::palette;

/// The topic `/markers`. Each message contains the whole scene, because players of bags may drop messages.
pub struct MarkerTopic {
    topic: Topic<MarkerArray>,
    setup: Setup,
    /// The frames and colors of the robots, by rank.
    robots: Vec<(String, RGBColor)>,
    /// The latest scene, without times.
    shown: Vec<Marker>,
}

impl MarkerTopic {
    pub fn new(to: &mut dyn Destination, setup: &Setup, names: &[String]) -> anyhow::Result<Self> {
        let robots = setup.scenario.robots.iter().map(|robot| &*robot.name);
        let frames = names.iter().map(|name| body_frame(name));
        Ok(Self {
            topic: to.topic("/markers", Qos::Latched)?,
            robots: frames.zip(palette::colors(robots)).collect(),
            setup: setup.clone(),
            shown: Vec::new(),
        })
    }

    /// Writes the scene if it has changed, with deletions of the markers that are gone.
    pub fn write(&mut self, to: &mut dyn Destination, view: &View) -> anyhow::Result<()> {
        let scene = self.draw(view);
        if scene == self.shown {
            return Ok(());
        }
        let key = |marker: &Marker| (marker.ns.clone(), marker.id);
        let drawn: Vec<_> = scene.iter().map(key).collect();
        let gone = self
            .shown
            .iter()
            .filter(|marker| !drawn.contains(&key(marker)));
        let deletions = gone.map(|marker| Marker {
            action: Marker::DELETE.into(),
            header: marker.header.clone(),
            ns: marker.ns.clone(),
            id: marker.id,
            ..Marker::default()
        });
        let mut markers: Vec<Marker> = deletions.chain(scene.iter().cloned()).collect();
        for marker in &mut markers {
            marker.header.stamp = stamp(view.now);
        }
        self.shown = scene;
        to.write(&self.topic, view.now, &MarkerArray { markers })
    }

    fn draw(&self, view: &View) -> Vec<Marker> {
        let mut scene = Layers::default();
        self.draw_room(&mut scene);
        for mark in &view.marks {
            draw_mark(mark, view.marks.len(), &mut scene);
        }
        for obstacle in &view.obstacles {
            draw_obstacle(obstacle, &mut scene);
        }
        draw_items(&view.items, &mut scene);
        for (rank, robot) in view.robots.iter().enumerate() {
            if robot.state != AgentState::Absent {
                self.draw_robot(rank, robot, &view.items, &mut scene);
            }
        }
        scene.markers
    }

    /// Draws the static parts: floor and border.
    fn draw_room(&self, scene: &mut Layers) {
        let room = &self.setup.scenario.room;
        let floor = scene.add("room", MAP_FRAME, Marker::CUBE);
        floor.pose.position = point(room.middle().x, room.middle().y, -1.5 * FLAT);
        floor.scale = size(room.width_m, room.height_m, FLAT);
        floor.color = color(FLOOR, 1.0);
        for wall in look::border(&self.setup) {
            let marker = scene.add("room", MAP_FRAME, Marker::CUBE);
            marker.pose.position = point(wall.center.0, wall.center.1, HEIGHT / 2.0);
            marker.scale = size(wall.size.0, wall.size.1, HEIGHT);
            marker.color = color(BORDER, 1.0);
        }
    }

    /// Draws a robot in its own frame: body, heading, load and activity.
    fn draw_robot(&self, rank: usize, robot: &RobotView, items: &[ItemView], scene: &mut Layers) {
        let (frame, robot_color) = &self.robots[rank];
        let name = &self.setup.scenario.robots[rank].name;
        let radius_m = f64::from(self.setup.scenario.body.radius_m);
        let paint = |rgb: RGBColor| color(rgb, robot_opacity(robot));
        let body = scene.add("robots", frame, Marker::CYLINDER);
        // A robot keeps its numbers when others come and go.
        body.id = rank as i32;
        body.pose.position = point(0.0, 0.0, HEIGHT / 2.0);
        body.scale = size(2.0 * radius_m, 2.0 * radius_m, HEIGHT);
        body.color = paint(*robot_color);
        let arrow = scene.add("headings", frame, Marker::ARROW);
        arrow.id = rank as i32;
        arrow.pose.position = point(0.0, 0.0, HEIGHT + FLAT);
        arrow.scale = size(radius_m, 0.4 * radius_m, 0.4 * radius_m);
        arrow.color = paint(INK);
        let load = robot.carrying.and_then(|item| items.get(item.0 as usize));
        if let Some(item) = load {
            let ball = scene.add("loads", frame, Marker::SPHERE);
            ball.id = rank as i32;
            ball.pose.position = point(radius_m, 0.0, item.radius_m);
            ball.scale = ball_size(item.radius_m);
            ball.color = color(palette::ITEM, 1.0);
        }
        let text = format!("{name}: {}", activity(&self.setup, robot));
        let above = point(0.0, 0.0, ROBOT_LETTERS_HEIGHT);
        scene.add_text("activities", frame, text, above).id = rank as i32;
    }
}

/// The markers of a scene by namespace.
#[derive(Default)]
struct Layers {
    markers: Vec<Marker>,
    /// The number of markers by namespace.
    counts: BTreeMap<&'static str, i32>,
}

impl Layers {
    /// Adds a marker of a type at the origin of a frame, with the next number in its namespace.
    fn add(&mut self, namespace: &'static str, frame: &str, type_: u8) -> &mut Marker {
        let count = self.counts.entry(namespace).or_default();
        let mut marker = Marker {
            ns: namespace.to_owned(),
            id: *count,
            type_: type_.into(),
            action: Marker::ADD.into(),
            pose: pose(Point::default(), 0.0),
            frame_locked: true,
            ..Marker::default()
        };
        marker.header.frame_id = frame.to_owned();
        *count += 1;
        self.markers.push_mut(marker)
    }

    /// Adds a text that turns towards the viewer.
    fn add_text(
        &mut self,
        namespace: &'static str,
        frame: &str,
        text: String,
        position: Point,
    ) -> &mut Marker {
        let marker = self.add(namespace, frame, Marker::TEXT_VIEW_FACING);
        marker.pose.position = position;
        marker.scale = size(0.0, 0.0, LETTERS);
        marker.color = color(INK, 1.0);
        marker.text = text;
        marker
    }
}

/// Draws a mark of the mission flat on the floor, with its label.
fn draw_mark(mark: &Mark, among: usize, scene: &mut Layers) {
    let paint = color(palette::mark_color(mark), mark_opacity(mark));
    match mark.outline {
        MarkOutline::Disc { center, radius_m } => {
            let disc = scene.add("marks", MAP_FRAME, Marker::CYLINDER);
            disc.pose.position = point(center.x, center.y, 0.0);
            disc.scale = size(2.0 * radius_m, 2.0 * radius_m, FLAT);
            disc.color = paint;
        }
        MarkOutline::Rectangle { min, max } => {
            let middle_y = (min.y + max.y) / 2.0;
            let end = |x| Vec2::new(x, middle_y);
            draw_slab(end(min.x), end(max.x), max.y - min.y, paint, scene);
        }
        MarkOutline::Bar {
            from,
            to,
            half_width_m,
        } => draw_slab(from, to, 2.0 * half_width_m, paint, scene),
        MarkOutline::Line { from, to } => draw_slab(from, to, THIN, paint, scene),
    }
    if mark.is_labelled(among) {
        let top = mark.outline.label_place();
        let above = point(top.x, f64::from(top.y) + LETTERS, 0.1);
        scene.add_text("labels", MAP_FRAME, mark.label.clone(), above);
    }
}

/// Draws a flat bar between two points.
fn draw_slab(from: Vec2, to: Vec2, width_m: f32, paint: ColorRgba, scene: &mut Layers) {
    let (way, middle) = (to - from, (from + to) / 2.0);
    let slab = scene.add("marks", MAP_FRAME, Marker::CUBE);
    slab.pose = pose(point(middle.x, middle.y, 0.0), libm::atan2f(way.y, way.x));
    slab.scale = size(way.length(), width_m, FLAT);
    slab.color = paint;
}

fn draw_obstacle(obstacle: &Obstacle, scene: &mut Layers) {
    let (paint, opacity, height) = look::of_obstacle(obstacle);
    let x = obstacle.x_m + obstacle.width_m / 2.0;
    let y = obstacle.y_m + obstacle.height_m / 2.0;
    let block = scene.add("obstacles", MAP_FRAME, Marker::CUBE);
    block.pose.position = point(x, y, height / 2.0);
    block.scale = size(obstacle.width_m, obstacle.height_m, height);
    block.color = color(paint, opacity);
}

/// Draws the items on the floor, one marker for all items of a size. A carried item belongs to its robot.
fn draw_items(items: &[ItemView], scene: &mut Layers) {
    let mut by_size: BTreeMap<u32, (f32, Vec<Point>)> = BTreeMap::new();
    for item in items.iter().filter(|item| item.carrier.is_none()) {
        let of_size = by_size.entry(item.radius_m.to_bits()).or_default();
        of_size.0 = item.radius_m;
        let place = point(item.position.x, item.position.y, item.radius_m);
        of_size.1.push(place);
    }
    for (radius_m, points) in by_size.into_values() {
        let balls = scene.add("items", MAP_FRAME, Marker::SPHERE_LIST);
        balls.scale = ball_size(radius_m);
        balls.color = color(palette::ITEM, 1.0);
        balls.points = points;
    }
}

fn ball_size(radius_m: f32) -> Vector3 {
    size(2.0 * radius_m, 2.0 * radius_m, 2.0 * radius_m)
}

/// Creates a size, m.
fn size(x: impl Into<f64>, y: impl Into<f64>, z: impl Into<f64>) -> Vector3 {
    Vector3 {
        x: x.into(),
        y: y.into(),
        z: z.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::visit;

    fn of<'s>(scene: &'s Layers, namespace: &'s str) -> impl Iterator<Item = &'s Marker> {
        let markers = scene.markers.iter();
        markers.filter(move |marker| marker.ns == namespace)
    }

    #[test]
    fn marks_of_any_mission_lie_on_the_floor_with_their_labels() {
        let mut scene = Layers::default();
        let marks = visit::marks();
        for mark in &marks {
            draw_mark(mark, marks.len(), &mut scene);
        }
        let texts: Vec<&str> = of(&scene, "labels").map(|marker| &*marker.text).collect();
        assert_eq!(texts, ["place", "home", "box", "rope"]);
        let numbers: Vec<i32> = of(&scene, "marks").map(|marker| marker.id).collect();
        assert_eq!(numbers, [0, 1, 2, 3]);
        let types: Vec<i32> = of(&scene, "marks").map(|marker| marker.type_).collect();
        assert_eq!(types, [3, 1, 1, 1]);
    }

    #[test]
    fn items_of_a_size_are_one_marker_and_carried_items_are_not_on_the_floor() {
        let item = |x, radius_m, carrier| ItemView {
            position: Vec2::new(x, 1.0),
            carrier,
            radius_m,
        };
        let carrier = Some(scenario::ids::RobotId(0));
        let items = [
            item(0.0, 0.1, None),
            item(1.0, 0.2, None),
            item(2.0, 0.1, None),
            item(3.0, 0.1, carrier),
        ];
        let mut scene = Layers::default();
        draw_items(&items, &mut scene);
        let counts: Vec<usize> = scene
            .markers
            .iter()
            .map(|marker| marker.points.len())
            .collect();
        assert_eq!(counts, [2, 1]);
    }
}
