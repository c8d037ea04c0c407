//! The JSON Schema of the manifest: what editors complete and check by.

use std::borrow::Cow;
use std::collections::BTreeMap;

use schemars::transform::{Transform, transform_subschemas};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::{Map, Value as Json};

use super::edit::{CameraField, EnvironmentField, LightField, MaterialField};
use super::model::Manifest;
use crate::record::Value;

/// The JSON Schema (draft 2020-12) of the manifest's format.
pub fn json_schema() -> Json {
    let mut schema = SchemaGenerator::default().into_root_schema_for::<Manifest>();
    NoNull.transform(&mut schema);
    schema.to_value()
}

/// TOML has no null: what may be absent is absent.
#[derive(Clone, Copy, Debug)]
struct NoNull;

impl Transform for NoNull {
    fn transform(&mut self, schema: &mut Schema) {
        if let Some(object) = schema.as_object_mut() {
            if object.get("default").is_some_and(Json::is_null) {
                object.remove("default");
            }
            if let Some(Json::Object(defaults)) = object.get_mut("default") {
                defaults.retain(|_, v| !v.is_null());
            }
            if let Some(Json::Array(types)) = object.get_mut("type") {
                types.retain(|t| t != "null");
                if let [only] = types.as_slice() {
                    let only = only.clone();
                    object.insert("type".into(), only);
                }
            }
            if let Some(Json::Array(options)) = object.get_mut("anyOf") {
                options.retain(|o| o.get("type").is_none_or(|t| t != "null"));
                if let [only] = options.as_slice()
                    && let Json::Object(only) = only.clone()
                {
                    object.remove("anyOf");
                    for (key, value) in only {
                        object.entry(key).or_insert(value);
                    }
                }
            }
        }
        transform_subschemas(self, schema);
    }
}

/// One text or several.
#[derive(JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "describes the format; the parser reads it by hand")]
pub(super) enum OneOrMany {
    /// One.
    One(String),
    /// Several.
    Many(Vec<String>),
}

/// A value, or a table whose keys go on with the path.
#[derive(JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "describes the format; the parser reads it by hand")]
pub(super) enum SettingTree {
    /// A value.
    Value(Value),
    /// A table.
    Table(BTreeMap<String, SettingTree>),
}

/// The schema of a table whose keys are fields.
macro_rules! field_table {
    ($(#[$doc:meta])* $table:ident of $field:ident) => {
        $(#[$doc])*
        pub(super) struct $table;

        impl JsonSchema for $table {
            fn schema_name() -> Cow<'static, str> {
                stringify!($table).into()
            }
            fn json_schema(generator: &mut SchemaGenerator) -> Schema {
                let value = generator.subschema_for::<Value>().to_value();
                let property = |f: &$field| {
                    let mut property = Map::new();
                    property.insert("description".into(), format!("`{}`: {}.", f.name(), f.expects()).into());
                    property.insert("allOf".into(), Json::Array(vec![value.clone()]));
                    (f.name().to_owned(), Json::Object(property))
                };
                let properties: Map<String, Json> = $field::ALL.iter().map(property).collect();
                json_schema!({ "type": "object", "properties": properties, "additionalProperties": false })
            }
        }
    };
}

field_table! {
    /// `[camera]`.
    CameraTable of CameraField
}
field_table! {
    /// `[environment]`.
    EnvironmentTable of EnvironmentField
}
field_table! {
    /// `[light.NAME]`.
    LightTable of LightField
}
field_table! {
    /// `[material.NAME]`.
    MaterialTable of MaterialField
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::manifest::edit::RenderField;
    use crate::manifest::parse::keys;

    /// All properties of an object's schema, those of its flattened enumerations included.
    fn properties(schema: &Json) -> BTreeSet<String> {
        let mut all: BTreeSet<String> =
            schema["properties"].as_object().into_iter().flat_map(|p| p.keys().cloned()).collect();
        for combined in ["oneOf", "allOf", "anyOf"] {
            for part in schema[combined].as_array().into_iter().flatten() {
                all.extend(properties(part));
            }
        }
        all
    }

    fn known(keys: &[&str]) -> BTreeSet<String> {
        keys.iter().map(|k| (*k).to_owned()).collect()
    }

    #[test]
    fn the_parser_knows_exactly_the_keys_of_the_schema() {
        let root = json_schema();
        assert_eq!(properties(&root), known(keys::MANIFEST));
        let definition = |name: &str| root["$defs"][name].clone();
        for (name, keys) in [
            ("Axis", keys::AXIS),
            ("Interval", keys::INTERVAL),
            ("Sequence", keys::SEQUENCE),
            ("Random", keys::RANDOM),
            ("SheetSpec", keys::SHEET),
            ("Display", keys::DISPLAY),
            ("CompareSpec", keys::COMPARE),
        ] {
            assert_eq!(properties(&definition(name)), known(keys), "{name}");
            let text = definition(name).to_string();
            assert!(
                text.contains("\"additionalProperties\":false")
                    || text.contains("\"unevaluatedProperties\":false"),
                "{name}: {text}"
            );
        }
        let render: Vec<&str> = RenderField::ALL.iter().map(|f| f.name()).collect();
        assert_eq!(properties(&definition("RenderSettings")), known(&render));
        assert_eq!(properties(&definition("MaterialTable")).len(), MaterialField::ALL.len());
    }

    #[test]
    fn nothing_may_be_null_and_every_property_is_described() {
        let root = json_schema();
        assert!(!root.to_string().contains("null"), "{root:#}");
        for (name, property) in root["properties"].as_object().unwrap() {
            assert!(property["description"].is_string(), "{name}: {property:#}");
        }
        assert_eq!(root["properties"]["max_jobs"]["default"], 100_000);
        assert_eq!(root["$defs"]["RenderSettings"]["properties"]["spp"]["default"], 64);
    }
}
