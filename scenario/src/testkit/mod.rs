//! Shared test data of several crates: a mission without dependencies, a fault of each kind, and random values.

mod draw;
mod drill;
mod faults;
mod generated;
mod snapshot;

pub use draw::{drawn, drawn_unbounded};
pub use drill::{DRILL, default_scenario, default_setup, unlike_robots, vocabulary};
pub use faults::{examples_of, one_of_each};
pub use generated::check_generated;
pub use snapshot::{entry, refusals};

/// Returns `value` after encoding it as the bus does and decoding it again.
#[cfg(test)]
pub(crate) fn bincode_round_trip<T: serde::Serialize + serde::de::DeserializeOwned>(
    value: &T,
) -> T {
    let format = bincode::config::standard();
    let bytes = bincode::serde::encode_to_vec(value, format).unwrap();
    bincode::serde::decode_from_slice(&bytes, format).unwrap().0
}
