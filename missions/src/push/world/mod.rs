//! The world's part of push: bars move when bodies drive against them.
//!
//! - `mechanics`: the motion of a bar. `log`: statistics and display.
//!
//! # Motion of a bar
//! - A body moves it by driving against its outer third, from behind and within 30° of its normal. The contact moves
//!   with the body, at most at the body's push speed.
//! - The bar turns about the point given by friction (`mechanics`), or about a body that touches it from behind
//!   farther off. An end without such a body moves back.
//! - An object in its way stops it, and it never leans by more than `skew_m`.
//! - A bar has arrived once both ends are over the line, also if it moves later.

mod log;
mod mechanics;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::Vec2;
use proto::mission::{Action, SensorReading as AnyReading};
use proto::readings::Pose;
use proto::tick::Outcome;
use proto::view::{Mark, MarkOutline, MarkRole, View, Work};
use scenario::fault::MissionFault;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Scenario, Setup};
use serde::Serialize;
use world_server::mission::{
    FigureValue, MissionWorld, StepEvents, TeamFigures, Validity, hash_state,
};
use world_server::world::{Bar, ChangeError, Floor, Push, SKIN_M};
use xxhash_rust::xxh3::xxh3_64;

use super::bar::{BarEnd, end, lead_m, to_bar_frame};
use super::bus::{BarSeen, SensorReading};
use super::data::{self, PushSection, STUCK_S};
use log::Statistics;
use mechanics::{Contact, Slip, contact, pivot_of, turned_by};

/// The distance at which a body touches a bar, m. Bodies stop a [`SKIN_M`] short of it.
const TOUCH_M: f32 = 3.0 * SKIN_M;

