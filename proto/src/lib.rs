//! The bus protocol: the messages between the world server and the robot agents, their keys and bytes.
//!
//! - [`tick`]: the lockstep protocol, with [`TickMessage`](tick::TickMessage) to an agent and [`Report`](tick::Report)
//!   back. They contain [`readings`] and [`telemetry`]. [`join`]: the handshake before the first tick.
//! - [`mission`]: sensor readings and actions of one mission. [`team`]: messages between robots. [`allocation`]:
//!   messages of their allocators.
//! - [`link`]: the effect of faults on messages. [`control`]: commands to a run.
//! - [`process`], [`membership`]: orders for the agents' processes, and the robots of a host. [`view`], [`event`]: data for observers.
//! - [`keys`], [`codec`]: key expressions and encoding. [`secret`], [`identity`]: authentication of messages.

pub mod allocation;
pub mod codec;
pub mod control;
pub mod event;
pub mod identity;
pub mod join;
pub mod keys;
pub mod link;
pub mod membership;
pub mod mission;
pub mod process;
pub mod program_build;
pub mod readings;
pub mod secret;
pub mod team;
pub mod telemetry;
pub mod tick;
pub mod view;
