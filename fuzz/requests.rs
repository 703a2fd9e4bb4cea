//! What holds for any text that a member of the run seals as a request; part of the fuzz target and of proto's test over the
//! corpus.

use alliance_proto::control::ControlCommand;
use alliance_proto::control::wire::{Form, Wire};
use alliance_proto::keys::Keys;
use alliance_proto::scenario::Catalog;
use alliance_proto::secret::Secret;
use missions::waste::data::default_scenario;

/// Name of the request's command, as the corpus's files begin; `None` if the text is no request. What is read comes back from
/// either form, what is not is refused in one line, and without its seal nothing is read.
///
/// # Panics
/// When that is not so.
#[must_use]
pub fn command_of(text: &[u8]) -> Option<&'static str> {
    let secret = Secret::of("token");
    let wire = Wire::new(&Keys::new("run"), secret.clone());
    let read = |form, payload: &[u8], attachment: Option<&[u8]>| {
        let read = wire.read_request(form, payload, attachment);
        if let Err(error) = &read {
            let line = error.to_string();
            assert!(!line.is_empty() && !line.chars().any(char::is_control));
        }
        read
    };
    for form in [Form::Json, Form::Bincode] {
        assert!(read(form, text, None).is_err());
        assert!(read(form, text, Some(text)).is_err());
    }
    // As bincode they are something else, or nothing.
    let mut sealed = text.to_vec();
    sealed.extend(secret.mark(wire.key(), text));
    if let Ok(request) = read(Form::Bincode, &sealed, None) {
        assert!(wire.write_request(Form::Bincode, &request).is_ok());
    }

    let mark = secret.mark_text(wire.key(), text);
    let request = read(Form::Json, text, Some(mark.as_bytes())).ok()?;
    for form in [Form::Json, Form::Bincode] {
        let written = wire
            .write_request(form, &request)
            .expect("what was read can be written");
        let attachment = written.attachment.as_deref().map(str::as_bytes);
        let again = read(form, &written.payload, attachment);
        assert_eq!(again.expect("and read again"), request);
    }
    Some(match request.command {
        ControlCommand::Fault(order) => {
            // Neither the check nor the printing panics.
            let scenario = default_scenario();
            let _ = order
                .check(&scenario, &Catalog::of(&scenario))
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