#[derive(Clone, Serialize)]
pub struct PushWorld {
    #[serde(skip)]
    section: Arc<PushSection>,
    #[serde(skip)]
    bars: Vec<BarState>,
    #[serde(skip)]
    robots: Vec<Pushing>,
    /// The hash of bars and robots, which stands for their entire state.
    hash: u64,
    #[serde(skip)]
    log: Statistics,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct BarState {
    pose: Pose,
    has_arrived: bool,
    /// The end of the fault that holds the bar.
    stuck_until: SimTime,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Pushing {
    push: Option<CurrentPush>,
    /// True if the robot slipped in the previous step.
    slips: bool,
    /// True if the robot pushed in this step; false between steps.
    pushes_now: bool,
    slips_now: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct CurrentPush {
    bar: usize,
    end: BarEnd,
    moved_m: f32,
}

impl PushWorld {
    fn hash(&self) -> u64 {
        let mut sum = 0_u64;
        for (index, bar) in self.bars.iter().enumerate() {
            let BarState {
                pose,
                has_arrived,
                stuck_until,
            } = bar;
            let mut bytes = [0; 32];
            bytes[..4].copy_from_slice(&(index as u32).to_le_bytes());
            bytes[4] = u8::from(*has_arrived);
            bytes[8..12].copy_from_slice(&pose.position.x.to_le_bytes());
            bytes[12..16].copy_from_slice(&pose.position.y.to_le_bytes());
            bytes[16..20].copy_from_slice(&pose.heading_rad.to_le_bytes());
            bytes[24..].copy_from_slice(&stuck_until.0.to_le_bytes());
            sum = sum.wrapping_add(xxh3_64(&bytes));
        }
        for (rank, robot) in self.robots.iter().enumerate() {
            if *robot == Pushing::default() {
                continue;
            }
            let mut bytes = [0; 17];
            bytes[..4].copy_from_slice(&(rank as u32).to_le_bytes());
            bytes[4] = u8::from(robot.slips);
            if let Some(CurrentPush { bar, end, moved_m }) = robot.push {
                bytes[5] = 1 + u8::from(end == BarEnd::Right);
                bytes[6..10].copy_from_slice(&(bar as u32).to_le_bytes());
                bytes[10..14].copy_from_slice(&moved_m.to_le_bytes());
            }
            sum = sum.wrapping_add(xxh3_64(&bytes));
        }
        sum
    }

    /// Returns the function from a share of the push, 0 to 1, to the bar's pose. It returns `None` if the bar would
    /// lean too far.
    fn motion(
        &self,
        push: &Push,
        contact: &Contact,
        floor: &Floor,
    ) -> impl Fn(f32) -> Option<Pose> + use<> {
        let pose = self.bars[push.bar].pose;
        let section = Arc::clone(&self.section);
        let length_m = section.length_m;
        let mut pivot_m = pivot_of(contact.along_m, length_m);
        let hull_m = floor.body().radius_m + section.half_width_m;
        let mut holder = None;
        let reach_m = length_m / 2.0 + hull_m + TOUCH_M;
        for (robot, center) in floor.bodies_near(pose.position, reach_m) {
            let seen = to_bar_frame(&pose, center);
            let touches = seen.x < 0.0 && -seen.x <= hull_m + TOUCH_M;
            let is_beyond = (seen.y - pivot_m) * pivot_m > 0.0 && seen.y.abs() <= length_m / 2.0;
            if robot != push.robot && touches && is_beyond {
                pivot_m = seen.y;
                holder = Some((center, seen.x));
            }
        }
        let way_m = push.remaining_m * contact.share;
        let contact = *contact;
        move |share| {
            let mut to = turned_by(&pose, &contact, pivot_m, way_m * share);
            if let Some((center, apart_m)) = holder {
                // The bar rolls on the body that holds it.
                let (ahead, _) = super::bar::axes(&to);
                to.position += ahead * (to_bar_frame(&to, center).x - apart_m);
            }
            let lead = |pose: &Pose| lead_m(pose, length_m).abs();
            let is_askew = lead(&to) > section.skew_m && lead(&to) > lead(&pose);
            (!is_askew).then_some(to)
        }
    }

    /// Moves a bar by a push. Returns the way that the body can go on, m.
    fn move_bar(
        &mut self,
        push: &Push,
        contact: &Contact,
        floor: &mut Floor,
        happened: &mut StepEvents,
    ) -> Result<f32, Slip> {
        let bar = &self.bars[push.bar];
        if floor.now() < bar.stuck_until {
            return Err(Slip::Fixed);
        }
        let motion = self.motion(push, contact, floor);
        let section = Arc::clone(&self.section);
        let share = floor.free_share(push.bar, |share| {
            motion(share).map(|pose| section.outline(&pose))
        });
        let to = motion(share).filter(|_| share > 0.0).ok_or(Slip::Stopped)?;
        let end_x = |pose: &Pose, which| end(pose, which, section.length_m).x;
        let bar = &mut self.bars[push.bar];
        let moved_m = end_x(&to, contact.end) - end_x(&bar.pose, contact.end);
        bar.pose = to;
        floor.move_bar(push.bar, section.outline(&to), section.sight_m);
        let goal_m = section.bars[push.bar].goal_x_m;
        let is_over = BarEnd::BOTH
            .iter()
            .all(|which| end_x(&to, *which) >= goal_m);
        if is_over && !bar.has_arrived {
            bar.has_arrived = true;
            self.log.arrived(floor.now());
            let event = happened.push_mission_event("arrived", Some(push.robot));
            event.subject = section.name_of(push.bar, None);
        }
        let robot = &mut self.robots[push.robot.index()];
        robot.pushes_now = true;
        let is_same = |push_in_progress: &CurrentPush| {
            push_in_progress.bar == push.bar && push_in_progress.end == contact.end
        };
        if let Some(under_way) = robot
            .push
            .as_mut()
            .filter(|push_in_progress| is_same(push_in_progress))
        {
            under_way.moved_m += moved_m;
        } else {
            self.ends_push(push.robot, happened);
            self.robots[push.robot.index()].push = Some(CurrentPush {
                bar: push.bar,
                end: contact.end,
                moved_m,
            });
        }
        Ok(push.remaining_m * share)
    }

    fn ends_push(&mut self, robot: RobotId, happened: &mut StepEvents) {
        let ended = self.robots[robot.index()].push.take();
        if let Some(CurrentPush { bar, end, moved_m }) = ended {
            self.log.pushed(robot, bar, end, moved_m);
            let event = happened.push_mission_event("pushed", Some(robot));
            event.subject = self.section.name_of(bar, Some(end));
            event.detail = format!("{moved_m:.3} m");
        }
    }

    fn in_sight(&self, robot: RobotId, floor: &Floor) -> Option<BarSeen> {
        let section = &self.section;
        let position = floor.pose(robot).position;
        let near = floor.bars_near(position, section.sight_m);
        let ways = near.map(|(index, bar)| (bar.distance_to_point(position), index));
        let in_sight = ways.filter(|(way_m, _)| *way_m <= section.sight_m);
        let (_, bar) = in_sight.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
        let pose = &self.bars[bar].pose;
        let which = BarEnd::on_side(to_bar_frame(pose, position).y);
        let offset = end(pose, which, section.length_m) - position;
        let ahead = floor.ahead(robot);
        Some(BarSeen {
            bar: bar as u32,
            end: which,
            near_end: Vec2::new(ahead.dot(offset), ahead.perp_dot(offset)),
            lead_m: lead_m(pose, section.length_m),
        })
    }

    /// Returns the means over all bars of the left and the right ends' motion, m, and of the turn, rad.
    fn means(&self) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for (bar, start) in self.bars.iter().zip(&self.section.bars) {
            let ends = BarEnd::BOTH.map(|which| end(&bar.pose, which, self.section.length_m).x);
            for (sum, x_m) in sums.iter_mut().zip(ends) {
                *sum += f64::from(x_m) - f64::from(start.x_m);
            }
            sums[2] += f64::from(bar.pose.heading_rad);
        }
        let count = self.bars.len() as f64;
        // Rounds to a hundredth of a millimeter, for readers.
        sums.map(|sum| (1e5 * sum / count).round() / 1e5)
    }

    fn is_complete(&self) -> bool {
        self.bars.iter().all(|bar| bar.has_arrived)
    }

    fn arrived(&self) -> u64 {
        self.bars.iter().filter(|bar| bar.has_arrived).count() as u64
    }
}

impl MissionWorld for PushWorld {
    fn new(setup: &Setup, floor: &Floor) -> Self {
        let section = Arc::new(PushSection::of(&setup.scenario).clone());
        let bars = section.bars.iter().map(|bar| BarState {
            pose: bar.pose(),
            has_arrived: false,
            stuck_until: SimTime::ZERO,
        });
        let mut new = Self {
            bars: bars.collect(),
            robots: vec![Pushing::default(); floor.robot_count()],
            hash: 0,
            log: Statistics::new(floor.robot_count(), section.stroke_m),
            section,
        };
        new.hash = new.hash();
        new
    }

    fn bars(scenario: &Scenario) -> Vec<Bar> {
        let section = PushSection::of(scenario);
        let bars = section.bars.iter();
        bars.map(|bar| section.outline(&bar.pose())).collect()
    }

    /// Does nothing: robots only drive.
    fn act(&mut self, _: RobotId, _: &Action, _: &mut Floor, _: &mut StepEvents) {}

    fn handle_push(&mut self, push: &Push, floor: &mut Floor, happened: &mut StepEvents) -> f32 {
        let pose = self.bars[push.bar].pose;
        let (center, ahead) = (floor.pose(push.robot).position, floor.ahead(push.robot));
        let Some(contact) = contact(&pose, self.section.length_m, center, ahead) else {
            return 0.0;
        };
        let yielded = contact.and_then(|contact| self.move_bar(push, &contact, floor, happened));
        yielded.unwrap_or_else(|slip| {
            let robot = &mut self.robots[push.robot.index()];
            robot.slips_now = true;
            if !robot.slips {
                let event = happened.push_mission_event("slipped", Some(push.robot));
                event.subject = self.section.name_of(push.bar, None);
                event.reason = slip.name().to_owned();
            }
            0.0
        })
    }

    fn settle(&mut self, _: &mut Floor, happened: &mut StepEvents) {
        for rank in 0..self.robots.len() {
            let robot = &mut self.robots[rank];
            let pushes = std::mem::take(&mut robot.pushes_now);
            robot.slips = std::mem::take(&mut robot.slips_now);
            if !pushes {
                self.ends_push(RobotId(rank as u32), happened);
            }
        }
        self.hash = self.hash();
    }

    fn sense(&self, robot: RobotId, floor: &Floor, sensed: &mut AnyReading) -> Validity {
        let position = floor.pose(robot).position;
        let hull_m = floor.body().radius_m + TOUCH_M;
        let mut near = floor.bars_near(position, hull_m);
        *sensed.value_mut() = SensorReading {
            bar: Some(self.in_sight(robot, floor)),
            touch: Some(near.any(|(_, bar)| bar.distance_to_point(position) <= hull_m)),
        };
        Validity::UntilChange
    }

    /// Applies the fault that holds a bar for a while.
    fn change(
        &mut self,
        fault: &MissionFault,
        floor: &mut Floor,
    ) -> Option<Result<String, ChangeError>> {
        // The order was checked before; only arguments with a default may be missing.
        let number = |key| fault.get(key).unwrap_or(0.0);
        let near = Vec2::new(number("x_m") as f32, number("y_m") as f32);
        let bars = floor.bars().iter().enumerate();
        let nearest = bars.min_by(|(_, a), (_, b)| {
            let way = |bar: &Bar| bar.distance_to_point(near);
            way(a).total_cmp(&way(b))
        });
        let (bar, _) = nearest?;
        let stuck_s = fault.get("stuck_s").unwrap_or(STUCK_S);
        self.bars[bar].stuck_until = floor.now() + SimTime::from_secs_f64(stuck_s);
        self.hash = self.hash();
        let name = self.section.name_of(bar, None);
        Some(Ok(format!("{name} for {stuck_s} s")))
    }

    fn copy_device(&self, device: &str, from: &AnyReading, to: &mut AnyReading) {
        let from = from.value::<SensorReading>();
        let to = to.value_mut::<SensorReading>();
        match device {
            "bar" => to.bar = from.bar,
            "touch" => to.touch = from.touch,
            _ => {}
        }
    }

    fn add_error(&self, device: &str, sensed: &mut AnyReading, error_m: &mut dyn FnMut() -> f32) {
        if device == "bar"
            && let Some(Some(bar)) = &mut sensed.value_mut::<SensorReading>().bar
        {
            bar.near_end += Vec2::new(error_m(), error_m());
            bar.lead_m += error_m();
        }
    }

    fn end(&self, _: SimTime) -> Option<Outcome> {
        self.is_complete().then_some(Outcome::Complete)
    }

    /// An end is due unless it leads by half a stroke.
    fn has_work(&self, task: TaskId, _: RobotId, _: &Floor) -> bool {
        let (bar, which) = data::bar_and_end(task);
        let bar = &self.bars[bar];
        let lead_m = which.sign() * lead_m(&bar.pose, self.section.length_m);
        !bar.has_arrived && lead_m < self.section.stroke_m / 2.0
    }

    fn row(&self, row: &mut Vec<FigureValue>) {
        row.extend(self.means().map(FigureValue::from));
        let arrived = self.arrived();
        row.extend([arrived, self.bars.len() as u64 - arrived].map(FigureValue::from));
    }

    fn state_hash(&self) -> u64 {
        hash_state(self)
    }

    fn figures(&self, figures: &mut TeamFigures) {
        figures.mission.add("arrived", self.arrived());
        self.log.write_figures(self.is_complete(), figures);
    }

    fn add_to_view(&self, _: &Floor, view: &mut View) {
        let section = &self.section;
        for (index, (bar, start)) in self.bars.iter().zip(&section.bars).enumerate() {
            let ends = BarEnd::BOTH.map(|which| end(&bar.pose, which, section.length_m).x);
            let all_m = start.goal_x_m - start.x_m;
            let left_m = start.goal_x_m - ends[0].min(ends[1]);
            let name = section.name_of(index, None);
            view.mark(Mark {
                id: name.clone(),
                outline: section.outline(&bar.pose).into(),
                role: MarkRole::Item,
                work: Work::new(left_m.clamp(0.0, all_m), all_m, "m"),
                // A single bar needs no label.
                label: if self.bars.len() > 1 {
                    name
                } else {
                    String::new()
                },
            });
        }
        for (index, bar) in section.bars.iter().enumerate() {
            let beyond = Vec2::new(0.0, section.length_m / 2.0 + section.skew_m);
            let middle = Vec2::new(bar.goal_x_m, bar.y_m);
            view.mark(Mark {
                id: format!("goal of {}", section.name_of(index, None)),
                outline: MarkOutline::Line {
                    from: middle - beyond,
                    to: middle + beyond,
                },
                role: MarkRole::Goal,
                work: None,
                label: "goal".to_owned(),
            });
        }
        log::show_sensed(view);
    }

    fn check_invariants(&self, floor: &Floor) -> Result<(), String> {
        /// The tolerance for rounding of a length, m.
        const ROUNDING_M: f32 = 1e-4;
        let section = &self.section;
        let radius_m = floor.body().radius_m;
        for (index, (bar, outline)) in self.bars.iter().zip(floor.bars()).enumerate() {
            let name = section.name_of(index, None);
            if section.outline(&bar.pose) != *outline {
                return Err(format!("{name} has another place than on the floor"));
            }
            let length_m = outline.from.distance(outline.to);
            if (length_m - section.length_m).abs() > ROUNDING_M || !bar.pose.position.is_finite() {
                return Err(format!(
                    "{name} has the wrong length of {length_m} m at {:?}",
                    bar.pose
                ));
            }
            if lead_m(&bar.pose, section.length_m).abs() > section.skew_m + ROUNDING_M {
                return Err(format!("{name} leans by more than skew_m"));
            }
            let reach_m = section.length_m / 2.0 + section.half_width_m + radius_m;
            for (robot, center) in floor.bodies_near(bar.pose.position, reach_m) {
                let deep_m = radius_m - outline.distance_to_point(center);
                if deep_m > ROUNDING_M {
                    return Err(format!("{robot} overlaps {name} by {deep_m} m"));
                }
            }
        }
        let is_at_rest = |robot: &Pushing| !robot.pushes_now && !robot.slips_now;
        if self.hash != self.hash() || !self.robots.iter().all(is_at_rest) {
            return Err("the state does not match its hash".to_owned());
        }
        Ok(())
    }
}
