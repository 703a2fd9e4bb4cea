//! A client for the control topic of a live run.

use std::process::ExitCode;
use std::time::Duration;

use anyhow::{anyhow, bail};
use clap::Args;
use cluster::os_process::OsProcess;
use cluster::rendezvous::{self, ConnectionRole, Rendezvous};
use proto::control::wire::{ControlTopic, Format};
use proto::control::{ControlCommand, Reply, Request};
use proto::secret::random;
use serde::Serialize;
use terminal::{fail, stderr_line};
use tokio::time::timeout;
use zenoh::query::{ConsolidationMode, QueryTarget};

use crate::observer::Observer;
use crate::runtime;

const PATIENCE: Duration = Duration::from_secs(10);

const CLOSE_DEADLINE: Duration = Duration::from_millis(200);

#[derive(Args, Clone, Debug)]
pub struct ControlArgs {
    /// Id of the run [default: the only live run; the newest for status and list]
    #[arg(long, value_name = "ID", global = true, help_heading = "Run")]
    run: Option<String>,
    /// Print the reply as JSON on stdout
    #[arg(long, global = true, help_heading = "Run")]
    json: bool,
}

impl ControlArgs {
    /// Returns the id of the selected run, and these options fixed to it, so that a later run is not selected. `None` if no run is live.
    pub fn fixed_to_run(&self) -> Option<(String, Self)> {
        let run = Rendezvous::find(self.run.as_deref()).ok()?.run;
        let control = Self {
            run: Some(run.clone()),
            ..self.clone()
        };
        Some((run, control))
    }

    /// Sends a command and prints the reply: as text by `words` on stderr, or as JSON on stdout. `name` is the name of the subcommand.
    ///
    /// Exit status 0, 2 if the world refuses or several runs are live, 3 if no run is live or none answers.
    #[must_use]
    pub fn send_command(
        &self,
        name: &str,
        command: ControlCommand,
        words: impl FnOnce(&Reply) -> String,
    ) -> ExitCode {
        let failed =
            |error: anyhow::Error, status| fail(&format!("alliance {name}"), &error, status);
        let live = match rendezvous::live() {
            Ok(live) => live,
            Err(error) => return failed(error.into(), 3),
        };
        let changes = !matches!(command, ControlCommand::Status | ControlCommand::List);
        if changes && self.run.is_none() && live.len() > 1 {
            let runs: Vec<&str> = live.iter().map(|run| run.run.as_str()).collect();
            let which = anyhow!(
                "{} runs are live; choose one with --run {}",
                runs.len(),
                runs.join(" or --run ")
            );
            return failed(which, 2);
        }
        let (run, reply) = match self.reply_to(command) {
            Ok(answered) => answered,
            Err(error) => return failed(error, 3),
        };
        if self.json
            && let Err(error) = print(&reply)
        {
            return fail(&format!("alliance {name}"), &error, 3);
        }
        if let Reply::Refused(why) = &reply {
            stderr_line!("alliance {name}: {why}");
            return ExitCode::from(2);
        }
        if !self.json {
            let words = words(&reply);
            // The message of a command that changes a run contains its id.
            let suffix = if changes {
                format!(" [run {run}]")
            } else {
                String::new()
            };
            stderr_line!("{words}{suffix}");
        }
        ExitCode::SUCCESS
    }

    /// Sends a command and returns the id of the run with its reply.
    fn reply_to(&self, command: ControlCommand) -> anyhow::Result<(String, Reply)> {
        let run = Rendezvous::find(self.run.as_deref())?;
        let id = run.run.clone();
        if OsProcess::find(run.pid).is_some_and(|world| world.is_stopped) {
            let pid = run.pid;
            bail!(
                "run '{id}' stands still: its world (process {pid}) is stopped; `kill -CONT {pid}` resumes it"
            );
        }
        let runtime = runtime::start_runtime()?;
        Ok((id, runtime.block_on(send_command(run, command))?))
    }
}

/// Connects to a run, sends a command and returns the reply.
///
/// # Errors
/// If the world cannot be reached, does not answer or cannot read the request.
pub async fn send_command(run: Rendezvous, command: ControlCommand) -> anyhow::Result<Reply> {
    let observer = Observer::join(run, ConnectionRole::Operator).await?;
    let reply = query(&observer, command).await;
    // Closing may hang, so its time is limited.
    let _ = timeout(CLOSE_DEADLINE, observer.session.close()).await;
    reply
}

