//! The executable of the `alliance` command.

use std::process::ExitCode;

use launch::Registry;

fn main() -> ExitCode {
    launch::main(Registry::built_in())
}
