//! Only the page itself can change a run: not a page elsewhere in the same browser, not one that has made its own name point to
//! this machine, and nobody without the token in the link.

use super::client::Page;
use crate::harness::{Lab, command_line};
use crate::team::Team;

const KILL: &str = r#"{"fault": {"fault": {"kill": "gold"}}}"#;

#[test]
fn nobody_but_the_page_can_kill_a_robot() {
    let lab = Lab::new();
    let arguments = ["--speed", "2x", "--limit", "60"];
    let mut team = Team::start_with_page(&lab, &arguments);
    team.wait_for_page();
    let page = Page::in_words(&team.launcher().stderr());
    team.wait_for_row("events.csv", &[",activated,"]);
    let host = page.host();
    let own = format!("http://{host}");
    let bearer = format!("Bearer {}", page.token);
    let wrong = format!("Bearer {}", "0".repeat(32));

    let post = |host: &str, origin: Option<&str>, bearer: Option<&str>| {
        let mut headers = vec![("Host", host), ("Content-Type", "application/json")];
        headers.extend(origin.map(|origin| ("Origin", origin)));
        headers.extend(bearer.map(|bearer| ("Authorization", bearer)));
        page.ask("POST /api/control", &headers, KILL)
    };
    // Another site, even if it had the token; a sandboxed frame; another server on this machine; no browser page at all.
    for origin in [
        Some("http://evil.example"),
        Some("null"),
        Some("http://127.0.0.1:1"),
        None,
    ] {
        let (status, why) = post(&host, origin, Some(&bearer));
        assert_eq!(status, 403, "{origin:?}: {why}");
    }
    // A name that somebody has made point to this machine.
    let rebound = format!("evil.example:{}", page.port);
    let (status, _) = post(&rebound, Some(&format!("http://{rebound}")), Some(&bearer));
    assert_eq!(status, 403);
    // The right place without the link.
    assert_eq!(post(&host, Some(&own), None).0, 401);
    assert_eq!(post(&host, Some(&own), Some(&wrong)).0, 401);
    // Nor is anything told to those.
    let (status, said) = page.ask("GET /api/run", &[("Host", &host)], "");
    assert_eq!((status, said.contains("scenario")), (401, false));
    assert!(page.connect("http://evil.example", &page.token).is_none());
    assert!(page.connect(&own, "").is_none());
    // What is no command is refused in one line.
    let headers = [
        ("Host", host.as_str()),
        ("Origin", &own),
        ("Authorization", &bearer),
    ];
    let (status, why) = page.ask("POST /api/control", &headers, r#"{"kill": "gold"}"#);
    assert_eq!(status, 400);
    assert!(
        why.starts_with(r#"{"error":"unknown variant `kill`"#),
        "{why}"
    );

    let pid = team.pid("gold");
    assert!(command_line(pid).is_some());
    let listed = page.control(r#""list""#);
    assert_eq!(listed, serde_json::json!({"faults": []}));
    // The page itself.
    let armed = page.control(KILL);
    assert_eq!(armed["armed"]["id"], "f1");
    let gone = team.wait_for_row("events.csv", &[",gone,gold,"]);
    let t_ms: u64 = gone.split(',').next().unwrap().parse().unwrap();
    assert_eq!(armed["armed"]["t_ms"], t_ms);
    assert!(command_line(pid).is_none());
    page.control(r#"{"clock": {"speed": null}}"#);
    team.wait().expect(1);
}
