//! Tests that cover several files of this folder.

mod allocators;
mod bad_parameters;
mod bad_scenarios;
mod control_page;
mod precedence;
mod reference;
mod round_trip;
mod scenarios;
