//! ALLIANCE (Parker, IEEE T-RA 14(2), 1998, eqs. 2.1 to 2.7; docs/ALLIANCE.md): the motivational behaviors of one
//! robot.
//!
//! [`Engine`] reads the received messages and the sensory feedback, and returns motivations, state changes with
//! reasons, and heartbeats. It uses no clock, no I/O and no random numbers: equal inputs give equal outputs on every
//! machine.
//!
//! - `history`: *comm_received*, from the first and last receive time per teammate and task.
//! - `teammates`: claims and wishes of teammates, for waiting and arbitration.
//! - `motivation`: the equations 2.3 to 2.7, one function each.
//! - `heartbeats`: the content and schedule of heartbeats.
//! - `steady`: skipping of steps whose result cannot change, for speed.
//!
//! # Decisions beyond the sources
//!
//! docs/ALLIANCE.md §3 explains the [`Switches`](scenario::Switches). The following points are also
//! decided here:
//!
//! - A message counts at the time of the step that receives it, unless a later one of the same sender about the same
//!   task arrived before.
//! - A set that activates suppresses the others from the next step on. In the current step a waiting set stays waiting,
//!   but broadcasts its wish only with `wish_when_suppressed`. A set that reaches θ on an occupied task starts to wait
//!   in that step only with the same switch.
//! - If several factors are 0 at once, the logged reason is the first of: not applicable, suppressed, reset, ψ, λ.
//! - The logged impatience_reset is 1 for an active set that the reset may not switch off.
//! - "Longer than" ψ, λ and the waiting bound ψ + τ is strict, as in eq. 2.6.
//! - A task for n > 1 robots is occupied while n teammates execute it. Of more than n claims the n earliest stay. ψ,
//!   reset and impatience treat a fellow worker as the equations do.
//! - Arbitration compares all claims received so far, not only those of one step. A set that waited out its bound does
//!   not yield to the teammates that it waited for; ψ decides there.
//! - The bound ψ + τ applies to the sum of all waits since the set last hibernated (docs/BOUNDS.md).
//! - An announced wish or claim ends with the sender's next contradicting heartbeat, or the first message of a new
//!   incarnation. A waiting robot executes nothing, an executing robot waits for nothing, an idle robot does neither.
//! - A set that hibernates sends no release while another set of the robot executes or waits for the same task.
//! - Idle heartbeats use the longest 1/ρ of the robot's sets.

mod behavior;
mod engine;
mod heartbeats;
mod history;
mod kind;
mod learned;
mod motivation;
mod params;
mod steady;
mod teammates;
#[cfg(test)]
mod tests;
mod values;

pub use engine::Engine;
pub use kind::kind;
pub use params::Parameters;
pub(super) use params::TowardTeammate;
pub(super) use values::{LearnedTerms, LearnedValues};
