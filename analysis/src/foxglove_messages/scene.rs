//! The visible scene: room, marks, obstacles, items and robots.

use foxglove::messages::{
    ArrowPrimitive, Color, CubePrimitive, CylinderPrimitive, Pose, SceneEntity, SceneUpdate,
    SpherePrimitive, TextPrimitive, Vector3,
};
use glam::Vec2;
use plotters::style::RGBColor;
use proto::control::AgentState;
use proto::view::{ItemView, Mark, MarkOutline, RobotView, View};
use scenario::time::SimTime;
use scenario::{Obstacle, Setup};

use super::topics::{Channel, Message, Topics};
use super::well_known::{WORLD, at, color, stamp, turned, vector};
use crate::export::look::{
    self, BORDER, FLAT, FLOOR, HEIGHT, LETTERS, ROBOT_LETTERS_HEIGHT, THIN, activity, mark_opacity,
    robot_opacity,
};
use crate::figures::canvas::INK;
use crate::figures::palette;

pub struct SceneTopics {
    setup: Setup,
    room: EntityTopic,
    marks: EntityTopic,
    obstacles: EntityTopic,
    items: EntityTopic,
    /// The robots with their colors, by rank.
    robots: Vec<(EntityTopic, RGBColor)>,
}

/// One topic with one entity. A change publishes the whole entity again.
struct EntityTopic {
    channel: Channel<SceneUpdate>,
    id: String,
    frame: String,
    shown: Option<SceneEntity>,
}

impl EntityTopic {
    fn new(to: &mut dyn Topics, topic: &str, id: &str, frame: &str) -> anyhow::Result<Self> {
        Ok(Self {
            channel: to.channel(topic)?,
            id: id.to_owned(),
            frame: frame.to_owned(),
            shown: None,
        })
    }

    /// Returns an empty entity, fixed in its frame.
    fn bare(&self) -> SceneEntity {
        SceneEntity {
            id: self.id.clone(),
            frame_id: self.frame.clone(),
            frame_locked: true,
            ..SceneEntity::default()
        }
    }

    /// Publishes an entity if it differs from the last one.
    fn show(&mut self, now: SimTime, entity: SceneEntity, seen: &mut Vec<Message>) {
        if self.shown.as_ref() == Some(&entity) {
            return;
        }
        let update = SceneUpdate {
            deletions: Vec::new(),
            entities: vec![SceneEntity {
                timestamp: Some(stamp(now)),
                ..entity.clone()
            }],
        };
        seen.push(self.channel.message(now, &update));
        self.shown = Some(entity);
    }
}

impl SceneTopics {
    /// Adds the topics to a destination.
    pub fn new(to: &mut dyn Topics, setup: &Setup) -> anyhow::Result<Self> {
        let names = || setup.scenario.robots.iter().map(|robot| &*robot.name);
        let mut still = |id: &str| EntityTopic::new(to, &format!("/scene/{id}"), id, WORLD);
        let (room, marks) = (still("room")?, still("marks")?);
        let (obstacles, items) = (still("obstacles")?, still("items")?);
        let robots = names()
            .zip(palette::colors(names()))
            .map(|(name, color)| {
                let topic = format!("/scene/robots/{name}");
                Ok((EntityTopic::new(to, &topic, name, name)?, color))
            })
            .collect::<anyhow::Result<_>>()?;
        Ok(Self {
            setup: setup.clone(),
            room,
            marks,
            obstacles,
            items,
            robots,
        })
    }

    /// Publishes the parts of the scene that have changed.
    pub fn record(&mut self, view: &View, seen: &mut Vec<Message>) {
        let now = view.now;
        let room = self.draw_room();
        self.room.show(now, room, seen);
        let marks = draw_marks(&view.marks, self.marks.bare());
        self.marks.show(now, marks, seen);
        let obstacles = SceneEntity {
            cubes: view.obstacles.iter().map(block).collect(),
            ..self.obstacles.bare()
        };
        self.obstacles.show(now, obstacles, seen);
        let items = self.draw_items(&view.items);
        self.items.show(now, items, seen);
        for (rank, robot) in view.robots.iter().enumerate() {
            let load = robot
                .carrying
                .and_then(|item| view.items.get(item.0 as usize));
            let entity = self.draw_robot(rank, robot, load);
            self.robots[rank].0.show(now, entity, seen);
        }
    }

    /// Draws the static parts: floor and border.
    fn draw_room(&self) -> SceneEntity {
        let scenario = &self.setup.scenario;
        let (width, height) = (scenario.room.width_m, scenario.room.height_m);
        let (width, height) = (f64::from(width), f64::from(height));
        let middle = scenario.room.middle();
        let center = vector(middle.x, middle.y, -1.5 * FLAT);
        let floor = cube(at(center), vector(width, height, FLAT), color(FLOOR, 1.0));
        let walls = look::border(&self.setup).map(|wall| {
            let center = vector(wall.center.0, wall.center.1, HEIGHT / 2.0);
            let size = vector(wall.size.0, wall.size.1, HEIGHT);
            cube(at(center), size, color(BORDER, 1.0))
        });
        SceneEntity {
            cubes: [floor].into_iter().chain(walls).collect(),
            ..self.room.bare()
        }
    }

    /// Draws the items on the floor. A carried item belongs to its robot.
    fn draw_items(&self, items: &[ItemView]) -> SceneEntity {
        let on_floor = items.iter().filter(|item| item.carrier.is_none());
        SceneEntity {
            spheres: on_floor
                .map(|item| ball(item.position.x, item.position.y, item.radius_m))
                .collect(),
            ..self.items.bare()
        }
    }

