//! Messages of ROS 2 for programs without ROS.
//!
//! Each message type is declared once, in [`messages`]. These forms are derived from the declaration:
//!
//! - [`encode`] and [`decode`]: the bytes of a message, in CDR;
//! - [`definition`]: the text of the type, as in `.msg` files;
//! - [`type_hash`]: the RIHS01 hash, by which ROS 2 compares types.
//!
//! [`names`] converts names to those that ROS accepts, and [`Qos`] contains the quality of service of a topic.
//! [`incoming_odometry`] decodes poses of other nodes, and [`incoming_scan`] their scans. [`rmw_zenoh`] contains the keys
//! under which ROS nodes find messages and [`services`] on zenoh. The crate does no I/O.

mod cdr;
mod definition;
mod description;
mod field;
mod hash;
pub mod incoming_odometry;
pub mod incoming_scan;
mod message;
pub mod messages;
pub mod names;
mod qos;
mod read;
pub mod rmw_zenoh;
pub mod services;

pub use cdr::CdrWriter;
pub use definition::definition;
pub use description::{BaseType, Constant, FieldSpec, FieldType, MessageType, Shape};
pub use field::{Byte, Field};
pub use hash::type_hash;
pub use message::{Message, decode, encode};
pub use qos::Qos;
pub use read::{CdrReader, ReadError};
