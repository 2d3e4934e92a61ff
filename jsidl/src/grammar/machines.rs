//! The elements of `protocol_behavior`.

use super::notation::{INTERPRETATION, PATH_NAME, element, empty, one, opt, part};
use super::{Element, Occurs, Part, Value};

const TARGETS: Part = part(&["simple", "push", "pop"], Occurs::Once)
    .newer(&["internal"])
    .surplus("has one target: keep one of `internal`, `simple`, `push` and `pop`")
    .missing("lacks its target: add `internal`, `simple`, `push` or `pop`");
const ACTIONS: Part = part(&["action", "send_action"], Occurs::Any);
const TRANSITIONS: Part = part(&["transition"], Occurs::Any);
const DEFAULT_TRANSITIONS: Part =
    part(&["default_transition"], Occurs::Any).in_1_0(Occurs::Optional);
const DEFAULT_STATE: Part = part(&["default_state"], Occurs::Optional);
const ARGUMENTS: Part = part(&["argument"], Occurs::Any);
/// The position of the start arrow in a diagram editor.
const START_ARROW: Part = part(&["pseudo_start_state"], Occurs::Never);

/// From `protocol_behavior` inwards.
pub(super) const ELEMENTS: &[Element] = &[
    element(
        "protocol_behavior",
        &[opt("is_stateless", Value::Boolean)],
        &[
            part(&["start"], Occurs::Some).dispensable(),
            part(&["state_machine"], Occurs::Some).dispensable(),
        ],
        "a `start` and a `state_machine` for each machine",
    ),
    empty(
        "start",
        &[
            one("state_machine_name", Value::Path),
            one("state_name", Value::Path),
            INTERPRETATION,
        ],
    ),
    element(
        "state_machine",
        &[PATH_NAME, INTERPRETATION],
        &[
            part(&["state"], Occurs::Some).dispensable(),
            DEFAULT_STATE.since_1_1(),
            START_ARROW,
        ],
        "`state`s and a `default_state`",
    ),
    element(
        "state",
        &[
            PATH_NAME,
            opt("initial_state", Value::Identifier),
            INTERPRETATION,
        ],
        &[
            part(&["entry"], Occurs::Optional),
            part(&["exit"], Occurs::Optional),
            TRANSITIONS,
            DEFAULT_TRANSITIONS,
            part(&["state"], Occurs::Any),
            DEFAULT_STATE,
            START_ARROW,
        ],
        "`entry`, `exit`, `transition`s, `state`s and a `default_state`",
    ),
    element(
        "default_state",
        &[INTERPRETATION],
        &[TRANSITIONS, DEFAULT_TRANSITIONS],
        "`transition`s",
    ),
    element("entry", &[INTERPRETATION], &[ACTIONS], "`action`s"),
    element("exit", &[INTERPRETATION], &[ACTIONS], "`action`s"),
    element(
        "transition",
        &[PATH_NAME, INTERPRETATION],
        &[
            part(&["parameter"], Occurs::Any),
            part(&["guard"], Occurs::Optional),
            TARGETS,
            ACTIONS,
        ],
        "`parameter`s, a `guard`, one of `internal`, `simple`, `push` and `pop`, and `action`s",
    ),
    element(
        "default_transition",
        &[INTERPRETATION],
        &[part(&["guard"], Occurs::Optional), TARGETS, ACTIONS],
        "a `guard`, one of `internal`, `simple`, `push` and `pop`, and `action`s, but no \
         `parameter`s, because it matches every event",
    ),
    empty("internal", &[INTERPRETATION]),
    element(
        "simple",
        &[INTERPRETATION],
        &[part(&["end_state"], Occurs::Optional)],
        "an `end_state`",
    ),
    element(
        "push",
        &[INTERPRETATION],
        &[
            part(&["end_state"], Occurs::Once),
            part(&["simple"], Occurs::Optional),
        ],
        "an `end_state` and a `simple`",
    ),
    element(
        "pop",
        &[opt("transition", Value::Identifier), INTERPRETATION],
        &[ARGUMENTS],
        "`argument`s",
    ),
    empty("end_state", &[one("state", Value::Path), INTERPRETATION]),
    empty(
        "parameter",
        &[
            one("type", Value::ParameterType),
            one("value", Value::Text),
            INTERPRETATION,
        ],
    ),
    empty("guard", &[one("condition", Value::Text), INTERPRETATION]),
    element(
        "action",
        &[PATH_NAME, INTERPRETATION],
        &[ARGUMENTS],
        "`argument`s",
    ),
    element(
        "send_action",
        &[PATH_NAME, INTERPRETATION],
        &[ARGUMENTS],
        "`argument`s",
    ),
    empty("argument", &[one("value", Value::Text), INTERPRETATION]),
];
