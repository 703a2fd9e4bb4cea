//! The world's end of the gateway: starts it, starts it again should it end before the run, and asks at the end what it refused.

use std::io;
use std::process::Stdio;
use std::time::Duration;

use alliance_proto::os_process::LAUNCHER;
use alliance_proto::rendezvous::Rendezvous;
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader, Lines};
use tokio::process::{Child, ChildStdin, ChildStdout, Command};
use tokio::sync::oneshot;
use tokio::task::JoinHandle;
use tokio::time::{sleep, timeout};

use crate::error::WorldError;

/// The argument that makes a world's program a gateway.
pub const ARGUMENT: &str = "--gateway";

/// Until it is started again.
const REST: Duration = Duration::from_secs(1);
/// How long it may take to say what it refused.
const PATIENCE: Duration = Duration::from_secs(2);

/// A gateway's process.
struct Process {
    /// Ends it where it is dropped, as the world's own end does.
    stdin: ChildStdin,
    says: Lines<BufReader<ChildStdout>>,
    child: Child,
}

impl Process {
    /// Starts this program again, as a gateway.
    fn start() -> io::Result<Self> {
        let mut command = Command::new(std::env::current_exe()?);
        // `alliance world` or `world-server`.
        command.args(std::env::args().nth(1).filter(|part| part == "world"));
        let mut child = command
            .arg(ARGUMENT)
            // It ends with its standard input.
            .env_remove(LAUNCHER)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            // Ctrl-C is for the world.
            .process_group(0)
            .spawn()?;
        let pipes = child.stdin.take().zip(child.stdout.take());
        let (stdin, stdout) = pipes.ok_or(io::ErrorKind::BrokenPipe)?;
        Ok(Self {
            stdin,
            says: BufReader::new(stdout).lines(),
            child,
        })
    }

    /// Tells it the run; gives where it listens.
    async fn listen(&mut self, run: &Rendezvous) -> io::Result<String> {
        let line = serde_json::to_string(run)? + "\n";
        self.stdin.write_all(line.as_bytes()).await?;
        let said = self.says.next_line().await?;
        said.ok_or_else(|| io::Error::other("the gateway for operators does not start"))
    }
}

/// A gateway that has not been told its run.
pub struct Waiting(Process);

impl Waiting {
    /// Starts it.
    ///
    /// # Errors
    /// When there can be no such process.
    pub fn start() -> io::Result<Self> {
        Process::start().map(Self)
    }

    /// It opens for operators: the rendezvous says where.
    ///
    /// # Errors
    /// When it fails.
    pub async fn open(self, run: &mut Rendezvous) -> Result<Gateway, WorldError> {
        let mut process = self.0;
        run.endpoint = process.listen(run).await?;
        let (close, closing) = oneshot::channel();
        let kept = tokio::spawn(keep(run.clone(), process, closing));
        Ok(Gateway { close, kept })
    }
}

/// The gateway of a run.
pub struct Gateway {
    close: oneshot::Sender<()>,
    kept: JoinHandle<u64>,
}

impl Gateway {
    /// Ends it; says how many requests it refused. One that was cut off took its count with it.
    pub async fn close(self) -> u64 {
        // Gone only where it could not be started again.
        let _ = self.close.send(());
        let said = timeout(PATIENCE, self.kept).await;
        said.ok().and_then(Result::ok).unwrap_or(0)
    }
}

/// Keeps a gateway going until the run is over.
async fn keep(run: Rendezvous, mut process: Process, mut closing: oneshot::Receiver<()>) -> u64 {
    loop {
        tokio::select! {
            // It says nothing until it ends.
            _ = process.says.next_line() => {}
            _ = &mut closing => {
                drop(process.stdin);
                let count = process.says.next_line().await.ok().flatten();
                return count.and_then(|count| count.parse().ok()).unwrap_or(0);
            }
        }
        let _ = process.child.wait().await;
        tracing::warn!("the gateway for operators has ended; another one starts");
        loop {
            tokio::select! {
                () = sleep(REST) => {}
                _ = &mut closing => return 0,
            }
            match Process::start() {
                Ok(started) => process = started,
                Err(error) => {
                    tracing::warn!(%error, "no gateway for operators");
                    continue;
                }
            }
            match process.listen(&run).await {
                Ok(_) => break,
                Err(error) => tracing::warn!(%error, "no gateway for operators"),
            }
        }
    }
}
