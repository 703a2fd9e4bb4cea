//! What there is in the room, to look at.

use missions::waste::data::WasteSection;
use std::io::{Seek, Write};

use alliance_proto::control::AgentState;
use alliance_proto::scenario::{Obstacle, Setup};
use alliance_proto::time::SimTime;
use alliance_proto::view::{ItemView, RobotView, View};
use foxglove::messages::{
    ArrowPrimitive, Color, CubePrimitive, CylinderPrimitive, SceneEntity, SceneUpdate,
    SpherePrimitive, TextPrimitive, Vector3,
};
use plotters::style::RGBColor;
use world_server::world::Penetrability;

use super::recording::{Channel, Message, Recording};
use super::well_known::{WORLD, at, color, stamp, vector};
use crate::palette;

const FLOOR: RGBColor = RGBColor(246, 246, 244);
const BORDER: RGBColor = RGBColor(60, 60, 60);
const SPILL: RGBColor = RGBColor(236, 190, 170);
const DEPOSIT: RGBColor = RGBColor(190, 220, 190);
const SITE: RGBColor = RGBColor(206, 200, 230);
/// Of the report site for a while after a report.
const REPORTED: RGBColor = RGBColor(122, 62, 160);
const SOLID: RGBColor = RGBColor(130, 130, 130);
const SLOW: RGBColor = RGBColor(150, 110, 60);
const FAST: RGBColor = RGBColor(90, 170, 220);
const ITEM: RGBColor = RGBColor(196, 60, 40);
const INK: RGBColor = RGBColor(34, 34, 34);

/// Height of walls and robots, m.
const HEIGHT: f64 = 0.3;
/// Thickness of what lies on the floor, m.
const FLAT: f64 = 0.01;
/// Size of letters, m.
const LETTERS: f64 = 0.22;

/// The topics `/scene/…`.
pub struct SceneTopics {
    setup: Setup,
    room: Part,
    site: Part,
    obstacles: Part,
    items: Part,
    /// By rank.
    robots: Vec<(Part, RGBColor)>,
}

/// One topic with one entity, which is told again as a whole when it changes.
struct Part {
    channel: Channel<SceneUpdate>,
    id: String,
    frame: String,
    shown: Option<SceneEntity>,
}

impl Part {
    fn new<W: Write + Seek>(
        recording: &mut Recording<W>,
        topic: &str,
        id: &str,
        frame: &str,
    ) -> anyhow::Result<Self> {
        Ok(Self {
            channel: recording.channel(topic)?,
            id: id.to_owned(),
            frame: frame.to_owned(),
            shown: None,
        })
    }

    /// The entity without any parts, at rest in its frame wherever that goes.
    fn bare(&self) -> SceneEntity {
        SceneEntity {
            id: self.id.clone(),
            frame_id: self.frame.clone(),
            frame_locked: true,
            ..SceneEntity::default()
        }
    }

    /// Tells how it looks from now on, if that is new.
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
    /// # Errors
    /// Those of the recording.
    pub fn new<W: Write + Seek>(
        recording: &mut Recording<W>,
        setup: &Setup,
    ) -> anyhow::Result<Self> {
        let names = || setup.scenario.robots.iter().map(|robot| &*robot.name);
        let mut still = |id: &str| Part::new(recording, &format!("/scene/{id}"), id, WORLD);
        let (room, site) = (still("room")?, still("site")?);
        let (obstacles, items) = (still("obstacles")?, still("items")?);
        let robots = names()
            .zip(palette::colors(names()))
            .map(|(name, color)| {
                let topic = format!("/scene/robots/{name}");
                Ok((Part::new(recording, &topic, name, name)?, color))
            })
            .collect::<anyhow::Result<_>>()?;
        Ok(Self {
            setup: setup.clone(),
            room,
            site,
            obstacles,
            items,
            robots,
        })
    }

