//! TypeScript declarations of the data that the page receives, for type checks of its code:
//! `launch/page-tests/types.d.ts`, generated from the Rust types.

use proto::view::{Corner, View};
use scenario::testkit::check_generated;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value};

/// Returns the JSON schemas of all types. They describe serialization: the page receives even fields that are optional
/// for parsing.
fn definitions() -> Map<String, Value> {
    let mut generator = SchemaSettings::draft2020_12()
        .for_serialize()
        .into_generator();
    generator.subschema_for::<View>();
    generator.subschema_for::<Corner>();
    generator.take_definitions(true)
}

/// Returns the TypeScript declaration file.
fn declarations() -> String {
    let mut text = String::from(
        "// Generated from the Rust types by the test `the_page_types_are_up_to_date`. Do not edit.\n",
    );
    for (name, schema) in &definitions() {
        text += &format!(
            "\n{}export type {name} = {};\n",
            comment(schema, ""),
            type_of(schema, "")
        );
    }
    text
}

/// Returns the first paragraph of a schema's description as a comment.
fn comment(schema: &Value, indent: &str) -> String {
    let description = schema["description"].as_str();
    let first = description.and_then(|description| description.split("\n\n").next());
    let line = first.map(|first| first.replace('\n', " ").replace("*/", "* /"));
    line.map_or_else(String::new, |line| {
        format!("{indent}/** {line} */\n{indent}")
    })
}

/// Converts a schema to a TypeScript type.
fn type_of(schema: &Value, indent: &str) -> String {
    if let Some(path) = schema["$ref"].as_str() {
        return path.rsplit('/').next().unwrap_or_default().to_owned();
    }
    if let Some(only) = schema.get("const") {
        return only.to_string();
    }
    let several = |values: &Vec<Value>, of: &dyn Fn(&Value) -> String| {
        let mut all: Vec<String> = values.iter().map(of).collect();
        all.dedup();
        all.join(" | ")
    };
    for key in ["oneOf", "anyOf"] {
        if let Some(choices) = schema[key].as_array() {
            return several(choices, &|choice| type_of(choice, indent));
        }
    }
    if let Some(values) = schema["enum"].as_array() {
        return several(values, &Value::to_string);
    }
    if let Some(kinds) = schema["type"].as_array() {
        return several(kinds, &|kind| {
            let mut one = schema.clone();
            one["type"] = kind.clone();
            type_of(&one, indent)
        });
    }
    match schema["type"].as_str() {
        Some("integer" | "number") => "number".to_owned(),
        Some(plain @ ("string" | "boolean" | "null")) => plain.to_owned(),
        Some("array") => array(schema, indent),
        Some("object") => object(schema, indent),
        _ => "unknown".to_owned(),
    }
}

fn array(schema: &Value, indent: &str) -> String {
    let items = type_of(&schema["items"], indent);
    match (
        schema["prefixItems"].as_array(),
        schema["minItems"].as_u64(),
        schema["maxItems"].as_u64(),
    ) {
        (Some(places), ..) => {
            let places: Vec<String> = places.iter().map(|place| type_of(place, indent)).collect();
            format!("[{}]", places.join(", "))
        }
        (None, Some(least), Some(most)) if least == most => {
            format!("[{}]", vec![items; least as usize].join(", "))
        }
        _ => format!("({items})[]"),
    }
}

fn object(schema: &Value, indent: &str) -> String {
    let Some(fields) = schema["properties"].as_object() else {
        return format!(
            "Record<string, {}>",
            type_of(&schema["additionalProperties"], indent)
        );
    };
    let required = schema["required"].as_array();
    let inner = format!("{indent}  ");
    let lines = fields.iter().map(|(name, field)| {
        let is_required =
            required.is_some_and(|names| names.iter().any(|required| required == name));
        let mark = if is_required { "" } else { "?" };
        let key = match name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            true => name.clone(),
            false => format!("\"{name}\""),
        };
        let comment_line = comment(field, &inner);
        let lead = if comment_line.is_empty() {
            inner.clone()
        } else {
            comment_line
        };
        format!("{lead}{key}{mark}: {};\n", type_of(field, &inner))
    });
    format!("{{\n{}{indent}}}", lines.collect::<String>())
}

#[test]
fn the_page_types_are_up_to_date() {
    let made = declarations();
    check_generated("launch/page-tests/types.d.ts", &made);
    // Declarations that the page depends on.
    for line in [
        "now: SimTime;",
        "export type SimTime = number;",
        "carrier: RobotId | null;",
        "position: [number, number];",
    ] {
        assert!(made.contains(line), "{line} in:\n{made}");
    }
}
