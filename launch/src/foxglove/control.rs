//! The service with which clients control the run.

use anyhow::Context;
use foxglove::Schema;
use foxglove::websocket::service::{Request, Service, ServiceSchema};
use proto::control::ControlCommand;

use crate::relay::relay_command;

/// The name of the service.
const CONTROL: &str = "/alliance/control";

/// The encoding of requests and replies.
const JSON: &str = "json";

/// Creates the service for the run with this id. A request is a command of the control topic, and a response is the reply.
pub fn service(run: &str) -> Service {
    let run = run.to_owned();
    let any = |name: &str| Schema::new(name, "jsonschema", br#"{"type": "object"}"#);
    let types = ServiceSchema::new("alliance.Control")
        .with_request(JSON, any("alliance.ControlRequest"))
        .with_response(JSON, any("alliance.ControlReply"));
    Service::builder(CONTROL, types).async_handler_fn(move |request| answer(run.clone(), request))
}

/// Sends a command to the world, and returns its reply as JSON.
async fn answer(run: String, request: Request) -> Result<Vec<u8>, String> {
    let answer = async {
        let command: ControlCommand =
            serde_json::from_slice(request.payload()).context("not a control command")?;
        Ok(relay_command(&run, command).await?.into_bytes())
    };
    answer
        .await
        .map_err(|error: anyhow::Error| format!("{error:#}"))
}
