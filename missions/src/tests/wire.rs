//! The files for agents in other languages, generated from the Rust types: `docs/wire.schema.json` and
//! `docs/wire.vectors.json` (docs/WIRE.md).

mod trace;
mod vectors;

use proto::allocation::OPEN_MESSAGE_MAX;
use proto::codec::LIMIT_BYTES;
use proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION};
use proto::mission::items::{ItemsAction, ItemsBulletin, ItemsKnowledge, ItemsReading};
use proto::mission::{MAX_ACTION_BYTES, MAX_KNOWLEDGE_BYTES, MAX_READING_BYTES};
use proto::telemetry::NoteKind;
use proto::tick::{Report, TICK_LIMIT_BYTES, ToAgent};
use scenario::mission::data::MissionVocabulary;
use scenario::testkit::check_generated;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::{Registry, observe, push, service};
use trace::Types;

/// The content of messages without parts.
#[derive(serde::Deserialize)]
struct Nothing;

/// Describes a mission's messages: reading, action, shared knowledge and the content of bulletins. Types of a mission
/// without items are encoded on their own, and their bytes are the content of the variant `open`.
fn mission<R, A, K, B>(types: &mut Types, form: &str, vocabulary: &MissionVocabulary) -> Value
where
    R: DeserializeOwned,
    A: DeserializeOwned + 'static,
    K: DeserializeOwned,
    B: DeserializeOwned + 'static,
{
    fn of<T: DeserializeOwned + 'static>(types: &mut Types) -> Value {
        let is_nothing = std::any::TypeId::of::<T>() == std::any::TypeId::of::<Nothing>();
        if is_nothing {
            Value::Null
        } else {
            types.trace::<T>()
        }
    }
    let notes = (0..).zip(vocabulary.notes);
    let notes = notes.map(
        |(index, note)| json!({ "number": u32::from(NoteKind::Mission(index)), "name": note }),
    );
    json!({
        "variant": form,
        "reading": types.trace::<R>(),
        "action": of::<A>(types),
        "shared_knowledge": types.trace::<K>(),
        "bulletin": of::<B>(types),
        "bulletin_keys": vocabulary.bulletins,
        "notes": Vec::from_iter(notes),
    })
}

fn missions(types: &mut Types) -> Value {
    let mut all = json!({});
    for data in Registry::built_in().vocabulary().missions {
        let vocabulary = data.vocabulary();
        all[data.name()] = match data.name() {
            "waste" => mission::<ItemsReading, ItemsAction, ItemsKnowledge, ItemsBulletin>(
                types,
                "items",
                &vocabulary,
            ),
            "service" => {
                use service::bus::{Action, SensorReading, SharedKnowledge};
                mission::<SensorReading, Action, SharedKnowledge, Nothing>(
                    types,
                    "open",
                    &vocabulary,
                )
            }
            "push" => {
                use push::bus::{BarReport, SensorReading, SharedKnowledge};
                mission::<SensorReading, Nothing, SharedKnowledge, BarReport>(
                    types,
                    "open",
                    &vocabulary,
                )
            }
            "observe" => {
                use observe::bus::{ObserveAction, SensorReading, SharedSightings};
                mission::<SensorReading, ObserveAction, SharedSightings, Nothing>(
                    types,
                    "open",
                    &vocabulary,
                )
            }
            other => panic!("describe the messages of {other} here"),
        };
    }
    all
}

fn schema() -> String {
    let mut types = Types::default();
    types.trace::<JoinRequest>();
    types.trace::<JoinReply>();
    types.trace::<ToAgent>();
    types.trace::<Report>();
    types.trace::<proto::team::Broadcast>();
    let missions = missions(&mut types);
    let limits = json!({
        "message": LIMIT_BYTES,
        "tick": TICK_LIMIT_BYTES,
        "reading": MAX_READING_BYTES,
        "action": MAX_ACTION_BYTES,
        "shared_knowledge": MAX_KNOWLEDGE_BYTES,
        "bulletin": MAX_KNOWLEDGE_BYTES,
        "open_message": OPEN_MESSAGE_MAX,
    });
    let mut text = format!("{{\n\"version\": {PROTOCOL_VERSION},\n\"limits\": {limits},\n");
    text += &format!("\"missions\": {{\n{}\n}},\n", lines(&missions));
    text + &format!(
        "\"types\": {{\n{}\n}}\n}}\n",
        lines(&json!(types.described()))
    )
}

/// Writes an object with one line per entry.
fn lines(object: &Value) -> String {
    let entries = object.as_object().into_iter().flatten();
    let lines = entries.map(|(name, value)| format!("{}: {value}", json!(name)));
    Vec::from_iter(lines).join(",\n")
}

#[test]
fn the_schema_of_the_bus_is_up_to_date() {
    check_generated("docs/wire.schema.json", &schema());
}

/// The bytes stand at the beginning of the lines of the block.
#[test]
fn the_tick_in_bytes_on_the_page_is_a_test_vector() {
    let page = include_str!("../../../docs/WIRE.md");
    let block = page.split("```text\n").nth(1).unwrap();
    let lines = block.split("```").next().unwrap().lines();
    let bytes = lines.map(|line| line.split("  ").next().unwrap().replace(' ', ""));
    let message = format!("\"message\":\"{}\"", bytes.collect::<String>());
    assert!(vectors::file().contains(&message), "{message}");
}

#[test]
fn the_test_vectors_of_the_bus_are_up_to_date() {
    check_generated("docs/wire.vectors.json", &vectors::file());
}
