//! `alliance generate`: completion scripts and manual pages, from the same definitions as the help.

pub(crate) mod completions;
pub(crate) mod man;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Command, Subcommand};
use clap_complete::Shell;
use terminal::fail;

/// Generate completion scripts and manual pages
#[derive(Args, Clone, Debug)]
#[command(arg_required_else_help = true)]
pub struct GenerateCommand {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand, Clone, Debug)]
enum What {
    /// Print a completion script for a shell
    Completions {
        /// Name of the shell
        shell: Shell,
    },
    /// Write a manual page for each command
    Man {
        /// Folder for the pages; created if it is missing
        #[arg(value_name = "DIR")]
        folder: PathBuf,
    },
}

impl GenerateCommand {
    /// Generates the output for the complete `command`. Exit status 0, or 3 if it cannot be written.
    #[must_use]
    pub fn run(&self, command: Command) -> ExitCode {
        match &self.what {
            What::Completions { shell } => {
                let script = completions::script(*shell, command);
                terminal::print_result("alliance generate completions", script, ExitCode::SUCCESS)
            }
            What::Man { folder } => match man::write(command, folder) {
                Ok(()) => ExitCode::SUCCESS,
                Err(error) => fail("alliance generate man", &error, 3),
            },
        }
    }
}
