//! The page: a run before the eyes, in a browser on this machine, and within reach of the hands.
//!
//! - [`watch`]: `alliance watch`, an observer of a live run in a process of its own. [`view`]: `alliance view`, a finished run.
//! - [`link`]: socket, token and link. `gate`: who may ask. `server`: what is asked and answered; `assets`: the page's files,
//!   which are in `launch/page/`.
//! - `live`: what an observer hears; `past`: what it tells those who come later. `logged`: a finished run, from its log.
//!
//! # What the page's server answers
//! The link is `http://127.0.0.1:PORT/#TOKEN`. Requests below `/api/` bear the token, as `Authorization: Bearer TOKEN` or, to
//! open a WebSocket, as its second subprotocol beside `alliance`.
//!
//! | request | answer |
//! |---|---|
//! | `GET /`, `GET /assets/PATH` | the page's files |
//! | `GET /api/run` | mode `live` or `log`, seed, scenario and ALLIANCE parameters as in run.json, catalog of tasks and behavior sets, length of a log |
//! | WebSocket `/api/live` | first `{"past": {"views", "messages", "bends", "events"}}`, then `{"view"}` ([`View`](alliance_proto::view::View), the newest, without its messages and bends), `{"messages": {"receptions", "left_out"}}` and `{"bends"}` (those), `{"events"}` (rows of events.csv), `{"missed"}` (so much of the latter three a slow page did not get), at last `{"ended": {"outcome", "folder"}}`; it closes without that when only this server ends |
//! | `POST /api/control` | a command in the words of `docs/CONTROL.md`, and the world's reply |
//! | `GET /api/views?from=TICK&count=N&step=K` | of a finished run: at most 1000 views |
//! | `GET /api/bends?robot=RANK` | of a finished run: the corners of all curves of motivations of that robot ([`Bend`](alliance_proto::view::Bend)) |
//! | WebSocket `/api/page` | of a finished run: nothing; it is open as long as the page is |
//! | `GET /api/events` | of a finished run: all rows of events.csv |
//!
//! Who may not ask, and a command that is none, is answered with `{"error": "…"}`.

mod about;
mod assets;
mod gate;
pub mod link;
mod live;
pub(crate) mod logged;
mod past;
pub mod server;
pub mod view;
pub mod watch;

/// Runs a file of `launch/page-tests/` with `node --test`. Where there is no Node.js it fails, but with `ALLIANCE_SKIP_TESTS=1`.
#[cfg(test)]
#[track_caller]
fn node(command: &mut std::process::Command, file: &str) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("page-tests")
        .join(file);
    match command.arg("--test").arg(path).output() {
        Ok(output) => assert!(
            output.status.success(),
            "{}{}",
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        ),
        Err(_) if std::env::var_os("ALLIANCE_SKIP_TESTS").is_some_and(|value| value == "1") => {
            alliance_proto::tell!("skipped: the page's own tests need Node.js 20");
        }
        Err(error) => panic!("node: {error}; the page's own tests need Node.js 20"),
    }
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    #[test]
    fn the_page_draws_what_happened() {
        super::node(&mut Command::new("node"), "curves.test.js");
    }

    #[test]
    fn the_page_makes_faults_of_what_the_mission_declares() {
        super::node(&mut Command::new("node"), "own_faults.test.js");
    }

    #[test]
    fn a_log_of_any_team_is_played_by_thirty_views_a_second() {
        super::node(&mut Command::new("node"), "player.test.js");
    }

    #[test]
    fn the_page_tells_of_a_mission_what_that_declares() {
        super::node(&mut Command::new("node"), "mission.test.js");
    }
}
