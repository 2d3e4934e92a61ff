//! Stack recognition: every sender in the captures is recognised correctly.

use std::collections::BTreeMap;
use std::path::Path;

use jaus::address::JausId;
use jaus::peer::{Certainty, Implementation, Recogniser, Verdict};
use jaus_test_kit::evidence;

/// The verdict on each sender of a capture.
fn verdicts(file: &Path) -> BTreeMap<JausId, Verdict> {
    let mut recognisers: BTreeMap<JausId, Recogniser> = BTreeMap::new();
    for datagram in super::recorded::datagrams(file) {
        let (frames, trailing) = datagram.frames();
        for (index, frame) in frames.iter().enumerate() {
            let last = index + 1 == frames.len();
            let recogniser = recognisers.entry(frame.source).or_default();
            recogniser.handle_frame(frame, if last { trailing } else { 0 });
        }
    }
    let verdicts = recognisers.into_iter();
    verdicts.map(|(id, it)| (id, it.verdict())).collect()
}

fn check(file: &str, expected: &[(&str, Implementation, Certainty)]) {
    for (id, verdict) in verdicts(&evidence::captures().join(file)) {
        let id = id.to_string();
        let of_it = expected.iter().find(|(expected, ..)| *expected == id);
        let (peer, certainty) = of_it
            .map_or((Implementation::Standard, Certainty::Unknown), |it| {
                (it.1, it.2)
            });
        let reasons: Vec<_> = verdict.reasons.iter().map(ToString::to_string).collect();
        assert_eq!(
            (verdict.peer, verdict.certainty),
            (peer, certainty),
            "{id} of {file}: {reasons:?}"
        );
    }
}

#[test]
fn jauspp_is_recognised_for_sure_and_a_plain_vehicle_beside_it_is_not() {
    use {Certainty::Certain, Implementation::JausPlusPlus};
    check(
        "jauspp/01-vehsim-client.pcap",
        &[
            ("152.1.1", JausPlusPlus, Certain),
            ("152.1.2", JausPlusPlus, Certain),
            ("1000.1.7", JausPlusPlus, Certain),
        ],
    );
    check(
        "jauspp/02-rawvehicle-client.pcap",
        &[
            ("1000.1.7", JausPlusPlus, Certain),
            // Python, modelled on JAUS++: its sequence numbers start with 0.
            ("77.1.1", JausPlusPlus, Certainty::Guess),
        ],
    );
    check(
        "jauspp/05-jcopc-challenge2010.pcap",
        &[
            ("152.1.1", JausPlusPlus, Certain),
            ("10002.1.1", JausPlusPlus, Certain),
        ],
    );
    check(
        "jauspp/07-cop-challenge2010.pcap",
        &[
            ("152.1.1", JausPlusPlus, Certain),
            ("42.1.1", JausPlusPlus, Certainty::Guess),
        ],
    );
}

#[test]
fn junior_is_recognised_by_its_first_call_and_for_sure_by_its_fault() {
    use {Certainty::Certain, Certainty::Likely, Implementation::Junior};
    for (file, certainty) in [
        ("01-discovery-then-unicast", Likely),
        ("02-acked-small", Likely),
        ("03-acked-100KB", Certain),
        ("04-unacked-100KB-bigbuf", Certain),
        ("11-priority0-bug", Certain),
        ("12-priority15", Likely),
    ] {
        let verdicts = verdicts(&evidence::captures().join(format!("junior/{file}.pcap")));
        let verdict = &verdicts[&JausId::new(1, 1, 1)];
        assert_eq!(
            (verdict.peer, verdict.certainty),
            (Junior, certainty),
            "{file}"
        );
        assert!(!verdict.reasons.is_empty());
    }
}

#[test]
fn the_judging_tool_is_recognised() {
    use {Certainty::Likely, Implementation::OpenJausSdk};
    for file in [
        "igvc2015/interface_test_1_13pts.pcapng",
        "igvc2015/qualification-practive-2015.pcap.pcapng",
    ] {
        let Some(file) = evidence::capture(file) else {
            continue;
        };
        let verdicts = verdicts(&file);
        for judge in ["42.1.1", "42.2.1", "42.2.2", "42.2.3", "42.2.4"] {
            let verdict = &verdicts[&judge.parse().unwrap()];
            assert_eq!(
                (verdict.peer, verdict.certainty),
                (OpenJausSdk, Likely),
                "{judge} {}",
                file.display()
            );
        }
    }
}

/// OpenJAUS sends RA, and shows none of the other stacks' signs.
#[test]
fn openjaus_is_taken_for_none_of_the_others() {
    for file in ["judp-wire", "opc-wire", "peer-wire"] {
        check(&format!("openjaus33/openjaus33-{file}.pcap"), &[]);
    }
}