    /// Draws a robot in its own frame: body, heading, load and activity.
    fn draw_robot(&self, rank: usize, robot: &RobotView, load: Option<&ItemView>) -> SceneEntity {
        let (topic, robot_color) = &self.robots[rank];
        if robot.state == AgentState::Absent {
            return topic.bare();
        }
        let radius = self.setup.scenario.body.radius_m;
        let paint = |rgb: RGBColor| color(rgb, robot_opacity(robot));
        let activity = activity(&self.setup, robot);
        let name = &self.setup.scenario.robots[rank].name;
        SceneEntity {
            cylinders: vec![cylinder(
                vector(0.0, 0.0, HEIGHT / 2.0),
                (radius, HEIGHT),
                paint(*robot_color),
            )],
            arrows: vec![ArrowPrimitive {
                pose: Some(at(vector(0.0, 0.0, HEIGHT + FLAT))),
                shaft_length: 0.6 * f64::from(radius),
                shaft_diameter: 0.3 * f64::from(radius),
                head_length: 0.4 * f64::from(radius),
                head_diameter: 0.7 * f64::from(radius),
                color: Some(paint(INK)),
            }],
            spheres: load
                .iter()
                .map(|item| ball(radius, 0.0, item.radius_m))
                .collect(),
            texts: vec![lettering(
                format!("{name}: {activity}"),
                vector(0.0, 0.0, ROBOT_LETTERS_HEIGHT),
            )],
            ..topic.bare()
        }
    }
}

fn ball(x: f32, y: f32, radius: f32) -> SpherePrimitive {
    SpherePrimitive {
        pose: Some(at(vector(x, y, radius))),
        size: Some(vector(2.0 * radius, 2.0 * radius, 2.0 * radius)),
        color: Some(color(palette::ITEM, 1.0)),
    }
}

/// Draws the mission's marks flat on the floor, with labels.
fn draw_marks(marks: &[Mark], bare: SceneEntity) -> SceneEntity {
    let mut entity = bare;
    for mark in marks {
        let paint = color(palette::mark_color(mark), mark_opacity(mark));
        let mut slab = |from: Vec2, to: Vec2, width: f32| {
            let (way, middle) = (to - from, (from + to) / 2.0);
            let pose = Pose {
                position: Some(vector(middle.x, middle.y, 0.0)),
                orientation: Some(turned(way.y.atan2(way.x))),
            };
            let size = vector(way.length(), width, FLAT);
            entity.cubes.push(cube(pose, size, paint));
        };
        match mark.outline {
            MarkOutline::Disc { center, radius_m } => {
                let at = vector(center.x, center.y, 0.0);
                entity.cylinders.push(cylinder(at, (radius_m, FLAT), paint));
            }
            MarkOutline::Rectangle { min, max } => {
                let middle_y = (min.y + max.y) / 2.0;
                let end = |x| Vec2::new(x, middle_y);
                slab(end(min.x), end(max.x), max.y - min.y);
            }
            MarkOutline::Bar {
                from,
                to,
                half_width_m,
            } => slab(from, to, 2.0 * half_width_m),
            MarkOutline::Line { from, to } => slab(from, to, THIN),
        }
        if mark.is_labelled(marks.len()) {
            let top = mark.outline.label_place();
            let above = vector(top.x, f64::from(top.y) + LETTERS, 0.1);
            entity.texts.push(lettering(mark.label.clone(), above));
        }
    }
    entity
}

/// Draws a rectangle on the floor: a block, or a patch that robots can cross.
fn block(obstacle: &Obstacle) -> CubePrimitive {
    let (paint, opacity, height) = look::of_obstacle(obstacle);
    let x = obstacle.x_m + obstacle.width_m / 2.0;
    let y = obstacle.y_m + obstacle.height_m / 2.0;
    let size = vector(obstacle.width_m, obstacle.height_m, height);
    cube(at(vector(x, y, height / 2.0)), size, color(paint, opacity))
}

fn cube(pose: Pose, size: Vector3, color: Color) -> CubePrimitive {
    CubePrimitive {
        pose: Some(pose),
        size: Some(size),
        color: Some(color),
    }
}

fn cylinder(center: Vector3, (radius, height): (f32, f64), color: Color) -> CylinderPrimitive {
    CylinderPrimitive {
        pose: Some(at(center)),
        size: Some(vector(2.0 * radius, 2.0 * radius, height)),
        bottom_scale: 1.0,
        top_scale: 1.0,
        color: Some(color),
    }
}

/// Returns a text that turns towards the viewer.
fn lettering(text: String, position: Vector3) -> TextPrimitive {
    TextPrimitive {
        pose: Some(at(position)),
        billboard: true,
        font_size: LETTERS,
        scale_invariant: false,
        color: Some(color(INK, 1.0)),
        text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::visit;

    #[test]
    fn marks_of_any_mission_lie_on_the_floor_with_their_labels() {
        let entity = draw_marks(&visit::marks(), SceneEntity::default());
        let texts: Vec<&str> = entity.texts.iter().map(|text| text.text.as_str()).collect();
        assert_eq!(texts, ["place", "home", "box", "rope"]);
        assert_eq!((entity.cylinders.len(), entity.cubes.len()), (1, 3));
        // The bar is 5 m long.
        let size = entity.cubes[1].size.unwrap();
        assert!((size.x - 5.0).abs() < 1e-6 && (size.y - 0.4).abs() < 1e-6);
        let half_left = entity.cubes[1].color;
        assert_eq!(half_left, Some(color(palette::ITEM, 1.0)));
        let left = entity.cylinders[0].color;
        assert_eq!(left, Some(color(RGBColor(179, 148, 216), 1.0)));
    }
}
