//! The executable of the `alliance` command.

use std::process::ExitCode;

use launch::Registry;
use mimalloc::MiMalloc;

#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

fn main() -> ExitCode {
    launch::main(Registry::built_in())
}
