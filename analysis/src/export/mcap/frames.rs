//! The positions of the robots: one frame per robot, relative to the world's frame.

use foxglove::messages::{FrameTransform, FrameTransforms};
use proto::control::AgentState;
use proto::view::View;
use run_log::{PoseRow, RunLog};
use scenario::Setup;
use scenario::time::SimTime;

use super::merge::Stream;
use super::recording::{Channel, Message, Recording};
use super::well_known::{WORLD, stamp, turned, vector};

/// The topic `/tf` with the robots' frames.
pub struct FrameTopic {
    channel: Channel<FrameTransforms>,
    /// Robot names, by rank.
    robots: Vec<String>,
}

impl FrameTopic {
    /// Creates the topic `/tf` in a recording.
    pub fn new(recording: &mut Recording<'_>, setup: &Setup) -> anyhow::Result<Self> {
        let robots = setup.scenario.robots.iter();
        Ok(Self {
            channel: recording.channel("/tf")?,
            robots: robots.map(|robot| robot.name.clone()).collect(),
        })
    }

    /// Returns the poses of all present robots for each tick, from poses.csv, and their final poses at the end.
    pub fn stream<'s>(&'s self, log: &'s RunLog, end: &View) -> Stream<'s> {
        let mut rows = log.each_row::<PoseRow>().peekable();
        let ticks = std::iter::from_fn(move || {
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
        });
        let last = self.robots.iter().zip(&end.robots);
        let last = last
            .filter(|(_, robot)| robot.state != AgentState::Absent)
            .map(|(name, robot)| {
                let pose = robot.pose;
                transform(end.now, name, pose.position.into(), pose.heading_rad)
            })
            .collect();
        Box::new(ticks.chain([Ok(self.message(end.now, last))]))
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