/// Sends a command and returns the first reply with the seal of the run for this request. Replies with other seals are ignored.
///
/// # Errors
/// If the world does not answer or cannot read the request.
pub async fn query(observer: &Observer, command: ControlCommand) -> anyhow::Result<Reply> {
    const FORM: Format = Format::Bincode;
    let run = &observer.run;
    let request = Request {
        nonce: format!("{:032x}", random()?),
        command,
    };
    let wire = ControlTopic::new(&observer.keys, observer.secret.clone());
    let written = wire.write_request(FORM, &request)?;
    let replies = observer
        .session
        .get(wire.key())
        .payload(written.payload)
        .encoding(FORM.encoding())
        .attachment(written.attachment)
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(PATIENCE)
        .await
        .map_err(anyhow::Error::from_boxed)?;
    let mut complaint = None;
    while let Ok(reply) = replies.recv_async().await {
        match reply.result() {
            Ok(sample) => {
                let attachment = sample.attachment().map(|bytes| bytes.to_bytes());
                let payload = sample.payload().to_bytes();
                let read = wire.read_reply(FORM, &request.nonce, &payload, attachment.as_deref());
                if let Ok(reply) = read {
                    return Ok(reply);
                }
            }
            // An error has no seal, so it is used only if no sealed reply arrives.
            Err(error) => complaint = error.payload().try_to_string().ok().map(String::from),
        }
    }
    match complaint {
        Some(complaint) => bail!(
            "run '{}' answers: {}",
            run.run,
            complaint.replace(char::is_control, " ")
        ),
        None => bail!("run '{}' does not answer", run.run),
    }
}

/// Prints a value as JSON on stdout.
pub fn print(json: &impl Serialize) -> anyhow::Result<()> {
    let text = serde_json::to_string_pretty(json)?;
    Ok(terminal::print(format_args!("{text}\n"))?)
}

/// Returns the message for a reply of the wrong kind.
pub fn unexpected(reply: &Reply) -> String {
    format!("unexpected reply from the world: {reply:?}")
}

#[cfg(test)]
mod tests {
    use std::net::{Ipv4Addr, TcpListener};

    use cluster::rendezvous::JoinEndpoint;
    use cluster::session;
    use proto::control::wire::EncodedMessage;
    use proto::control::{ClockCommand, ClockStatus};
    use proto::keys::KeyExpressions;
    use proto::secret::Secret;
    use zenoh::Wait;
    use zenoh::query::Query;

    use super::*;

    const STATUS: ClockStatus = ClockStatus {
        paused: true,
        speed: None,
        steps_left: 0,
        tick: 7,
        waits_for: None,
    };

    /// Sends a request to a world that replies with `answers`, called with the query, the wire and the nonce of the request.
    fn ask_world(
        answers: impl Fn(&Query, &ControlTopic, &str) + Send + Sync + 'static,
    ) -> anyhow::Result<Reply> {
        let free = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let port = free.local_addr().unwrap().port();
        drop(free);
        let run = Rendezvous {
            run: "r".to_owned(),
            endpoint: format!("tcp/127.0.0.1:{port}"),
            pid: std::process::id(),
            token: "abc".to_owned(),
            team: JoinEndpoint {
                endpoint: String::new(),
                password: "def".to_owned(),
            },
            started: 0,
            remote: None,
        };
        let wire = ControlTopic::new(
            &KeyExpressions::new(&run.run),
            Secret::from_token(&run.token),
        );
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .enable_all()
            .build()
            .unwrap();
        runtime.block_on(async {
            let members =
                session::Members::new([(ConnectionRole::Operator.name(), run.token.as_str())])
                    .unwrap();
            let config = session::router(&session::Router {
                listen: std::slice::from_ref(&run.endpoint),
                uplink: None,
                members: &members,
                keyring: None,
                access: cluster::access::gateway_rules(&KeyExpressions::new(&run.run)),
            });
            let session = cluster::open(&config).await.unwrap();
            session
                .declare_queryable(wire.key().to_owned())
                .callback(move |query| {
                    let form = Format::from_zenoh(&query.encoding().unwrap().to_string());
                    let payload = query.payload().unwrap().to_bytes();
                    let request = wire.read_request(form, &payload, None).unwrap();
                    assert_eq!(request.command, ControlCommand::Clock(ClockCommand::Pause));
                    answers(&query, &wire, &request.nonce);
                })
                .background()
                .await
                .unwrap();
            let reply = send_command(run, ControlCommand::Clock(ClockCommand::Pause)).await;
            session.close().await.unwrap();
            reply
        })
    }

    fn send(query: &Query, wire: &ControlTopic, written: EncodedMessage) {
        query.reply(wire.key(), written.payload).wait().unwrap();
    }

    #[test]
    fn only_a_reply_with_the_seal_of_the_request_is_accepted() {
        let reply = ask_world(|query, wire, nonce| {
            let write = |nonce: &str, tick| {
                let reply = Reply::Clock(ClockStatus { tick, ..STATUS });
                wire.write_reply(Format::Bincode, nonce, &reply).unwrap()
            };
            let mut forged = write(nonce, 1);
            *forged.payload.last_mut().unwrap() ^= 1;
            send(query, wire, forged);
            send(query, wire, write("another", 2));
            query.reply_err("go away").wait().unwrap();
            send(query, wire, write(nonce, 7));
        });
        assert_eq!(reply.unwrap(), Reply::Clock(STATUS));
    }

    #[test]
    fn the_error_of_an_unreadable_request_is_returned() {
        let reply = ask_world(|query, _, _| query.reply_err("wrong\nseal").wait().unwrap());
        assert_eq!(
            reply.unwrap_err().to_string(),
            "run 'r' answers: wrong seal"
        );
    }

    #[test]
    fn a_missing_answer_is_an_error() {
        let reply = ask_world(|_, _, _| {});
        assert_eq!(reply.unwrap_err().to_string(), "run 'r' does not answer");
    }
}
