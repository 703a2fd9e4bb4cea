//! Handling of panics. A panic writes one line with process, place and message, and ends the process. Where several
//! runs share a process, a caught panic ends only its run.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, resume_unwind};
use std::sync::OnceLock;

use crate::write_error_line;

/// The exit status of a process that panicked, the same as Rust's own.
pub const PANICKED: i32 = 101;

/// The name of this process, with the name of any external code that it runs.
static PROCESS_NAME: OnceLock<String> = OnceLock::new();

thread_local! {
    /// True while panics of this thread are caught.
    static IS_CAUGHT: Cell<bool> = const { Cell::new(false) };
    /// The line of the panic that is being caught.
    static CAUGHT_LINE: Cell<Option<String>> = const { Cell::new(None) };
}

/// Makes every panic that is not [caught](catch) end the process. Without this hook, a panic inside a zenoh callback
/// ends only zenoh's worker, and the process hangs. With `RUST_BACKTRACE` the usual report follows the line.
pub fn install_hook() {
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let line = one_line(panic);
        if IS_CAUGHT.get() {
            CAUGHT_LINE.set(Some(line));
            return;
        }
        let name = PROCESS_NAME.get().map_or("alliance", String::as_str);
        write_error_line(format_args!("{name}: {line}"));
        if std::env::var_os("RUST_BACKTRACE").is_some() {
            report(panic);
        }
        std::process::exit(PANICKED);
    }));
}

/// Sets the process name at the start of a panic's line. Only the first call has an effect.
pub fn set_process_name(name: String) {
    let _ = PROCESS_NAME.set(name);
}

/// The payload of [`end_run`].
struct EndedRun(String);

/// Ends the action that [`catch`] runs in this thread, with this error. Foreign code in a run has no other way to end it.
pub fn end_run(reason: String) -> ! {
    resume_unwind(Box::new(EndedRun(reason)))
}

/// Runs an action that may panic. Converts a panic into an error of one line.
pub fn catch<T>(action: impl FnOnce() -> T) -> Result<T, String> {
    IS_CAUGHT.set(true);
    // The state of the closure is not used after a panic.
    let done = catch_unwind(AssertUnwindSafe(action));
    IS_CAUGHT.set(false);
    done.map_err(|panic| {
        if let Some(EndedRun(reason)) = panic.downcast_ref() {
            return reason.clone();
        }
        // Without the hook, the payload is the only information.
        let message = panic.downcast_ref::<String>().map(String::as_str);
        let message = message.or_else(|| panic.downcast_ref::<&str>().copied());
        let message = || format!("panicked: {}", message.unwrap_or("without a message"));
        CAUGHT_LINE.take().unwrap_or_else(message)
    })
}

fn one_line(panic: &PanicHookInfo<'_>) -> String {
    let message = panic.payload_as_str().unwrap_or("without a message");
    let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
    match panic.location() {
        Some(location) => format!(
            "panicked at {}:{}: {message}",
            location.file(),
            location.line()
        ),
        None => format!("panicked: {message}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_caught_panic_is_an_error_with_its_message() {
        let error = catch(|| -> u32 { panic!("out of {}", "luck") }).unwrap_err();
        assert_eq!(error, "panicked: out of luck");
        assert_eq!(catch(|| 7), Ok(7));
        let ended = catch(|| -> u32 { end_run("no luck".to_owned()) });
        assert_eq!(ended.unwrap_err(), "no luck");
    }
}
