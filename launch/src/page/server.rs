//! The HTTP server of the page.

use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use axum::body::Bytes;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{DefaultBodyLimit, Path, Query, Request, State};
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderValue, StatusCode};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use proto::control::ControlCommand;
use serde::Deserialize;
use serde_json::json;
use tokio::net::TcpListener;
use tokio::sync::oneshot;
use tokio::time::timeout;

use super::assets;
use super::gate::{AccessControl, SUBPROTOCOL};
use super::live::Live;
use super::logged::Logged;

/// The maximum size of a command in bytes, as on the control topic.
const COMMAND_MAX: usize = 256 * 1024;

/// The time for pages to receive the end of the run. A browser on a busy machine first processes all earlier frames.
pub const END_OF_RUN_TIMEOUT: Duration = Duration::from_secs(10);

/// The time for pages to receive the end of this process after an interrupt.
pub const INTERRUPT_TIMEOUT: Duration = Duration::from_secs(1);

/// The content security policy: the page runs only its own code, connects only to this server, and is not shown in a frame.
const POLICY: &str = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; \
                      frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

pub enum Shown {
    Live(Arc<Live>),
    Logged(Box<Logged>),
}

/// Serves the page until `until` resolves, and then at most for the returned time.
pub async fn serve(
    listener: TcpListener,
    token: String,
    shown: Shown,
    until: impl Future<Output = Duration> + Send + 'static,
) -> anyhow::Result<()> {
    let port = listener.local_addr().context("the page's socket")?.port();
    let gate = Arc::new(AccessControl::new(port, token));
    let live = match &shown {
        Shown::Live(live) => Some(Arc::clone(live)),
        Shown::Logged(_) => None,
    };
    let routes = Router::new()
        .route("/", get(|| async { file("index.html") }))
        .route(
            "/assets/{*path}",
            get(|Path(path): Path<String>| async move { file(&path) }),
        )
        .merge(match shown {
            Shown::Live(live) => Router::new()
                .route("/api/run", get(about_live))
                .route("/api/live", get(send_live))
                .route("/api/control", post(control))
                .layer(DefaultBodyLimit::max(COMMAND_MAX))
                .with_state(live),
            Shown::Logged(logged) => Router::new()
                .route("/api/run", get(about_logged))
                .route("/api/views", get(views))
                .route("/api/overview", get(overview))
                .route("/api/page", get(accompany))
                .route("/api/corners", get(corners))
                .route("/api/events", get(events))
                .with_state(Arc::from(logged)),
        })
        .layer(middleware::from_fn_with_state(gate, guard));
    let (stop, stopped) = oneshot::channel();
    let server = axum::serve(listener, routes).with_graceful_shutdown(async {
        // An error means that the server has failed and the receiver was dropped.
        let _ = stop.send(until.await);
    });
    let mut server = tokio::spawn(server.into_future());
    tokio::select! {
        // First, because an idle server ends at the same time.
        biased;
        Ok(patience) = stopped => {
            // Pages that have not received all frames by then are disconnected.
            let drained = async {
                // Incomplete requests are not waited for.
                let _ = timeout(INTERRUPT_TIMEOUT, server).await;
                // The graceful shutdown does not wait for WebSockets.
                if let Some(live) = live {
                    live.wait_for_no_pages().await;
                }
            };
            let _ = timeout(patience, drained).await;
            Ok(())
        }
        ended = &mut server => ended.context("the page's server")?.context("the page's server"),
    }
}

/// Checks a request and adds the security headers to the response.
async fn guard(State(gate): State<Arc<AccessControl>>, request: Request, next: Next) -> Response {
    let checked = gate.check(request.method(), request.uri().path(), request.headers());
    let mut response = match checked {
        Ok(()) => next.run(request).await,
        Err(refusal) => refuse(refusal.status(), &refusal.to_string()),
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (CONTENT_SECURITY_POLICY, POLICY),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (REFERRER_POLICY, "no-referrer"),
        (CACHE_CONTROL, "no-store"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

fn refuse(status: StatusCode, why: &str) -> Response {
    let why = why.replace(char::is_control, " ");
    (status, Json(json!({"error": why}))).into_response()
}

fn file(path: &str) -> Response {
    match assets::find(path) {
        Some(asset) => ([(CONTENT_TYPE, asset.media_type)], asset.bytes).into_response(),
        None => refuse(StatusCode::NOT_FOUND, "no such file"),
    }
}

async fn about_live(State(live): State<Arc<Live>>) -> Response {
    Json(live.about()).into_response()
}

async fn send_live(State(live): State<Arc<Live>>, upgrade: WebSocketUpgrade) -> Response {
    upgrade
        .protocols([SUBPROTOCOL])
        .on_upgrade(move |page| async move { live.serve_page(page).await })
}

/// Sends a command as in `docs/CONTROL.md` to the world and returns its reply.
async fn control(State(live): State<Arc<Live>>, body: Bytes) -> Response {
    let command: ControlCommand = match serde_json::from_slice(&body) {
        Ok(command) => command,
        Err(error) => return refuse(StatusCode::BAD_REQUEST, &error.to_string()),
    };
    match live.send_command(command).await {
        Ok(reply) => Json(reply).into_response(),
        Err(error) => refuse(StatusCode::BAD_GATEWAY, &format!("{error:#}")),
    }
}

async fn about_logged(State(logged): State<Arc<Logged>>) -> Response {
    Json(logged.about()).into_response()
}

async fn accompany(State(logged): State<Arc<Logged>>, upgrade: WebSocketUpgrade) -> Response {
    upgrade
        .protocols([SUBPROTOCOL])
        .on_upgrade(move |page| async move { logged.count_page(page).await })
}

#[derive(Deserialize)]
struct ViewsQuery {
    from: u64,
    count: u64,
    #[serde(default = "one")]
    step: u64,
}

fn one() -> u64 {
    1
}

async fn views(State(logged): State<Arc<Logged>>, Query(query): Query<ViewsQuery>) -> Response {
    Json(logged.views(query.from, query.count, query.step)).into_response()
}

async fn overview(State(logged): State<Arc<Logged>>) -> Response {
    Json(logged.overview()).into_response()
}

#[derive(Deserialize)]
struct CornersQuery {
    robot: usize,
}

async fn corners(State(logged): State<Arc<Logged>>, Query(query): Query<CornersQuery>) -> Response {
    Json(logged.corners(query.robot)).into_response()
}

async fn events(State(logged): State<Arc<Logged>>) -> Response {
    Json(logged.events()).into_response()
}
