//! The log of a process: one line per event on stderr, as text or as JSON.
//!
//! A JSON line is one object with `timestamp`, `level`, `process`, `run` (once the run is known), `target`, `message` and
//! the fields of the event. Lines that a process writes for people become events of level INFO, and failures of level
//! ERROR.

use std::io::{self, Write};
use std::sync::{OnceLock, PoisonError, RwLock};

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde_json::{Map, Value};
use terminal::{LineLevel, in_one_line};
use tracing_subscriber::EnvFilter;

/// The filter without `RUST_LOG`. It hides two false warnings of zenoh: one for every connection by a socket, and one
/// about open files for every failed handshake. It also hides warnings of the renderer of pictures about lines without a
/// length, which draw nothing.
const DEFAULT_FILTER: &str = "warn,zenoh_link_unixsock_stream=error,zenoh_link_tls=error,tiny_skia=error,world_server=info,robot_agent=info,cluster=info";

/// The environment variable with the format of the log. Processes inherit the format of the process that starts them.
const LOG_FORMAT: &str = "ALLIANCE_LOG_FORMAT";

/// The environment variable with the run in the log of a process that another one starts.
const LOG_RUN: &str = "ALLIANCE_LOG_RUN";

/// The form of the lines of a log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LogFormat {
    /// Lines of text, for people.
    #[default]
    Text,
    /// One JSON object per line.
    Json,
}

impl LogFormat {
    const ALL: [Self; 2] = [Self::Text, Self::Json];

    fn as_str(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Json => "json",
        }
    }

    fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.as_str() == name)
    }
}

/// The option for the form of the log.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct LogArgs {
    /// Form of the log, also of all started processes [default: text]
    #[arg(long, value_name = "FORMAT", value_parser = log_format())]
    log_format: Option<LogFormat>,
}

/// Parses the name of a format.
fn log_format() -> impl TypedValueParser<Value = LogFormat> {
    let names = PossibleValuesParser::new(LogFormat::ALL.map(LogFormat::as_str));
    // The parser has already rejected all other words.
    names.map(|name| LogFormat::find(&name).unwrap_or_default())
}

impl LogArgs {
    /// Returns the requested format, or else the inherited one.
    fn format(self) -> LogFormat {
        self.log_format.unwrap_or_else(|| {
            let inherited = std::env::var(LOG_FORMAT).ok();
            let inherited = inherited.and_then(|name| LogFormat::find(&name));
            inherited.unwrap_or_default()
        })
    }
}

/// The format of this process's log, and the name of the process in it.
static PROCESS: OnceLock<(LogFormat, String)> = OnceLock::new();

/// The run in which this process takes part.
static RUN: RwLock<Option<String>> = RwLock::new(None);

/// Sends the log to stderr. `RUST_LOG` sets the filter. `process` is the name of the process in JSON lines, such as
/// `world` or the name of a robot.
pub fn log_to_stderr(args: LogArgs, process: &str) {
    let format = args.format();
    let _ = PROCESS.set((format, process.to_owned()));
    if let Ok(run) = std::env::var(LOG_RUN) {
        set_run(&run);
    }
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| DEFAULT_FILTER.into());
    let subscriber = tracing_subscriber::fmt()
        .with_env_filter(filter)
        // A failed write must not cause further messages or a panic.
        .log_internal_errors(false)
        // Colors are made of control characters, which are escaped.
        .with_ansi(false);
    match format {
        LogFormat::Text => subscriber.with_writer(|| EventLines(io::stderr())).init(),
        LogFormat::Json => {
            let lines = subscriber.json().flatten_event(true);
            let lines = lines.with_current_span(false).with_span_list(false);
            lines.with_writer(|| JsonLines(io::stderr())).init();
            terminal::send_lines_to(|level, line| match level {
                LineLevel::Info => tracing::info!("{line}"),
                LineLevel::Error => tracing::error!("{line}"),
            });
        }
    }
}

/// Sets the run in the following JSON lines.
pub fn set_run(run: &str) {
    *RUN.write().unwrap_or_else(PoisonError::into_inner) = Some(run.to_owned());
}

/// Returns the environment variables that give a child process the format and the run of this process.
#[must_use]
pub fn child_variables() -> Vec<(&'static str, String)> {
    let format = PROCESS.get().map_or(LogFormat::Text, |(format, _)| *format);
    let run = RUN.read().unwrap_or_else(PoisonError::into_inner).clone();
    let run = run.map(|run| (LOG_RUN, run));
    let format = (LOG_FORMAT, format.as_str().to_owned());
    [format].into_iter().chain(run).collect()
}

