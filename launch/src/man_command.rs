//! `alliance man`: manual pages of all commands.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::{Args, Command};
use terminal::stderr_line;

/// Write manual pages of all commands.
///
/// For `man alliance-run`: alliance man ~/.local/share/man/man1
#[derive(Args, Clone, Debug)]
pub struct ManCommand {
    /// Folder for the pages; created if it is missing
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

impl ManCommand {
    /// Writes the pages of the full `command`. Exit status 0, or 3 if they cannot be written.
    #[must_use]
    pub fn run(&self, command: Command) -> ExitCode {
        let written = fs::create_dir_all(&self.folder)
            .and_then(|()| clap_mangen::generate_to(command, &self.folder))
            .with_context(|| self.folder.display().to_string());
        match written {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                stderr_line!("alliance man: {error:#}");
                ExitCode::from(3)
            }
        }
    }
}
