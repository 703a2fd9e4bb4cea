//! Tests across the files of this folder.

mod bad_parameters;
mod bad_scenarios;
mod precedence;
mod reference;
mod round_trip;