/// Writes each event as one line. Texts of other programs in it, such as names and messages of controllers, cannot
/// control the terminal or look like further events.
struct EventLines<W>(W);

impl<W: Write> Write for EventLines<W> {
    /// Writes one event, because the formatter writes whole events.
    fn write(&mut self, event: &[u8]) -> io::Result<usize> {
        let text = String::from_utf8_lossy(event);
        let line = in_one_line(text.trim_end_matches('\n'));
        self.0.write_all(format!("{line}\n").as_bytes())?;
        Ok(event.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// Writes each event, a JSON object, with the process and the run. JSON itself escapes line feeds.
struct JsonLines<W>(W);

impl<W: Write> Write for JsonLines<W> {
    fn write(&mut self, event: &[u8]) -> io::Result<usize> {
        let text = String::from_utf8_lossy(event);
        let process = PROCESS.get().map_or("", |(_, process)| process);
        let run = RUN.read().unwrap_or_else(PoisonError::into_inner);
        let line = with_process(text.trim_end_matches('\n'), process, run.as_deref());
        self.0.write_all(in_one_line(&line).as_bytes())?;
        self.0.write_all(b"\n")?;
        Ok(event.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// Returns a JSON object with the process and the run. A field `run` of the event is no second key.
fn with_process(object: &str, process: &str, run: Option<&str>) -> String {
    let mut fields: Map<String, Value> = serde_json::from_str(object).unwrap_or_default();
    fields.insert("process".to_owned(), process.into());
    if let Some(run) = run {
        fields.insert("run".to_owned(), run.into());
    }
    Value::Object(fields).to_string()
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    /// Returns the bytes that a subscriber writes for one warning with a hostile text.
    macro_rules! warned {
        ($subscriber:expr, $lines:ident) => {{
            static LINES: Mutex<Vec<u8>> = Mutex::new(Vec::new());
            struct Lines;
            impl Write for Lines {
                fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
                    LINES.lock().unwrap().write(bytes)
                }
                fn flush(&mut self) -> io::Result<()> {
                    Ok(())
                }
            }
            let subscriber = $subscriber.with_writer(|| $lines(Lines)).finish();
            tracing::subscriber::with_default(subscriber, || {
                let why = "no robot '\u{1b}]0;owned\u{7}\u{202e}\r\n WARN robot is lost'";
                tracing::warn!(count = 1, %why, "request ignored");
            });
            let lines = LINES.lock().unwrap().clone();
            String::from_utf8(lines).unwrap()
        }};
    }

    #[test]
    fn texts_in_events_control_nothing() {
        let subscriber = tracing_subscriber::fmt()
            .with_ansi(false)
            .without_time()
            .with_target(false);
        assert_eq!(
            warned!(subscriber, EventLines),
            " WARN request ignored count=1 why=no robot '\\u001b]0;owned\\u0007\\u202e\\u000d\\u000a WARN robot is lost'\n"
        );
    }

    #[test]
    fn a_json_line_is_one_object_with_time_level_process_and_run() {
        set_run("waste-1");
        let subscriber = tracing_subscriber::fmt().json().flatten_event(true);
        let line = warned!(subscriber, JsonLines);
        assert_eq!(line.matches('\n').count(), 1);
        assert!(!line.trim_end().contains(char::is_control), "{line}");
        let object: serde_json::Value = serde_json::from_str(&line).unwrap();
        let expected = "no robot '\u{1b}]0;owned\u{7}\u{202e}\r\n WARN robot is lost'";
        assert_eq!(object["why"], expected);
        assert_eq!(object["count"], 1);
        assert_eq!(object["level"], "WARN");
        assert_eq!(object["message"], "request ignored");
        assert_eq!(object["run"], "waste-1");
        assert_eq!(object["process"], "");
        assert!(object["timestamp"].is_string());
    }

    #[test]
    fn a_run_in_an_event_is_no_second_key() {
        let event = r#"{"level":"INFO","run":"waste-1"}"#;
        let line = with_process(event, "world", Some("waste-1"));
        assert_eq!(line.matches("\"run\"").count(), 1, "{line}");
    }
}
