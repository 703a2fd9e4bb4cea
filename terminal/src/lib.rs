//! Output of commands to stdout and stderr. A closed pipe or a full disk does not end a run, where `println!` would
//! panic.

pub mod panics;

use std::fmt::Display;
use std::io::{self, Write};
use std::process::ExitCode;

/// Writes a line to stderr and ignores failures; takes the arguments of `format!`.
#[macro_export]
macro_rules! stderr_line {
    ($($line:tt)*) => {
        $crate::write_stderr_line(format_args!($($line)*))
    };
}

/// Writes a line to stderr and ignores failures.
pub fn write_stderr_line(line: impl Display) {
    // One write per line keeps the lines of several processes apart. A failure cannot be reported anywhere else.
    let _ = io::stderr().write_all(format!("{line}\n").as_bytes());
}

/// Writes a command's result to stdout. A closed pipe counts as success.
///
/// # Errors
/// Returns the error of any other failed write.
pub fn print(text: impl Display) -> io::Result<()> {
    print_to(&mut io::stdout().lock(), text)
}

fn print_to(out: &mut impl Write, text: impl Display) -> io::Result<()> {
    match write!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(io::Error::new(
            error.kind(),
            format!("standard output: {error}"),
        )),
        Ok(()) => Ok(()),
    }
}

/// Writes a command's result to stdout and returns `status`. If this fails, writes the error to stderr and returns
/// status 3.
pub fn print_result(command: &str, text: impl Display, status: ExitCode) -> ExitCode {
    match print(text) {
        Ok(()) => status,
        Err(error) => {
            stderr_line!("{command}: {error}");
            ExitCode::from(3)
        }
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
    fn a_closed_pipe_is_no_error_and_a_full_disk_is() {
        let print = |kind| print_to(&mut Broken(kind), "a result");
        assert!(print(io::ErrorKind::BrokenPipe).is_ok());
        let error = print(io::ErrorKind::StorageFull).unwrap_err();
        assert!(error.to_string().starts_with("standard output: "));
    }
}
