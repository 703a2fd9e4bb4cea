//! The robots with news younger than τ, as one robot stores them.

use scenario::ids::RobotId;
use scenario::time::SimTime;

use crate::by_rank::ByRank;

/// The known robots, by rank, with the send time of the latest news of each and data about its messages.
#[derive(Clone, Debug)]
pub struct Known<T>(ByRank<(SimTime, T)>);

impl<T> Default for Known<T> {
    fn default() -> Self {
        Self(ByRank::default())
    }
}

impl<T: Default> Known<T> {
    /// Records news of a robot. Returns whether the robot was not known before.
    pub fn note(&mut self, robot: RobotId, sent: SimTime) -> bool {
        match self.0.place(robot) {
            Ok(at) => {
                let known = self.0.at_mut(at);
                known.0 = known.0.max(sent);
                false
            }
            Err(at) => {
                self.0.insert(at, robot, (sent, T::default()));
                true
            }
        }
    }

    /// Returns the send time of the latest news of a robot.
    pub fn sent(&self, robot: RobotId) -> Option<SimTime> {
        Some(self.0.at(self.0.place(robot).ok()?).0)
    }

    pub fn get_mut(&mut self, robot: RobotId) -> Option<&mut T> {
        let at = self.0.place(robot).ok()?;
        Some(&mut self.0.at_mut(at).1)
    }

    /// Returns the robots and the send times of their latest news.
    pub fn iter(&self) -> impl Iterator<Item = (RobotId, SimTime)> {
        self.0.iter().map(|(robot, known)| (robot, known.0))
    }

    /// Returns the robots and their data.
    pub fn iter_all(&self) -> impl Iterator<Item = (RobotId, &T)> {
        self.0.iter().map(|(robot, known)| (robot, &known.1))
    }

    /// Removes a robot that has been silent for `tau`, and returns it.
    pub fn remove_silent(&mut self, now: SimTime, tau: SimTime) -> Option<RobotId> {
        let mut known = self.0.iter();
        let at = known.position(|(_, known)| now.since(known.0) >= tau)?;
        drop(known);
        Some(self.0.remove(at))
    }
}
