//! `alliance completions`: what a shell needs to complete the command line.

use std::process::ExitCode;

use alliance_proto::terminal;
use clap::{Args, Command};
use clap_complete::{Shell, generate};

/// Print what a shell needs to complete the command line.
///
/// For bash: alliance completions bash > ~/.local/share/bash-completion/completions/alliance
#[derive(Args, Clone, Debug)]
pub struct CompletionsCommand {
    /// Which shell
    shell: Shell,
}

impl CompletionsCommand {
    /// Exit status 0, or 3 when it cannot be printed. `command` is the whole one.
    #[must_use]
    pub fn run(&self, mut command: Command) -> ExitCode {
        let mut script = Vec::new();
        let name = command.get_name().to_owned();
        generate(self.shell, &mut command, name, &mut script);
        let script = String::from_utf8_lossy(&script);
        terminal::answer("alliance completions", script, ExitCode::SUCCESS)
    }
}
