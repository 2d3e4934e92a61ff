//! Script of the judge: every step of the two rule books, in order, and additional checks.
//!
//! The requests and their order come from the public rules of the 2010 challenge (part A) and from
//! observations of the judging tool of 2015 (part B), whose octets the tests replay. The required
//! answers follow the standard's definitions.

mod asking;
mod challenge;
mod control;
mod drive;
mod events;
mod mobility;
mod safety;
pub(super) mod service;
mod specimen;
mod transitions;

use std::collections::BTreeMap;

use jaus::messages::{core, mobility as jss};

use super::step::{Name, Step};

/// Services required by steps.
const DISCOVERY: &str = core::discovery::URN;
const EVENTS: &str = core::events::URN;
const LIVENESS: &str = core::liveness::URN;
const ACCESS_CONTROL: &str = core::access_control::URN;
const MANAGEMENT: &str = core::management::URN;
const VELOCITY_STATE_SENSOR: &str = jss::velocity_state_sensor::URN;
const PRIMITIVE_DRIVER: &str = jss::primitive_driver::URN;
const LOCAL_POSE_SENSOR: &str = jss::local_pose_sensor::URN;
const LOCAL_WAYPOINT_DRIVER: &str = jss::local_waypoint_driver::URN;
const LOCAL_WAYPOINT_LIST_DRIVER: &str = jss::local_waypoint_list_driver::URN;

/// Default authority of the judge's control requests.
const AUTHORITY: u8 = 220;

/// All steps, in execution order.
pub(super) fn steps() -> Vec<Step> {
    let parts = [
        challenge::steps(),
        drive::steps(),
        asking::first(),
        events::steps(),
        asking::again(),
        control::steps(),
        mobility::steps(),
        events::observer(),
        safety::steps(),
    ];
    parts.into_iter().flatten().collect()
}

/// The selected steps, with the steps that they depend on.
pub(super) fn selected(steps: Vec<Step>, chosen: impl Fn(Name) -> bool) -> Vec<Step> {
    let mut wanted: Vec<Name> = Vec::new();
    // In reverse, because a step depends on earlier ones only.
    for step in steps.iter().rev() {
        if chosen(step.name) || wanted.contains(&step.name) {
            let part = step.name.part;
            wanted.push(step.name);
            wanted.extend(step.rests_on.iter().map(|&number| Name { part, number }));
        }
    }
    let is_wanted = |step: &Step| wanted.contains(&step.name);
    steps.into_iter().filter(is_wanted).collect()
}

/// The steps that a choice leaves out, with the reasons: the chosen ones, and those that depend on
/// them.
pub(super) fn left_out(steps: &[Step], chosen: impl Fn(Name) -> bool) -> BTreeMap<Name, String> {
    let mut left_out = BTreeMap::new();
    for step in steps {
        let Name { part, .. } = step.name;
        let mut before = step.rests_on.iter().map(|&number| Name { part, number });
        if chosen(step.name) {
            left_out.insert(step.name, "left out by --skip".to_owned());
        } else if let Some(missing) = before.find(|name| left_out.contains_key(name)) {
            let reason = format!("depends on {missing}, which --skip leaves out");
            left_out.insert(step.name, reason);
        }
    }
    left_out
}

#[cfg(test)]
mod tests {
    use super::super::step::Part;
    use super::*;

    #[test]
    fn every_step_of_the_rule_books_is_there_once_and_in_order() {
        let names: Vec<_> = steps().iter().map(|step| step.name).collect();
        let a = (1..=6).map(|number| (Part::A, number));
        let b = (1..=36).map(|number| (Part::B, number));
        let c = (1..=5).map(|number| (Part::C, number));
        let all: Vec<_> = a.chain(b).chain(c).collect();
        assert_eq!(
            names.iter().map(|n| (n.part, n.number)).collect::<Vec<_>>(),
            all
        );
    }

    #[test]
    fn a_step_rests_on_earlier_ones_only() {
        for step in steps() {
            for &number in step.rests_on {
                assert!(number < step.name.number, "{} on {number}", step.name);
            }
        }
    }

    #[test]
    fn a_selection_brings_along_what_it_rests_on() {
        let only: Name = "B17".parse().unwrap();
        let chosen = selected(steps(), |name| name == only);
        let names: Vec<_> = chosen.iter().map(|step| step.name.to_string()).collect();
        assert_eq!(names, ["B15", "B17"]);
    }

    #[test]
    fn a_step_that_is_left_out_takes_along_what_depends_on_it() {
        let skip: Name = "B4".parse().unwrap();
        let left_out = left_out(&steps(), |name| name == skip);
        let names: Vec<_> = left_out.keys().map(ToString::to_string).collect();
        assert_eq!(names, ["B4", "B5", "B8", "B9", "B10"]);
        let reason = &left_out[&"B10".parse().unwrap()];
        assert_eq!(reason, "depends on B4, which --skip leaves out");
    }
}
