//! What every command writes to its standard output and error. Nobody may be there to read it, for a pipe may be closed and a
//! disk full: a run goes on without its words, where `println!` would panic.

use std::fmt::Display;
use std::io::{self, Write};
use std::process::ExitCode;

/// Tells a person a line on stderr, if it can be told; arguments as of `format!`.
#[macro_export]
macro_rules! tell {
    ($($line:tt)*) => {
        $crate::terminal::tell(format_args!($($line)*))
    };
}

/// Writes a line to stderr, if it can be written.
pub fn tell(line: impl Display) {
    // Whole, so that lines of several processes do not mix; and there is nowhere else to complain.
    let _ = io::stderr().write_all(format!("{line}\n").as_bytes());
}

/// Writes a command's result to stdout. Whoever closes the pipe has read enough.
///
/// # Errors
/// Why it could not be written.
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

/// The same at the end of that command: the status that it would have, or 3 when the result could not be written, which is told
/// in a line.
pub fn answer(command: &str, text: impl Display, status: ExitCode) -> ExitCode {
    match print(text) {
        Ok(()) => status,
        Err(error) => {
            tell!("{command}: {error}");
            ExitCode::from(3)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where nothing can be written, for that reason.
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
