//! Command line of an agent, the same for `robot-agent` and `alliance agent`.

use std::process::ExitCode;

use alliance_proto::rendezvous::Rendezvous;
use clap::Args;

use crate::process::{End, live};

/// Be one robot of a live run.
#[derive(Args, Clone, Debug)]
pub struct AgentArgs {
    /// Robot to be, one of the scenario's
    #[arg(long, value_name = "NAME")]
    pub robot: String,
    /// Run to join, by its id; default: the newest live run of this user
    #[arg(long, value_name = "ID")]
    pub run: Option<String>,
}

impl AgentArgs {
    /// Joins the run and lives until it ends. Says on stderr how it ended.
    ///
    /// Exit status 0 when the run was over or somebody asked the agent to end, 3 when it was refused or the bus failed.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        match self.live() {
            Ok(End::RunOver(outcome)) => {
                tracing::info!(outcome = outcome.as_str(), "run over");
                ExitCode::SUCCESS
            }
            Ok(End::Asked) => ExitCode::SUCCESS,
            Ok(End::Superseded) => self.fail("a newer agent has the robot"),
            Ok(End::WorldGone) => self.fail("the world is gone"),
            Err(error) => self.fail(&format!("{error:#}")),
        }
    }

    fn live(&self) -> anyhow::Result<End> {
        let run = Rendezvous::find(self.run.as_deref())?;
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()?;
        Ok(runtime.block_on(live(&self.robot, &run))?)
    }

    fn fail(&self, why: &str) -> ExitCode {
        eprintln!("robot-agent {}: {why}", self.robot);
        ExitCode::from(3)
    }
}

/// Sends the log to stderr: warnings, or what `RUST_LOG` says.
pub fn log_to_stderr() {
    let filter = tracing_subscriber::EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| "warn,robot_agent=info".into());
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .init();
}