    /// Tells what has changed.
    pub fn see(&mut self, view: &View, seen: &mut Vec<Message>) {
        let now = view.now;
        let room = self.draw_room();
        self.room.show(now, room, seen);
        let site = self.draw_site(view.site_colored);
        self.site.show(now, site, seen);
        let obstacles = SceneEntity {
            cubes: view.obstacles.iter().map(block).collect(),
            ..self.obstacles.bare()
        };
        self.obstacles.show(now, obstacles, seen);
        let items = self.draw_items(&view.waste);
        self.items.show(now, items, seen);
        for (rank, robot) in view.robots.iter().enumerate() {
            let entity = self.draw_robot(rank, robot);
            self.robots[rank].0.show(now, entity, seen);
        }
    }

    /// What never changes: floor, border, spills and deposit, with their names.
    fn draw_room(&self) -> SceneEntity {
        let scenario = &self.setup.scenario;
        let (width, height) = (scenario.room.width_m, scenario.room.height_m);
        let (width, height) = (f64::from(width), f64::from(height));
        let middle = |level: f64| vector(width / 2.0, height / 2.0, level);
        let wall = 0.05;
        let beam = |center: (f64, f64), size: (f64, f64)| CubePrimitive {
            pose: Some(at(vector(center.0, center.1, HEIGHT / 2.0))),
            size: Some(vector(size.0, size.1, HEIGHT)),
            color: Some(color(BORDER, 1.0)),
        };
        // Outside, so that a robot at the border touches it.
        let outside = wall / 2.0;
        let floor = CubePrimitive {
            pose: Some(at(middle(-1.5 * FLAT))),
            size: Some(vector(width, height, FLAT)),
            color: Some(color(FLOOR, 1.0)),
        };
        let disc = |center: (f64, f64), radius: f32, paint: RGBColor| CylinderPrimitive {
            pose: Some(at(vector(center.0, center.1, 0.0))),
            size: Some(vector(2.0 * radius, 2.0 * radius, FLAT)),
            bottom_scale: 1.0,
            top_scale: 1.0,
            color: Some(color(paint, 1.0)),
        };
        let place = |x_fraction: f32, y_fraction: f32| {
            (
                f64::from(x_fraction) * width,
                f64::from(y_fraction) * height,
            )
        };
        let waste = WasteSection::of(scenario);
        let mut discs = Vec::new();
        let mut names = Vec::new();
        for spill in &waste.spills {
            let center = place(spill.x_fraction, spill.y_fraction);
            discs.push(disc(center, waste.spill_radius_m, SPILL));
            let above = center.1 + f64::from(waste.spill_radius_m) + LETTERS;
            let text = format!("spill {}", spill.name);
            names.push(lettering(text, vector(center.0, above, 0.1)));
        }
        let radius_m = waste.deposit.radius_m;
        for deposit in waste.deposits() {
            let center = place(deposit.x_fraction, deposit.y_fraction);
            discs.push(disc(center, radius_m, DEPOSIT));
            let above = vector(center.0, center.1 + f64::from(radius_m) + LETTERS, 0.1);
            names.push(lettering("deposit".to_owned(), above));
        }
        let along = (width + 2.0 * wall, wall);
        let across = (wall, height);
        SceneEntity {
            cubes: vec![
                floor,
                beam((width / 2.0, -outside), along),
                beam((width / 2.0, height + outside), along),
                beam((-outside, height / 2.0), across),
                beam((width + outside, height / 2.0), across),
            ],
            cylinders: discs,
            texts: names,
            ..self.room.bare()
        }
    }

    /// The report site, which changes its color for a while when a report is made.
    fn draw_site(&self, colored: bool) -> SceneEntity {
        let scenario = &self.setup.scenario;
        let site = &WasteSection::of(&scenario).report_site;
        // Cut off at the border.
        let width = f64::from(site.width_m.min(scenario.room.width_m));
        let height = f64::from(site.height_m.min(scenario.room.height_m));
        let middle = f64::from(scenario.room.height_m) / 2.0;
        let paint = if colored { REPORTED } else { SITE };
        SceneEntity {
            cubes: vec![CubePrimitive {
                pose: Some(at(vector(width / 2.0, middle, 0.0))),
                size: Some(vector(width, height, FLAT)),
                color: Some(color(paint, 1.0)),
            }],
            texts: vec![lettering(
                "report site".to_owned(),
                vector(width, middle + height / 2.0 + LETTERS, 0.1),
            )],
            ..self.site.bare()
        }
    }

