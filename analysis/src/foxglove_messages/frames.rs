//! The positions of the robots: one frame per robot, relative to the world's frame.

use foxglove::messages::{FrameTransform, FrameTransforms};
use proto::control::AgentState;
use proto::view::View;
use run_log::PoseRow;
use scenario::Setup;
use scenario::time::SimTime;

use super::merge::Stream;
use super::topics::{Channel, Message, Topics};
use super::well_known::{WORLD, stamp, turned, vector};
use crate::live::RowSource;

/// The topic `/tf` with the robots' frames.
pub struct FrameTopic {
    channel: Channel<FrameTransforms>,
    /// Robot names, by rank.
    robots: Vec<String>,
}

impl FrameTopic {
    /// Adds the topic `/tf` to a destination.
    pub fn new(to: &mut dyn Topics, setup: &Setup) -> anyhow::Result<Self> {
        let robots = setup.scenario.robots.iter();
        Ok(Self {
            channel: to.channel("/tf")?,
            robots: robots.map(|robot| robot.name.clone()).collect(),
        })
    }

    /// Returns the poses of all present robots for each tick, from poses.csv.
    pub fn stream<'s>(&'s self, rows: &'s impl RowSource) -> Stream<'s> {
        let mut rows = rows.each_row::<PoseRow>().peekable();
        Box::new(std::iter::from_fn(move || {
            let first = rows.next()?;
            let time = first.as_ref().map_or(SimTime::ZERO, |row| row.t_ms);
            let same = |row: &Result<PoseRow, _>| row.as_ref().is_ok_and(|row| row.t_ms == time);
            let rest = std::iter::from_fn(|| rows.next_if(same));
            let frames: Result<_, _> = std::iter::once(first)
                .chain(rest)
                .map(|row| row.map(|row| frame(&row)))
                .collect();
            Some(match frames {
                Ok(frames) => Ok(self.message(time, frames)),
                Err(error) => Err(error.into()),
            })
        }))
    }

    /// Returns the final poses of all present robots, which no row contains.
    pub fn last(&self, end: &View) -> Message {
        let last = self.robots.iter().zip(&end.robots);
        let last = last
            .filter(|(_, robot)| robot.state != AgentState::Absent)
            .map(|(name, robot)| {
                let pose = robot.pose;
                transform(end.now, name, pose.position.into(), pose.heading_rad)
            })
            .collect();
        self.message(end.now, last)
    }

    fn message(&self, time: SimTime, transforms: Vec<FrameTransform>) -> Message {
        self.channel.message(time, &FrameTransforms { transforms })
    }
}

fn frame(row: &PoseRow) -> FrameTransform {
    transform(row.t_ms, &row.robot, (row.x_m, row.y_m), row.heading_rad)
}

/// Returns a robot's frame: origin at the center of the body, x ahead.
fn transform(time: SimTime, robot: &str, at: (f32, f32), heading_rad: f32) -> FrameTransform {
    FrameTransform {
        timestamp: Some(stamp(time)),
        parent_frame_id: WORLD.to_owned(),
        child_frame_id: robot.to_owned(),
        translation: Some(vector(at.0, at.1, 0.0)),
        rotation: Some(turned(heading_rad)),
    }
}
