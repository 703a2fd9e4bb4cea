//! `alliance shell`: external programs of a run, such as controllers and the commands that start other hosts.

use std::os::unix::process::CommandExt;
use std::process::{Command, ExitCode};

use clap::Args;
use cluster::os_process::LAUNCHER;
use terminal::stderr_line;

/// Replace this process with an external program; it dies with the launcher.
#[derive(Args, Clone, Debug)]
#[command(hide = true)]
pub struct ShellCommand {
    /// Command line for a shell
    #[arg(long)]
    command: String,
    /// Additional arguments for the program
    #[arg(last = true)]
    arguments: Vec<String>,
}

impl ShellCommand {
    /// Replaces this process. Returns only if the shell cannot be started.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let error = Command::new("/bin/sh")
            .arg("-c")
            .arg(format!("exec {} \"$@\"", self.command))
            .arg("sh")
            .args(&self.arguments)
            // Processes that the program starts are not children of the launcher.
            .env_remove(LAUNCHER)
            .exec();
        stderr_line!("alliance shell: /bin/sh: {error}");
        ExitCode::from(3)
    }
}

/// Returns the arguments with which this program runs a command line with additional `arguments`.
#[must_use]
pub fn invocation(command: &str, arguments: &[String]) -> Vec<String> {
    let mut all = vec!["shell".to_owned(), format!("--command={command}")];
    if !arguments.is_empty() {
        all.push("--".to_owned());
        all.extend(arguments.iter().cloned());
    }
    all
}
