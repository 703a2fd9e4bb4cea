//! Tests of the published schema.

use std::collections::BTreeSet;

use super::*;
use scenario::fault::Fault;

/// Returns the names of the common faults in the schema.
fn vocabulary() -> BTreeSet<String> {
    let schema = schema();
    let faults = schema["$defs"]["Fault"]["oneOf"].as_array().unwrap();
    // The last entry stands for the faults of missions.
    let (_, common) = faults.split_last().unwrap();
    let names = common.iter().map(|fault| fault["required"][0].as_str());
    names.map(|name| name.unwrap().to_owned()).collect()
}

#[test]
fn the_schema_describes_requests_and_replies() {
    let schema = schema();
    assert_eq!(schema["title"], "Request");
    assert_eq!(schema["reply"]["$ref"], "#/$defs/Reply");
    assert!(schema["$defs"]["Reply"]["oneOf"].is_array(), "{schema:#}");
    let nonce = &schema["properties"]["nonce"];
    assert_eq!(nonce["type"], "string");
    assert_eq!(vocabulary(), Fault::COMMON_NAMES.map(str::to_owned).into());
    let faults = schema["$defs"]["Fault"]["oneOf"].as_array().unwrap();
    assert!(faults.iter().all(|fault| fault["description"].is_string()));
}
