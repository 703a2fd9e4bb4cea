//! The task allocation algorithms, one folder or file each. They implement [`crate::allocator`] and do not depend on a
//! mission.
//!
//! - [`alliance`]: motivational behaviors (Parker 1998).
//! - [`lalliance`]: motivational behaviors with learned times (Parker 1995).
//! - [`ble`]: broadcast of local eligibility (Werger and Matarić 2000).
//! - [`murdoch`]: auctions and contracts (Gerkey and Matarić 2002).
//! - [`cbba`]: consensus-based auctions: CBAA, CBBA and the asynchronous ACBBA (Choi, Brunet, How 2009; Johnson 2010).
//! - [`grape`]: Nash-stable coalitions (Jang, Shin, Tsourdos 2018).
//! - [`threshold`]: stimuli and response thresholds (Theraulaz, Bonabeau, Deneubourg 1998).
//! - [`nearest`], [`first_come`], [`random`], [`static_assignment`]: simple baselines.
//! - [`oracle`]: the best assignment in each step, computed from the ground truth.

pub mod alliance;
pub mod ble;
pub mod cbba;
pub mod first_come;
pub mod grape;
pub mod lalliance;
pub mod murdoch;
pub mod nearest;
pub mod oracle;
pub mod random;
pub mod static_assignment;
#[cfg(test)]
mod team;
pub mod threshold;
