//! What has changed in a state since the one that a page has. States repeat most of what they say ten times a
//! second, and a slow link must carry more than that: acknowledgements, confirmations, and a stop.

use serde_json::{Map, Value};

/// The fields of `after` that `before` has not, or has otherwise; of objects in turn the fields that differ. A
/// state always has the same fields, so that none is missing in `after`.
pub(super) fn changes(
    before: &Map<String, Value>,
    after: &Map<String, Value>,
) -> Map<String, Value> {
    let mut changed = Map::new();
    for (name, value) in after {
        let value = match (before.get(name), value) {
            (Some(before), value) if before == value => continue,
            (Some(Value::Object(before)), Value::Object(after)) => {
                Value::Object(changes(before, after))
            }
            (_, value) => value.clone(),
        };
        changed.insert(name.clone(), value);
    }
    changed
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn between(before: Value, after: Value) -> Value {
        let (Value::Object(before), Value::Object(after)) = (before, after) else {
            unreachable!("states are objects")
        };
        Value::Object(changes(&before, &after))
    }

    #[test]
    fn the_first_state_is_said_as_a_whole() {
        let state = json!({"seq": 1, "vehicle": {"name": "Rover", "pose": null}, "requests": []});
        assert_eq!(between(json!({}), state.clone()), state);
    }

    #[test]
    fn only_what_differs_is_said_again() {
        let before = json!({
            "seq": 1, "mission": null, "map": {"id": 1},
            "vehicle": {"name": "Rover", "pose": {"x": 1.5, "y": 2.0}, "velocity": {"x": 0.0}, "parts": [1, 2]},
        });
        let after = json!({
            "seq": 2, "mission": {"stage": "idle"}, "map": null,
            "vehicle": {"name": "Rover", "pose": {"x": 1.5, "y": 2.1}, "velocity": {"x": 0.0}, "parts": [1, 3]},
        });
        let said = json!({
            "seq": 2, "mission": {"stage": "idle"}, "map": null,
            "vehicle": {"pose": {"y": 2.1}, "parts": [1, 3]},
        });
        assert_eq!(between(before, after.clone()), said);
        assert_eq!(between(after.clone(), after), json!({}));
    }
}
