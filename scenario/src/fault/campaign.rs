//! Random faults: their rate, duration and kinds.

use serde::{Deserialize, Serialize};

/// Random faults of every robot that is present from the start. The times between faults and the repair times are
/// exponentially distributed. Each robot has its own random stream.
///
/// The default time between failures is that of mobile robots in use, about 8 h, divided by 240, so that a mission of
/// ten minutes has some faults. Sources: Carlson and Murphy, Reliability Analysis of Mobile Robots, ICRA 2003; How UGVs
/// Physically Fail in the Field, IEEE Transactions on Robotics 21(3), 2005 (6 to 20 h in ten studies). The default
/// repair time is our choice: in the field, robots were out of order about half of the time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RandomFaults {
    /// The mean working time from a repair to the next failure, s of simulated time.
    pub mtbf_s: f64,
    /// The mean time to repair, s of simulated time.
    pub mttr_s: f64,
    /// The relative frequencies of the kinds of faults.
    pub mix: FaultMix,
}

impl RandomFaults {
    /// The prefix of the ids of random faults. A number follows.
    pub const ID_PREFIX: &'static str = "random-";
}

impl Default for RandomFaults {
    fn default() -> Self {
        Self {
            mtbf_s: 120.0,
            mttr_s: 30.0,
            mix: FaultMix::default(),
        }
    }
}

/// Relative frequencies of the kinds of random faults; 0 excludes a kind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FaultMix {
    /// A killed process, which the repair restarts.
    pub kill: f64,
    /// A stopped process, which the repair continues.
    pub pause: f64,
    /// Message loss, message delay or isolation of a robot, in both directions, as two faults.
    pub link: f64,
    /// A sensor that is dead, stuck, noisy or biased, or that drops out.
    pub sensor: f64,
    /// A drive that is slow, turns to one side, has one wheel or is dead, or a failed gripper.
    pub actuator: f64,
    /// A robot without power.
    pub power: f64,
    /// A robot that broadcasts its activity but does not act.
    pub babble: f64,
}

impl Default for FaultMix {
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
