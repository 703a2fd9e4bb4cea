//! Only the page itself can change a run: no page of another origin, no rebound host name, and no client without the
//! token of the link.

use alliance_tests::harness::{Lab, command_line};
use alliance_tests::team::Team;

use super::client::Page;

const KILL: &str = r#"{"fault": {"fault": {"kill": "gold"}}}"#;

#[test]
fn only_the_page_can_kill_a_robot() {
    let lab = Lab::new();
    let mut team = Team::start_with_page(&lab, "--speed 2x --limit 60");
    let (page, _) = Page::of(&mut team);
    team.wait_for_row("events.csv", &[",activated,"]);
    let host = page.host();
    let origin_of_page = format!("http://{host}");
    let bearer = format!("Bearer {}", page.token);
    let wrong = format!("Bearer {}", "0".repeat(32));

    let post = |host: &str, origin: Option<&str>, bearer: Option<&str>| {
        let mut headers = vec![("Host", host), ("Content-Type", "application/json")];
        headers.extend(origin.map(|origin| ("Origin", origin)));
        headers.extend(bearer.map(|bearer| ("Authorization", bearer)));
        page.ask("POST /api/control", &headers, KILL)
    };
    // Another site with the token, a sandboxed frame, another server on this machine, and a request without an
    // origin.
    for origin in [
        Some("http://evil.example"),
        Some("null"),
        Some("http://127.0.0.1:1"),
        None,
    ] {
        let (status, body) = post(&host, origin, Some(&bearer));
        assert_eq!(status, 403, "{origin:?}: {body}");
    }
    // A foreign host name that resolves to this machine.
    let rebound = format!("evil.example:{}", page.port);
    let (status, _) = post(&rebound, Some(&format!("http://{rebound}")), Some(&bearer));
    assert_eq!(status, 403);
    // The right origin without the token.
    assert_eq!(post(&host, Some(&origin_of_page), None).0, 401);
    assert_eq!(post(&host, Some(&origin_of_page), Some(&wrong)).0, 401);
    // Reading needs the token and the origin, too.
    let (status, body) = page.ask("GET /api/run", &[("Host", &host)], "");
    assert_eq!((status, body.contains("scenario")), (401, false));
    assert!(page.connect("http://evil.example", &page.token).is_none());
    assert!(page.connect(&origin_of_page, "").is_none());
    // A text that is no command is refused in one line.
    let headers = [
        ("Host", host.as_str()),
        ("Origin", &origin_of_page),
        ("Authorization", &bearer),
    ];
    let (status, body) = page.ask("POST /api/control", &headers, r#"{"kill": "gold"}"#);
    assert_eq!(status, 400);
    assert!(
        body.starts_with(r#"{"error":"unknown variant `kill`"#),
        "{body}"
    );

    let pid = team.pid("gold");
    assert!(command_line(pid).is_some());
    let listed = page.control(r#""list""#);
    assert_eq!(listed, serde_json::json!({"faults": []}));
    // The page itself may send the command.
    let armed = page.control(KILL);
    assert_eq!(armed["armed"]["id"], "f1");
    let gone = team.wait_for_row("events.csv", &[",gone,gold,"]);
    let t_ms: u64 = gone.split(',').next().unwrap().parse().unwrap();
    assert_eq!(armed["armed"]["t_ms"], t_ms);
    assert!(command_line(pid).is_none());
    page.control(r#"{"clock": {"speed": null}}"#);
    team.wait().expect(1);
}
