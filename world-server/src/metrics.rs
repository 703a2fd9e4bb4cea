//! Metrics of a live world for Prometheus, as the text of OpenMetrics 1.0 under `/metrics`, and its health under
//! `/healthz`.
//!
//! The world stores its counts here between ticks. A request reads only the stored counts, so no reader delays the run.

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use axum::Router;
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::routing::get;
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::Registry;
use scenario::Problem;
use tokio::time::Instant;

use crate::simulation::Counts;

/// The media type of OpenMetrics, section "Overall Structure".
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// The time over which ticks per second are averaged. A longer time smooths more and shows a standstill later.
const RATE_WINDOW: Duration = Duration::from_secs(2);

/// The time without an update of the metrics after which a world is not healthy, far above the interval of the updates. A
/// paused run has updates, too.
const UPDATE_MAX: Duration = Duration::from_secs(5);

/// A gauge of a fractional number.
type NumberGauge = Gauge<f64, AtomicU64>;

/// The values of a run that a reader may request.
pub struct Metrics {
    registry: Arc<Registry>,
    health: Arc<Health>,
    ticks: Counter,
    simulated_s: NumberGauge,
    ticks_per_s: NumberGauge,
    agents: Gauge,
    stalls: Counter,
    dropped: Counter,
    /// The ticks at the start of the present window of the rate.
    window: Option<(Instant, u64)>,
}

impl Metrics {
    /// Creates the metrics of a run without ticks.
    #[must_use]
    pub fn new(run: &str, mission: &'static str) -> Self {
        let labels = [("run", run.to_owned()), ("mission", mission.to_owned())];
        let mut registry = Registry::with_prefix("alliance");
        let (ticks, stalls, dropped) = (Counter::default(), Counter::default(), Counter::default());
        let (simulated_s, ticks_per_s) = (NumberGauge::default(), NumberGauge::default());
        let agents: Gauge = Gauge::default();
        registry.register("run", "Name and mission of the run", Info::new(labels));
        let text = "Ended ticks of the run";
        registry.register("ticks", text, ticks.clone());
        let text = "Simulated time of the run in seconds";
        registry.register("simulated_seconds", text, simulated_s.clone());
        let text = "Ended ticks per second of wall-clock time, over the last two seconds";
        registry.register("ticks_per_second", text, ticks_per_s.clone());
        let text = "Agents that take part in the run";
        registry.register("agents_present", text, agents.clone());
        let text = "Times that the team continued without an agent that did not answer";
        registry.register("stalls", text, stalls.clone());
        let text = "Broadcasts that a receiver did not get, over all receivers";
        registry.register("messages_dropped", text, dropped.clone());
        Self {
            registry: Arc::new(registry),
            health: Arc::new(Health::new(Instant::now())),
            ticks,
            simulated_s,
            ticks_per_s,
            agents,
            stalls,
            dropped,
            window: None,
        }
    }

    /// Stores the state of the run at a moment.
    pub fn update(&mut self, counts: &Counts, step_ms: u64, now: Instant) {
        self.health.update(now);
        self.ticks.inner().store(counts.ticks, Ordering::Relaxed);
        self.stalls.inner().store(counts.stalls, Ordering::Relaxed);
        let dropped = self.dropped.inner();
        dropped.store(counts.messages_dropped, Ordering::Relaxed);
        self.agents.set(counts.agents as i64);
        let simulated_ms = counts.ticks * step_ms;
        self.simulated_s.set(simulated_ms as f64 / 1000.0);
        let (since, ticks) = *self.window.get_or_insert((now, counts.ticks));
        let passed = now.duration_since(since);
        if passed >= RATE_WINDOW {
            let ended = counts.ticks.saturating_sub(ticks);
            self.ticks_per_s.set(ended as f64 / passed.as_secs_f64());
            self.window = Some((now, counts.ticks));
        }
    }

