//! Random events: the generated state machines and the dynamic ones take the same path, and never
//! enter an impossible state.

use jsidl::machine::Run;
use proptest::prelude::*;
use proptest::sample::Index;

use super::recorder::{Generated, Recorder, dynamic, step, stimulus};
use crate::messages::core::{access_control, events, management};

/// All guards; for each event it is decided again which of them hold.
const QUESTIONS: [&str; 10] = [
    "isSupported",
    "eventExists",
    "isCommandSupported",
    "isDefaultAuthorityGreater",
    "isControllingClient",
    "isCurrentAuthorityLess",
    "isAuthorityValid",
    "isIDStored",
    "isLastID",
    "initializes",
];

/// An event, and the guards that hold.
type Happening = (Index, u16);

fn happenings() -> impl Strategy<Value = Vec<Happening>> {
    prop::collection::vec((any::<Index>(), any::<u16>()), 1..60)
}

fn holding(bits: u16) -> impl Iterator<Item = String> {
    let all = QUESTIONS.iter().enumerate();
    let holding = all.filter(move |(bit, _)| bits >> bit & 1 == 1);
    holding.map(|(_, question)| (*question).to_owned())
}

/// Runs both, which must take the same path; returns the paths of the states.
fn same<G: Generated>(happenings: &[Happening]) -> Vec<String> {
    let machine = dynamic(G::URN);
    let (mut ours, mut theirs) = (Recorder::default(), Recorder::default());
    let mut generated = G::begin(&mut ours);
    let mut run = Run::start(&machine, &mut |_| {});
    let events: Vec<_> = G::MESSAGES.iter().chain(G::OTHERS).collect();
    let mut paths = Vec::new();
    for (which, bits) in happenings {
        let event = which.get(&events);
        ours.holds = holding(*bits).collect();
        theirs.holds.clone_from(&ours.holds);
        let outcome = generated.hear(event, &mut ours);
        assert_eq!(
            outcome,
            step(&mut run, stimulus::<G>(event), &mut theirs),
            "{event}"
        );
        assert_eq!(ours.done, theirs.done, "{event}");
        let path = machine.state(run.state()).path.to_string();
        assert_eq!(generated.path(), path, "{event}");
        paths.push(path);
    }
    paths
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn generated_events_go_as_the_dynamic_ones(happenings in happenings()) {
        let paths = same::<events::machine::Machine>(&happenings);
        prop_assert!(paths.iter().all(|path| path == "Receiving.Ready"));
    }

    #[test]
    fn generated_access_control_goes_as_the_dynamic_one(happenings in happenings()) {
        same::<access_control::machine::Machine>(&happenings);
    }

    /// Ready is a controlled state; the states of starting and failure are not.
    #[test]
    fn generated_management_goes_as_the_dynamic_one_and_is_never_ready_without_control(
        happenings in happenings(),
    ) {
        for path in same::<management::machine::Machine>(&happenings) {
            let controlled = path.starts_with("Receiving.Ready.Controlled.");
            match path.rsplit('.').next() {
                Some("Ready") => prop_assert!(controlled, "{path}"),
                Some("Init" | "Failure" | "Shutdown") => prop_assert!(!controlled, "{path}"),
                _ => {}
            }
        }
    }
}
