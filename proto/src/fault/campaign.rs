//! Random faults: how often, how long, of which kinds.

use serde::{Deserialize, Serialize};

/// Random faults of every robot that is there from the start: times between them and repair times are exponentially
/// distributed, from a random stream of each robot's own.
///
/// The default time between failures is what is reported of mobile robots in use, about 8 h (Carlson and Murphy, Reliability
/// Analysis of Mobile Robots, ICRA 2003; 6 to 20 h in their survey of ten studies, How UGVs Physically Fail in the Field, IEEE
/// Transactions on Robotics 21(3), 2005), made 240 times shorter so that a mission of ten minutes sees some. The default
/// repair time is our choice: at the field's, robots were out of order about half of the time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Campaign {
    /// Mean time that a robot works before it fails, s of simulated time, counted from its last repair.
    pub mtbf_s: f64,
    /// Mean time to repair, s of simulated time.
    pub mttr_s: f64,
    /// How often each kind comes, relative to the others.
    pub mix: Mix,
}

impl Campaign {
    /// How the ids of random faults begin; a number follows.
    pub const ID_PREFIX: &'static str = "random-";
}

impl Default for Campaign {
    fn default() -> Self {
        Self {
            mtbf_s: 120.0,
            mttr_s: 30.0,
            mix: Mix::default(),
        }
    }
}

/// Relative frequencies of the kinds of random faults; 0 leaves a kind out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Mix {
    /// The process is killed, and restarted when repaired.
    pub kill: f64,
    /// The process is stopped, and continued when repaired.
    pub pause: f64,
    /// The robot's radio loses messages, delays them, or is cut off; in both directions, as two faults.
    pub link: f64,
    /// A sensor is dead, stuck, noisy, biased or drops out.
    pub sensor: f64,
    /// The drive is slow, pulls to one side, has one wheel or is dead, or the gripper fails.
    pub actuator: f64,
    /// The power is gone.
    pub power: f64,
    /// The robot babbles.
    pub babble: f64,
}

impl Default for Mix {
    fn default() -> Self {
        Self {
            kill: 1.0,
            pause: 1.0,
            link: 2.0,
            sensor: 2.0,
            actuator: 2.0,
            power: 0.5,
            babble: 0.5,
        }
    }
}
