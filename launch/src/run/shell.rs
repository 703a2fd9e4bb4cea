//! Programs of others that a launcher starts by command lines: minds, and what reaches other hosts.

use std::os::unix::process::CommandExt;
use std::process::{Command, ExitCode};

use alliance_proto::os_process::LAUNCHER;
use alliance_proto::tell;
use clap::Args;

/// Become a program of somebody else: it lives and dies as this process, which dies with the launcher.
#[derive(Args, Clone, Debug)]
#[command(hide = true)]
pub struct ShellCommand {
    /// Command line for a shell
    #[arg(long)]
    command: String,
    /// More arguments for that program
    #[arg(last = true)]
    arguments: Vec<String>,
}

impl ShellCommand {
    /// Does not come back, unless there is no shell.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let error = Command::new("/bin/sh")
            .arg("-c")
            .arg(format!("exec {} \"$@\"", self.command))
            .arg("sh")
            .args(&self.arguments)
            // What it starts in turn is no child of the launcher.
            .env_remove(LAUNCHER)
            .exec();
        tell!("alliance shell: /bin/sh: {error}");
        ExitCode::from(3)
    }
}

/// The arguments with which this program becomes that of a command line, which gets these further ones.
#[must_use]
pub fn invocation(command: &str, arguments: &[String]) -> Vec<String> {
    let mut all = vec!["shell".to_owned(), format!("--command={command}")];
    if !arguments.is_empty() {
        all.push("--".to_owned());
        all.extend(arguments.iter().cloned());
    }
    all
}
