//! Properties of any sealed text as a request. The fuzz target and the test over the corpus in `proto` use them.

use missions::waste::data::default_scenario;
use proto::control::ControlCommand;
use proto::control::wire::{ControlTopic, Format};
use proto::keys::KeyExpressions;
use proto::secret::Secret;
use scenario::Catalog;

/// Returns the name of the request's command, as the corpus files begin, or `None` if the text is no request.
///
/// A readable request survives a round trip in both forms. Another text is refused in one line. Nothing is read
/// without a seal.
///
/// # Panics
/// Panics if one of these properties does not hold.
#[must_use]
pub fn command_of(text: &[u8]) -> Option<&'static str> {
    let secret = Secret::from_token("token");
    let wire = ControlTopic::new(&KeyExpressions::new("run"), secret.clone());
    let read = |form, payload: &[u8], attachment: Option<&[u8]>| {
        let read = wire.read_request(form, payload, attachment);
        if let Err(error) = &read {
            let line = error.to_string();
            assert!(!line.is_empty() && !line.chars().any(char::is_control));
        }
        read
    };
    for form in [Format::Json, Format::Bincode] {
        assert!(read(form, text, None).is_err());
        assert!(read(form, text, Some(text)).is_err());
    }
    // The same bytes as bincode are another request or none.
    let mut sealed = text.to_vec();
    sealed.extend(secret.seal_of(wire.key(), text));
    if let Ok(request) = read(Format::Bincode, &sealed, None) {
        assert!(wire.write_request(Format::Bincode, &request).is_ok());
    }

    let mark = secret.mark_text(wire.key(), text);
    let request = read(Format::Json, text, Some(mark.as_bytes())).ok()?;
    for form in [Format::Json, Format::Bincode] {
        let written = wire
            .write_request(form, &request)
            .expect("what was read can be written");
        let attachment = written.attachment.as_deref().map(str::as_bytes);
        let again = read(form, &written.payload, attachment);
        assert_eq!(again.expect("the written request can be read"), request);
    }
    Some(match request.command {
        ControlCommand::Fault(order) => {
            // The check and the printing must not panic.
            let scenario = default_scenario();
            let _ = order
                .check(&scenario, &Catalog::new(&scenario))
                .map_err(|error| error.to_string());
            let _ = order.to_string();
            "fault"
        }
        ControlCommand::Clear(_) => "clear",
        ControlCommand::List => "list",
        ControlCommand::Status => "status",
        ControlCommand::Describe => "describe",
        ControlCommand::Clock(_) => "clock",
    })
}
