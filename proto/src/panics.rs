//! What becomes of a panic: one line that says who panicked, where and why, and the end of the process; or of the run alone, where
//! several runs share a process.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::sync::OnceLock;

use crate::tell;

/// Exit status of a process that panicked; the same as Rust's own.
pub const PANICKED: i32 = 101;

/// Who this process is, with what of other people's it runs.
static WHO: OnceLock<String> = OnceLock::new();

thread_local! {
    /// Whether a panic of this thread is caught.
    static IS_CAUGHT: Cell<bool> = const { Cell::new(false) };
    /// What the panic that is being caught said.
    static SAID: Cell<Option<String>> = const { Cell::new(None) };
}

/// Makes every panic that nobody [catches](catch) end the process. A panic inside a zenoh callback would otherwise end only zenoh's
/// worker and leave a process that neither lives nor dies. With `RUST_BACKTRACE` the usual report follows the line.
pub(crate) fn prepare() {
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let said = in_a_line(panic);
        if IS_CAUGHT.get() {
            SAID.set(Some(said));
            return;
        }
        tell!("{}: {said}", WHO.get().map_or("alliance", String::as_str));
        if std::env::var_os("RUST_BACKTRACE").is_some() {
            report(panic);
        }
        std::process::exit(PANICKED);
    }));
}

/// Says once who this process is: what a panic's line begins with.
pub fn this_is(who: String) {
    // Whoever said it first knows.
    let _ = WHO.set(who);
}

/// Does something that may panic; a panic is its error, in one line.
///
/// # Errors
/// What the panic said.
pub fn catch<T>(action: impl FnOnce() -> T) -> Result<T, String> {
    IS_CAUGHT.set(true);
    // Nothing that the closure has touched is looked at again.
    let done = catch_unwind(AssertUnwindSafe(action));
    IS_CAUGHT.set(false);
    done.map_err(|panic| {
        // Where no hook has been set the words are all there is.
        let words = panic.downcast_ref::<String>().map(String::as_str);
        let words = words.or_else(|| panic.downcast_ref::<&str>().copied());
        let words = || format!("panicked: {}", words.unwrap_or("without a word"));
        SAID.take().unwrap_or_else(words)
    })
}

fn in_a_line(panic: &PanicHookInfo<'_>) -> String {
    let words = panic.payload_as_str().unwrap_or("without a word");
    let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
    match panic.location() {
        Some(location) => format!(
            "panicked at {}:{}: {words}",
            location.file(),
            location.line()
        ),
        None => format!("panicked: {words}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_that_is_caught_is_an_error_with_its_words() {
        let error = catch(|| -> u32 { panic!("out of {}", "luck") }).unwrap_err();
        assert_eq!(error, "panicked: out of luck");
        assert_eq!(catch(|| 7), Ok(7));
    }
}
