//! The page: display and control of a run in a browser on this machine.
//!
//! - [`watch`]: `alliance watch`. [`view`]: the page of a finished run.
//! - [`link`]: socket, token and link. `gate`: access control. `server`: the HTTP server. `assets`: the files of `launch/page/`.
//! - `single_file`: the page with all its files inside. [`mod@file`]: a finished run in it, for `alliance export --html`. `delta`:
//!   the changes between its views. [`playground`]: the simulator in it.
//! - `live`: a live run, received over the bus. `logged`: a finished run, from its log.
//!
//! # Requests to the server
//! The link is `http://127.0.0.1:PORT/#TOKEN`. Requests below `/api/` contain the token, as `Authorization: Bearer TOKEN`. A WebSocket
//! request contains it as second subprotocol after `alliance`.
//!
//! | request | answer |
//! |---|---|
//! | `GET /`, `GET /assets/PATH` | the page's files |
//! | `GET /api/run` | mode `live` or `log`, seed, scenario and ALLIANCE parameters as in run.json, catalog of tasks and behavior sets, length of a log |
//! | WebSocket `/api/live` | first `{"past": {"views", "messages", "corners", "events"}}`; then `{"view"}` (the newest [`View`](proto::view::View) without its messages and corners), `{"messages": {"receptions", "left_out"}}` and `{"corners"}` (of the view), `{"events"}` (rows of events.csv and, up to two steps late, `detected` and `took-over` as in a log) and `{"missed"}` (the number of frames of the latter three that a slow page lost); finally `{"ended": {"outcome", "folder"}}`, unless only this server ends |
//! | `POST /api/control` | a command as in `docs/CONTROL.md`; returns the world's reply |
//! | `GET /api/views?from=TICK&count=N&step=K` | of a finished run: at most 1000 views |
//! | `GET /api/overview` | of a finished run: some hundred views of the whole run, with only the poses and states of the robots |
//! | `GET /api/corners?robot=RANK` | of a finished run: the corners of all curves of motivations of that robot ([`Corner`](proto::view::Corner)) |
//! | WebSocket `/api/page` | of a finished run: nothing; it stays open as long as the page |
//! | `GET /api/events` | of a finished run: all rows of events.csv, and of lost robots the detections and the takeovers as events `detected` and `took-over` |
//!
//! A refused request or an invalid command returns `{"error": "…"}`.

mod assets;
mod corners;
mod delta;
pub mod file;
mod gate;
pub mod link;
mod live;
pub(crate) mod logged;
pub mod playground;
pub mod server;
mod single_file;
#[cfg(test)]
mod types;
pub mod view;
mod views;
pub mod watch;

/// Runs a file of `launch/page-tests/` with `node --test`. Without Node.js it fails, or is skipped with `ALLIANCE_SKIP_TESTS=1`.
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
            terminal::stderr_line!("skipped: the tests of the page need Node.js 20");
        }
        Err(error) => panic!("node: {error}; the tests of the page need Node.js 20"),
    }
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use analysis::palette;
    use proto::view::MarkRole;

    /// The light theme of the page has the colors of reports.
    #[test]
    fn the_page_and_reports_have_one_palette() {
        let theme = include_str!("../../page/theme.css");
        let (light, _) = theme.split_once("data-theme").unwrap();
        for (role, name) in [
            (MarkRole::Target, "target"),
            (MarkRole::Zone, "zone"),
            (MarkRole::Goal, "goal"),
            (MarkRole::Range, "range"),
            (MarkRole::Link, "link"),
        ] {
            let (empty, full) = palette::of_role(role);
            for (name, color) in [(name.to_owned(), empty), (format!("{name}-full"), full)] {
                let line = format!("--{name}: {};", palette::css(color));
                assert!(light.contains(&line), "{line}");
            }
        }
        let item = format!("--item: {};", palette::css(palette::ITEM));
        assert!(light.contains(&item), "{item}");
    }

    /// The curves, the faults, marks, skills, columns and events of a mission, the end of a run, cut links, and the
    /// player of a log, and the projection of the room.
    #[test]
    fn the_tests_of_the_page_succeed() {
        for file in [
            "curves",
            "own_faults",
            "marks",
            "state",
            "links",
            "skills",
            "player",
            "mission",
            "branch",
            "choice",
            "draft",
            "faults",
            "embedded",
            "late_events",
            "geometry",
            "worker",
        ] {
            super::node(&mut Command::new("node"), &format!("{file}.test.js"));
        }
    }
}
