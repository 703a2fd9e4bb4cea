//! The `alliance` command, for the tests of this package.

use std::process::ExitCode;

fn main() -> ExitCode {
    launch::main()
}
