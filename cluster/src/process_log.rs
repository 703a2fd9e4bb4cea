//! The log of a process: one line per event on stderr.

use std::io::{self, Write};

use terminal::in_one_line;
use tracing_subscriber::EnvFilter;

/// The filter without `RUST_LOG`. It hides two false warnings of zenoh: one for every connection by a socket, and one
/// about open files for every failed handshake.
const DEFAULT_FILTER: &str = "warn,zenoh_link_unixsock_stream=error,zenoh_link_tls=error,world_server=info,robot_agent=info,cluster=info";

/// Sends the log to stderr. `RUST_LOG` sets the filter.
pub fn log_to_stderr() {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| DEFAULT_FILTER.into());
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(|| EventLines(io::stderr()))
        // A failed write must not cause further messages or a panic.
        .log_internal_errors(false)
        // Colors are made of control characters, which are escaped.
        .with_ansi(false)
        .init();
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

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[test]
    fn texts_in_events_control_nothing() {
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
        let subscriber = tracing_subscriber::fmt()
            .with_writer(|| EventLines(Lines))
            .with_ansi(false)
            .without_time()
            .with_target(false)
            .finish();
        tracing::subscriber::with_default(subscriber, || {
            let why = "no robot '\u{1b}]0;owned\u{7}\u{202e}\r\n WARN robot is lost'";
            tracing::warn!(count = 1, %why, "request ignored");
        });
        let lines = LINES.lock().unwrap().clone();
        assert_eq!(
            String::from_utf8(lines).unwrap(),
            " WARN request ignored count=1 why=no robot '\\u001b]0;owned\\u0007\\u202e\\u000d\\u000a WARN robot is lost'\n"
        );
    }
}
