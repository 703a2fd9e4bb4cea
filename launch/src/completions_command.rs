//! `alliance completions`: scripts for command line completion.

use std::process::ExitCode;

use clap::{Args, Command};
use clap_complete::{Shell, generate};
use terminal;

/// Print a completion script for a shell.
///
/// For bash: alliance completions bash > ~/.local/share/bash-completion/completions/alliance
#[derive(Args, Clone, Debug)]
pub struct CompletionsCommand {
    /// Name of the shell
    shell: Shell,
}

impl CompletionsCommand {
    /// Prints the script for the full `command`. Exit status 0, or 3 if it cannot be printed.
    #[must_use]
    pub fn run(&self, mut command: Command) -> ExitCode {
        let mut script = Vec::new();
        let name = command.get_name().to_owned();
        generate(self.shell, &mut command, name, &mut script);
        let script = String::from_utf8_lossy(&script);
        terminal::print_result("alliance completions", script, ExitCode::SUCCESS)
    }
}