    /// Answers requests on an address until the process ends.
    ///
    /// # Errors
    /// Fails if the address is not free.
    pub fn serve(&self, address: SocketAddr) -> Result<(), Problem> {
        let listener = bind(address)?;
        let registry = Arc::clone(&self.registry);
        let health = Arc::clone(&self.health);
        let metrics = async move || ([(CONTENT_TYPE, OPEN_METRICS)], text(&registry));
        let healthz = async move || health.answer(Instant::now());
        let app = Router::new()
            .route("/metrics", get(metrics))
            .route("/healthz", get(healthz));
        let listener = tokio::net::TcpListener::from_std(listener)
            .map_err(|error| refused(address, &error))?;
        tokio::spawn(async move {
            if let Err(error) = axum::serve(listener, app).await {
                tracing::warn!(%error, "the metrics are no longer served");
            }
        });
        Ok(())
    }
}

/// The time of the latest update.
struct Health {
    start: Instant,
    /// The time of the latest update since `start`, ms.
    updated_ms: AtomicU64,
}

impl Health {
    fn new(start: Instant) -> Self {
        Self {
            start,
            updated_ms: AtomicU64::new(0),
        }
    }

    fn update(&self, now: Instant) {
        let passed = now.duration_since(self.start).as_millis();
        self.updated_ms.store(passed as u64, Ordering::Relaxed);
    }

    /// Returns the answer to a request for the health.
    fn answer(&self, now: Instant) -> (StatusCode, String) {
        let updated = Duration::from_millis(self.updated_ms.load(Ordering::Relaxed));
        let age = now.duration_since(self.start).saturating_sub(updated);
        if age <= UPDATE_MAX {
            return (StatusCode::OK, "ok\n".to_owned());
        }
        let text = format!(
            "the world has completed no update for {} s\n",
            age.as_secs()
        );
        (StatusCode::SERVICE_UNAVAILABLE, text)
    }
}

/// Opens the listener at an address.
///
/// # Errors
/// Fails if the address is not free.
pub fn bind(address: SocketAddr) -> Result<TcpListener, Problem> {
    let bound = TcpListener::bind(address).and_then(|listener| {
        listener.set_nonblocking(true)?;
        Ok(listener)
    });
    bound.map_err(|error| refused(address, &error))
}

fn refused(address: SocketAddr, error: &std::io::Error) -> Problem {
    let remedy = "use a free address of this machine, such as 127.0.0.1:9464";
    Problem::with_source(format!("--metrics {address}"), error.to_string(), remedy)
}

/// Returns all metrics as text.
fn text(registry: &Registry) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = encode(&mut text, registry);
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_contains_the_counts_of_the_run() {
        let mut metrics = Metrics::new("waste-1", "waste");
        let start = Instant::now();
        let counts = |ticks| Counts {
            ticks,
            agents: 2,
            stalls: 1,
            messages_dropped: 7,
        };
        metrics.update(&counts(100), 50, start);
        metrics.update(&counts(200), 50, start + Duration::from_secs(4));
        let text = text(&metrics.registry);
        for line in [
            "alliance_run_info{run=\"waste-1\",mission=\"waste\"} 1",
            "alliance_ticks_total 200",
            "alliance_simulated_seconds 10.0",
            "alliance_ticks_per_second 25.0",
            "alliance_agents_present 2",
            "alliance_stalls_total 1",
            "alliance_messages_dropped_total 7",
            "# EOF",
        ] {
            assert!(
                text.lines().any(|found| found == line),
                "{line} in:\n{text}"
            );
        }
    }

    #[test]
    fn a_world_without_updates_is_not_healthy() {
        let start = Instant::now();
        let health = Health::new(start);
        let after = |seconds| start + Duration::from_secs(seconds);
        health.update(after(10));
        assert_eq!(
            health.answer(after(15)),
            (StatusCode::OK, "ok\n".to_owned())
        );
        let text = "the world has completed no update for 6 s\n".to_owned();
        let expected = (StatusCode::SERVICE_UNAVAILABLE, text);
        assert_eq!(health.answer(after(16)), expected);
    }

    #[test]
    fn an_address_in_use_is_refused() {
        let taken = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = taken.local_addr().unwrap();
        let refused = bind(address).unwrap_err().to_string();
        assert!(
            refused.starts_with(&format!("--metrics {address}: ")),
            "{refused}"
        );
        assert!(refused.ends_with("such as 127.0.0.1:9464"), "{refused}");
    }
}
