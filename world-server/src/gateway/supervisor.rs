//! The world's side of the gateway: starts it, restarts it if it ends before the run, and reads the number of refused requests.

use std::io;
use std::process::Stdio;
use std::time::Duration;

use cluster::os_process::LAUNCHER;
use cluster::process_log::child_variables;
use cluster::rendezvous::Rendezvous;
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader, Lines};
use tokio::process::{Child, ChildStdin, ChildStdout, Command};
use tokio::sync::oneshot;
use tokio::task::JoinHandle;
use tokio::time::{sleep, timeout};

use crate::error::WorldError;

pub const ARGUMENT: &str = "--gateway";

const REST: Duration = Duration::from_secs(1);
/// The maximum time for the gateway to return the number of refused requests.
const PATIENCE: Duration = Duration::from_secs(2);

struct Process {
    /// Ends the gateway when it is closed, also by the end of the world.
    stdin: ChildStdin,
    stdout: Lines<BufReader<ChildStdout>>,
    child: Child,
}

impl Process {
    /// Starts the own program again as a gateway.
    fn start() -> io::Result<Self> {
        let mut command = Command::new(std::env::current_exe()?);
        // The command before the options: `alliance cluster world`, or `world-server` without further words.
        const WORDS: [&str; 2] = ["cluster", "world"];
        if std::env::args().skip(1).take(2).eq(WORDS) {
            command.args(WORDS);
        }
        let mut child = command
            .arg(ARGUMENT)
            .envs(child_variables())
            // The gateway ends with its standard input instead.
            .env_remove(LAUNCHER)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            // Ctrl-C goes to the world only.
            .process_group(0)
            .spawn()?;
        let pipes = child.stdin.take().zip(child.stdout.take());
        let (stdin, stdout) = pipes.ok_or(io::ErrorKind::BrokenPipe)?;
        Ok(Self {
            stdin,
            stdout: BufReader::new(stdout).lines(),
            child,
        })
    }

    /// Sends the run to the gateway. Returns the address where the gateway listens.
    async fn listen(&mut self, run: &Rendezvous) -> io::Result<String> {
        let line = serde_json::to_string(run)? + "\n";
        self.stdin.write_all(line.as_bytes()).await?;
        let line = self.stdout.next_line().await?;
        line.ok_or_else(|| io::Error::other("the gateway for operators did not start"))
    }
}

pub struct StartedGateway(Process);

impl StartedGateway {
    /// Starts the gateway's process.
    pub fn start() -> io::Result<Self> {
        Process::start().map(Self)
    }

    /// Opens the gateway for operators and writes its address to the rendezvous.
    pub async fn open(self, run: &mut Rendezvous) -> Result<Gateway, WorldError> {
        let mut process = self.0;
        run.endpoint = process.listen(run).await?;
        let (close, closing) = oneshot::channel();
        let kept = tokio::spawn(keep(run.clone(), process, closing));
        Ok(Gateway { close, kept })
    }
}

pub struct Gateway {
    close: oneshot::Sender<()>,
    kept: JoinHandle<u64>,
}

impl Gateway {
    /// Closes the gateway. Returns the number of requests that it refused; the counts of crashed gateways are lost.
    pub async fn close(self) -> u64 {
        // The receiver is dropped only if the gateway could not be restarted.
        let _ = self.close.send(());
        let refused = timeout(PATIENCE, self.kept).await;
        refused.ok().and_then(Result::ok).unwrap_or(0)
    }
}

/// Restarts the gateway after each crash until the run is over.
async fn keep(run: Rendezvous, mut process: Process, mut closing: oneshot::Receiver<()>) -> u64 {
    loop {
        tokio::select! {
            // The gateway writes nothing until it ends.
            _ = process.stdout.next_line() => {}
            _ = &mut closing => {
                drop(process.stdin);
                let count = process.stdout.next_line().await.ok().flatten();
                return count.and_then(|count| count.parse().ok()).unwrap_or(0);
            }
        }
        let _ = process.child.wait().await;
        tracing::warn!("the gateway for operators has ended; restarting it");
        loop {
            tokio::select! {
                () = sleep(REST) => {}
                _ = &mut closing => return 0,
            }
            match Process::start() {
                Ok(started) => process = started,
                Err(error) => {
                    tracing::warn!(%error, "cannot start the gateway for operators");
                    continue;
                }
            }
            match process.listen(&run).await {
                Ok(_) => break,
                Err(error) => tracing::warn!(%error, "cannot start the gateway for operators"),
            }
        }
    }
}
