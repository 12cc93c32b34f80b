//! The contract that the dashboard's types are generated from. `UPDATE=1 cargo test -p halcyon-gateway --test openapi` writes it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]

use std::collections::BTreeSet;

use serde_json::Value;

#[test]
fn the_dashboards_copy_of_the_contract_is_current() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../web/src/api/openapi.json");
    let current = halcyon_gateway::openapi_json();
    if std::env::var_os("UPDATE").is_some() {
        std::fs::create_dir_all(std::path::Path::new(path).parent().unwrap()).unwrap();
        std::fs::write(path, &current).unwrap();
    }
    let held = std::fs::read_to_string(path).unwrap_or_default();
    assert!(held == current, "web/src/api/openapi.json is out of date: run with UPDATE=1, then `npm run generate` in web");
}

#[test]
fn every_reference_leads_somewhere_and_every_operation_can_fail_properly() {
    let document: Value = serde_json::from_str(&halcyon_gateway::openapi_json()).unwrap();
    let mut references = BTreeSet::new();
    collect(&document, &mut references);
    assert!(references.len() > 20, "{references:?}");
    for reference in references {
        assert!(document.pointer(reference.trim_start_matches('#')).is_some(), "{reference}");
    }
    let mut operations = 0;
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            operations += 1;
            let problem = operation.pointer("/responses/default/content/application~1problem+json");
            assert!(problem.is_some(), "{method} {path}");
            let names: Vec<_> = operation["parameters"]
                .as_array()
                .into_iter()
                .flatten()
                .filter_map(|parameter| parameter["name"].as_str())
                .collect();
            assert_eq!(method == "post", names.contains(&"Idempotency-Key"), "{method} {path}");
        }
    }
    assert!(operations >= 25, "{operations}");
}

fn collect(value: &Value, references: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) => {
            if let Some(Value::String(reference)) = map.get("$ref") {
                references.insert(reference.clone());
            }
            map.values().for_each(|value| collect(value, references));
        }
        Value::Array(items) => items.iter().for_each(|value| collect(value, references)),
        _ => {}
    }
}
