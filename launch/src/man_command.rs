//! `alliance man`: manual pages of the command and of each of its parts.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use alliance_proto::tell;
use anyhow::Context;
use clap::{Args, Command};

/// Write manual pages of the command and of each of its parts.
///
/// For `man alliance-run`: alliance man ~/.local/share/man/man1
#[derive(Args, Clone, Debug)]
pub struct ManCommand {
    /// Folder for the pages; it is made if it is missing
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

impl ManCommand {
    /// Exit status 0, or 3 when the pages cannot be written. `command` is the whole one.
    #[must_use]
    pub fn run(&self, command: Command) -> ExitCode {
        let written = fs::create_dir_all(&self.folder)
            .and_then(|()| clap_mangen::generate_to(command, &self.folder))
            .with_context(|| self.folder.display().to_string());
        match written {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                tell!("alliance man: {error:#}");
                ExitCode::from(3)
            }
        }
    }
}