    /// Those on the floor: what is carried goes with its robot.
    fn draw_items(&self, waste: &[ItemView]) -> SceneEntity {
        let on_floor = waste.iter().filter(|item| item.carrier.is_none());
        SceneEntity {
            spheres: on_floor
                .map(|item| self.item(item.position.x, item.position.y))
                .collect(),
            ..self.items.bare()
        }
    }

    fn item(&self, x: f32, y: f32) -> SpherePrimitive {
        let radius = WasteSection::of(&self.setup.scenario).item_radius_m;
        SpherePrimitive {
            pose: Some(at(vector(x, y, radius))),
            size: Some(vector(2.0 * radius, 2.0 * radius, 2.0 * radius)),
            color: Some(color(ITEM, 1.0)),
        }
    }

    /// Body, heading, what it carries, and what it does, in its own frame.
    fn draw_robot(&self, rank: usize, robot: &RobotView) -> SceneEntity {
        let (part, own) = &self.robots[rank];
        if robot.state == AgentState::Absent {
            return part.bare();
        }
        let radius = self.setup.scenario.body.radius_m;
        let alive = robot.state == AgentState::Present;
        let paint =
            |rgb: RGBColor| -> Option<Color> { Some(color(rgb, if alive { 1.0 } else { 0.4 })) };
        let does = match robot.active {
            _ if !alive => robot.state.as_str(),
            Some(set) => self.setup.catalog.behavior_name(set),
            None => "idle",
        };
        let name = &self.setup.scenario.robots[rank].name;
        SceneEntity {
            cylinders: vec![CylinderPrimitive {
                pose: Some(at(vector(0.0, 0.0, HEIGHT / 2.0))),
                size: Some(vector(2.0 * radius, 2.0 * radius, HEIGHT)),
                bottom_scale: 1.0,
                top_scale: 1.0,
                color: paint(*own),
            }],
            arrows: vec![ArrowPrimitive {
                pose: Some(at(vector(0.0, 0.0, HEIGHT + FLAT))),
                shaft_length: 0.6 * f64::from(radius),
                shaft_diameter: 0.3 * f64::from(radius),
                head_length: 0.4 * f64::from(radius),
                head_diameter: 0.7 * f64::from(radius),
                color: paint(INK),
            }],
            spheres: robot
                .carrying
                .iter()
                .map(|_| self.item(radius, 0.0))
                .collect(),
            texts: vec![lettering(
                format!("{name}: {does}"),
                vector(0.0, 0.0, HEIGHT + 1.5 * LETTERS),
            )],
            ..part.bare()
        }
    }
}

/// A rectangle on the floor: a block, or a patch where one can drive.
fn block(obstacle: &Obstacle) -> CubePrimitive {
    let penetrability = Penetrability(obstacle.penetrability);
    let (paint, opacity, height) = match obstacle.penetrability {
        _ if penetrability.is_solid() => (SOLID, 1.0, HEIGHT),
        slow if slow < 1.0 => (SLOW, 0.5, 2.0 * FLAT),
        _ => (FAST, 0.5, 2.0 * FLAT),
    };
    CubePrimitive {
        pose: Some(at(vector(
            obstacle.x_m + obstacle.width_m / 2.0,
            obstacle.y_m + obstacle.height_m / 2.0,
            height / 2.0,
        ))),
        size: Some(vector(obstacle.width_m, obstacle.height_m, height)),
        color: Some(color(paint, opacity)),
    }
}

/// Text that turns to whoever looks at it.
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
