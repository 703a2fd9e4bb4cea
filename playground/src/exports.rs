//! The functions of the WebAssembly module. Each page thread with a run loads the module once.
//!
//! Texts are UTF-8 in one buffer. The page calls `reserve`, writes its text at the returned place, and calls a function. The
//! answer, or the message of a panic, is then at `text` and has `length` bytes.

#![expect(
    unsafe_code,
    reason = "an exported name is unsafe for Rust, because another library might have an equal one"
)]

use std::cell::RefCell;
use std::time::Duration;

use proto::control::{ControlCommand, Reply};
use serde::Serialize;
use serde_json::json;

use crate::engine::Engine;
use crate::gallery::choices;

thread_local! {
    /// The buffer. No function keeps it borrowed while the run works, so a panic can write into it.
    static TEXT: RefCell<Vec<u8>> = RefCell::default();
    static ENGINE: RefCell<Option<Engine>> = RefCell::default();
}

/// Reserves a number of bytes for a text and returns their place.
#[unsafe(no_mangle)]
extern "C" fn reserve(bytes: usize) -> *mut u8 {
    TEXT.with_borrow_mut(|text| {
        text.clear();
        text.resize(bytes, 0);
        text.as_mut_ptr()
    })
}

/// Returns the place of the latest answer.
#[unsafe(no_mangle)]
extern "C" fn text() -> *const u8 {
    TEXT.with_borrow(|text| text.as_ptr())
}

/// Returns the number of bytes of the latest answer.
#[unsafe(no_mangle)]
extern "C" fn length() -> usize {
    TEXT.with_borrow(Vec::len)
}

/// Answers with the scenarios and allocators, and prepares the messages of panics.
#[unsafe(no_mangle)]
extern "C" fn list() {
    std::panic::set_hook(Box::new(|panic| answer(panic.to_string())));
    answer_json(Ok(choices()));
}

/// Opens the run of a [`Choice`](crate::choice::Choice) and answers with its description, or `{"error"}`.
#[unsafe(no_mangle)]
extern "C" fn open(now_ms: f64) {
    let choice = TEXT.with_borrow(|text| serde_json::from_slice(text));
    // The page writes a valid choice, unless a link has another content.
    let engine = choice.map_err(|error| {
        format!("This link is damaged: {error}; copy it once more, or choose a run above")
    });
    let engine = engine
        .and_then(|choice| Engine::open(&choice, time(now_ms)).map_err(|error| error.to_string()));
    answer_json(engine.map(|engine| {
        let about = engine.about().clone();
        ENGINE.set(Some(engine));
        about
    }));
}

/// Executes a [`ControlCommand`] and answers with its [`Reply`].
#[unsafe(no_mangle)]
extern "C" fn control(now_ms: f64) {
    let command = TEXT.with_borrow(|text| serde_json::from_slice::<ControlCommand>(text));
    let reply = with_engine(|engine| match command {
        Ok(command) => engine.execute(command, time(now_ms)),
        Err(error) => Reply::Refused(error.to_string()),
    });
    answer_json(reply);
}

/// Runs at most `ticks` ticks that are due. Returns the time until the next one, ms; infinity if the clock stands. If the
/// run cannot go on, the result is no number, and the answer is the reason.
#[unsafe(no_mangle)]
extern "C" fn advance(now_ms: f64, ticks: u32) -> f64 {
    let next = with_engine(|engine| engine.advance(time(now_ms), ticks));
    match next.and_then(|next| next.map_err(|error| error.to_string())) {
        Ok(None) => f64::INFINITY,
        Ok(Some(next)) => 1000.0 * next.as_secs_f64(),
        Err(error) => {
            answer(error);
            f64::NAN
        }
    }
}

/// Answers with the frames since the last call, one per line.
#[unsafe(no_mangle)]
extern "C" fn frames() {
    let frames = with_engine(|engine| engine.frames().join("\n"));
    answer(frames.unwrap_or_default());
}

/// Answers with the orders so far, for a [`Choice`](crate::choice::Choice) that repeats the run.
#[unsafe(no_mangle)]
extern "C" fn orders() {
    answer_json(with_engine(|engine| json!(engine.orders())));
}

/// Draws or changes the text of a scenario, see [`edit`](crate::edit::edit).
#[unsafe(no_mangle)]
extern "C" fn edit() {
    let request = TEXT.with_borrow(|text| serde_json::from_slice(text));
    answer_json(
        request
            .map(crate::edit::edit)
            .map_err(|error| error.to_string()),
    );
}

/// Answers with the hash of the run so far.
#[unsafe(no_mangle)]
extern "C" fn hash() {
    let hash = with_engine(|engine| engine.hash());
    answer(hash.unwrap_or_default());
}

fn with_engine<R>(action: impl FnOnce(&mut Engine) -> R) -> Result<R, String> {
    ENGINE.with_borrow_mut(|engine| match engine {
        Some(engine) => Ok(action(engine)),
        None => Err("no run is open".to_owned()),
    })
}

fn answer(text: String) {
    TEXT.set(text.into_bytes());
}

fn answer_json(answered: Result<impl Serialize, String>) {
    answer(match answered {
        Ok(answered) => json!(answered).to_string(),
        Err(error) => json!({ "error": error }).to_string(),
    });
}

/// Returns a time of the page's clock, which never is negative.
fn time(now_ms: f64) -> Duration {
    Duration::try_from_secs_f64(now_ms / 1000.0).unwrap_or_default()
}
