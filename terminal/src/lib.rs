//! Output of commands to stdout and stderr. A closed pipe or a full disk does not end a run, where `println!` would
//! panic.
//!
//! Texts from logs, folder names and controllers' exceptions can contain any character. All output is [`escaped`], so
//! that no text controls the terminal.

pub mod panics;

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;
use std::sync::OnceLock;

/// Clears the terminal. Does nothing if stderr is not a terminal.
pub fn clear_screen() {
    if io::stderr().is_terminal() {
        let _ = io::stderr().write_all(b"\x1b[2J\x1b[H");
    }
}

/// Returns a number with its noun in the singular or plural, such as "1 run" or "2 runs".
#[must_use]
pub fn counted(count: usize, noun: &str) -> String {
    let ending = if count == 1 { "" } else { "s" };
    format!("{count} {noun}{ending}")
}

/// Reads a file that a user has named.
///
/// # Errors
/// Returns the error of the system with one line: the path, the problem and the remedy.
pub fn read_file(path: &Path) -> io::Result<Vec<u8>> {
    std::fs::read(path).map_err(|error| {
        let problem = match error.kind() {
            ErrorKind::NotFound => "no such file; correct the path".to_owned(),
            ErrorKind::IsADirectory => "that is a folder; name a file".to_owned(),
            _ => format!("cannot be read: {error}"),
        };
        io::Error::new(error.kind(), format!("{}: {problem}", path.display()))
    })
}

/// Replaces characters that control a terminal or that are invisible by escapes such as `\u001b`. Line feeds and tabs
/// stay. The escapes are those of JSON and TOML strings, so that results in these formats stay readable.
#[must_use]
pub fn escaped(text: &str) -> Cow<'_, str> {
    replace_if(text, |c| is_unsafe(c) && !matches!(c, '\n' | '\t'))
}

/// Escapes like [`escaped`], and also line feeds and tabs, so that a value does not look like further lines.
#[must_use]
pub fn in_one_line(text: &str) -> Cow<'_, str> {
    replace_if(text, is_unsafe)
}

fn replace_if(text: &str, is_replaced: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&is_replaced) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::new();
    for c in text.chars() {
        if is_replaced(c) {
            for unit in c.encode_utf16(&mut [0; 2]) {
                escaped += &format!("\\u{unit:04x}");
            }
        } else {
            escaped.push(c);
        }
    }
    Cow::Owned(escaped)
}

/// Returns whether a character is a control character, a separator of lines, or a format character of Unicode: marks
/// of the direction of text, joiners, and invisible operators and tags.
fn is_unsafe(c: char) -> bool {
    c.is_control()
        || matches!(
            c,
            '\u{ad}' | '\u{600}'..='\u{605}' | '\u{61c}' | '\u{6dd}' | '\u{70f}' | '\u{180e}'
                | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}'
                | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{1d173}'..='\u{1d17a}' | '\u{e0000}'..='\u{e007f}'
        )
}

/// Writes a line to stderr and ignores failures; takes the arguments of `format!`.
#[macro_export]
macro_rules! stderr_line {
    ($($line:tt)*) => {
        $crate::write_stderr_line(format_args!($($line)*))
    };
}

/// The importance of a line on stderr.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineLevel {
    Info,
    /// The failure of the command or of the process.
    Error,
}

/// The function that writes lines instead of stderr.
static LINE_WRITER: OnceLock<fn(LineLevel, &str)> = OnceLock::new();

/// Sends all further lines for stderr to a function, without their line feeds. Only the first call has an effect.
pub fn send_lines_to(writer: fn(LineLevel, &str)) {
    let _ = LINE_WRITER.set(writer);
}

/// Writes a line to stderr and ignores failures.
pub fn write_stderr_line(line: impl Display) {
    write_line(LineLevel::Info, line);
}

/// Writes the line of a failure to stderr and ignores failures to write.
pub fn write_error_line(line: impl Display) {
    write_line(LineLevel::Error, line);
}

fn write_line(level: LineLevel, line: impl Display) {
    if let Some(writer) = LINE_WRITER.get() {
        return writer(level, &line.to_string());
    }
    // One write per line keeps the lines of several processes apart. A failure cannot be reported anywhere else.
    let _ = io::stderr().write_all(format!("{}\n", escaped(&line.to_string())).as_bytes());
}

/// Writes a command's result to stdout. A closed pipe counts as success.
///
/// # Errors
/// Returns the error of any other failed write.
pub fn print(text: impl Display) -> io::Result<()> {
    print_to(&mut io::stdout().lock(), text)
}

fn print_to(out: &mut impl Write, text: impl Display) -> io::Result<()> {
    match out
        .write_all(escaped(&text.to_string()).as_bytes())
        .and_then(|()| out.flush())
    {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(io::Error::new(
            error.kind(),
            format!("standard output: {error}"),
        )),
        Ok(()) => Ok(()),
    }
}

/// Writes the error of a command to stderr, in one line with all its causes, and returns the exit status.
pub fn fail(command: &str, error: &dyn Display, status: u8) -> ExitCode {
    write_error_line(format_args!("{command}: {error:#}"));
    ExitCode::from(status)
}

/// Writes a command's result to stdout and returns `status`. If this fails, writes the error to stderr and returns
/// status 3.
pub fn print_result(command: &str, text: impl Display, status: ExitCode) -> ExitCode {
    match print(text) {
        Ok(()) => status,
        Err(error) => fail(command, &error, 3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A writer that fails with this kind of error.
    struct Broken(io::ErrorKind);

    impl Write for Broken {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(self.0.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn characters_that_control_the_terminal_are_escaped() {
        assert_eq!(escaped("a\tb\n\u{e9}\u{2013}"), "a\tb\n\u{e9}\u{2013}");
        assert_eq!(
            escaped("\u{1b}]0;owned\u{7}\u{9b}2J\u{7f}\r"),
            r"\u001b]0;owned\u0007\u009b2J\u007f\u000d"
        );
        assert_eq!(
            escaped("\u{202e}\u{2066}\u{200b}\u{feff}"),
            r"\u202e\u2066\u200b\ufeff"
        );
        assert_eq!(escaped("\u{e0041}"), r"\udb40\udc41");
        assert_eq!(
            in_one_line("identical\n\tdiffers"),
            r"identical\u000a\u0009differs"
        );
    }

    #[test]
    fn printed_text_is_escaped() {
        let mut out = Vec::new();
        print_to(&mut out, "a\u{1b}[2J\u{202e}\n").unwrap();
        assert_eq!(out, b"a\\u001b[2J\\u202e\n");
    }

    #[test]
    fn a_closed_pipe_is_no_error_and_a_full_disk_is() {
        let print = |kind| print_to(&mut Broken(kind), "a result");
        assert!(print(io::ErrorKind::BrokenPipe).is_ok());
        let error = print(io::ErrorKind::StorageFull).unwrap_err();
        assert!(error.to_string().starts_with("standard output: "));
    }
}
