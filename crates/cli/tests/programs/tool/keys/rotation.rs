//! The replacement of a key, while the node runs.

use super::*;

#[test]
fn a_key_is_replaced_while_the_vehicle_runs() {
    let (_vehicle, at_vehicle, operator, address) = vehicle_and_operator("115.1.9");
    let query = [
        "query",
        "115.1.9",
        "QueryIdentification",
        WHICH,
        "--timeout",
        "20s",
        "--id",
        "60.1.1",
    ];
    assert_eq!(as_operator(&operator, &address, &query).status, 0);
    let old = at_vehicle.keys(&["show"]).stdout.trim().to_owned();

    let none = at_vehicle.keys(&["rotate", "--finish"]);
    assert!(
        none.stderr.contains("`jaus keys rotate` makes one"),
        "{none:?}"
    );
    let next = at_vehicle.keys(&["rotate"]).stdout.trim().to_owned();
    assert_eq!(
        at_vehicle.keys(&["rotate"]).status,
        2,
        "there is one already"
    );
    let trust = ["trust", "rover", &next, "115.255.255"];
    let refused = operator.keys(&trust);
    assert!(refused.stderr.contains("--also"), "{refused:?}");
    assert_eq!(operator.keys(&[&trust[..], &["--also"]].concat()).status, 0);
    assert_eq!(as_operator(&operator, &address, &query).status, 0);

    let finished = at_vehicle.keys(&["rotate", "--finish"]);
    assert_eq!((finished.status, finished.stdout.trim()), (0, &*next));
    assert!(finished.stderr.contains(&old), "{finished:?}");
    assert!(finished.stderr.contains(TAKEN), "{finished:?}");
    assert_eq!(operator.keys(&["revoke", "rover", &old]).status, 0);
    let listed = operator.keys(&["list", "--json"]).only_line();
    assert_eq!(listed["key"], next);
    let answered = as_operator(&operator, &address, &query);
    assert_eq!(answered.status, 0, "with the new key alone: {answered:?}");
}
