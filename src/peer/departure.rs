//! The departures of known peers from the standard.

use super::Peer::{Fkie, Iop, JausPlusPlus, Jts, Junior, OpenJausSdk};
use super::{Peer, Sign};
use Recognition::{By, Configured, NeedNotBe};
use Source::{Provoked, Read, Recorded};

/// A way in which a peer departs from the standard, or from what other peers do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Departure {
    /// A short name.
    pub name: &'static str,
    /// The peers that it applies to.
    pub peers: &'static [Peer],
    /// What these peers do.
    pub does: &'static str,
    /// How it is known.
    pub source: Source,
    /// How it is recognised.
    pub recognition: Recognition,
    /// How this implementation handles it.
    pub ours: &'static str,
    /// The file that handles it, relative to the root of the repository.
    pub place: &'static str,
    /// The test that covers it.
    pub test: &'static str,
}

/// How a departure is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Source {
    /// It was recorded on the wire between running peers.
    Recorded,
    /// It was provoked in a running peer.
    Provoked,
    /// It was read in the peer's code.
    Read,
}

/// How a peer with a departure is recognised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recognition {
    /// By any of these signs.
    By(&'static [Sign]),
    /// It need not be recognised: the same handling suits every peer.
    NeedNotBe,
    /// It cannot be observed, and needs an [`Assignment`](super::Assignment).
    Configured,
}

/// All departures that this implementation handles.
pub const DEPARTURES: &[Departure] = &[
    Departure {
        name: "stale octets",
        peers: &[JausPlusPlus],
        does: "leaves the end of an older, longer datagram after a message",
        source: Recorded,
        recognition: By(&[Sign::StaleOctets]),
        ours: "decoding stops at the first implausible header; the rest is counted and otherwise \
            ignored",
        place: "src/wire/judp.rs",
        test: "stale_octets_behind_a_message_are_counted_and_nothing_else",
    },
    Departure {
        name: "code in each fragment",
        peers: &[JausPlusPlus],
        does: "starts each fragment of a large message with the message code, uses 1573 octets in \
            all but the last, and accepts no other form",
        source: Provoked,
        recognition: By(&[Sign::RepeatedCode, Sign::JausPlusPlusService]),
        ours: "its large messages are reassembled without the repeated codes, and ours to it are \
            fragmented its way",
        place: "src/endpoint/large/style.rs",
        test: "the_code_that_jauspp_repeats_is_left_out_and_repeated_to_it_from_then_on",
    },
    Departure {
        name: "no last fragment",
        peers: &[JausPlusPlus],
        does: "does not mark the last fragment of a message that fills all its fragments",
        source: Read,
        recognition: By(&[Sign::RepeatedCode]),
        ours: "the message is complete when its sender's next message has the number of the last \
            fragment, because JAUS++ uses that number twice",
        place: "src/endpoint/large/reassembly.rs",
        test: "a_message_of_jauspp_that_fills_its_fragments_is_whole_with_the_next_message",
    },
    Departure {
        name: "narrow reassembly",
        peers: &[JausPlusPlus],
        does: "accepts at most 1425 octets in a packet, rejects fragments with the number 0, and \
            loses a message whose numbers wrap around",
        source: Read,
        recognition: By(&[Sign::RepeatedCode, Sign::JausPlusPlusService]),
        ours: "no packet to it is longer; for every receiver, fragment numbers skip 0 and do not \
            wrap around within a message",
        place: "src/endpoint/large/split.rs",
        test: "to_jauspp_no_packet_is_longer_than_it_takes_and_numbers_do_not_go_round",
    },
    Departure {
        name: "slow reader",
        peers: &[JausPlusPlus],
        does: "reads one datagram per millisecond, so faster traffic overflows its receive buffer: \
            200 kB without acknowledgements never arrive",
        source: Provoked,
        recognition: By(&[Sign::RepeatedCode, Sign::JausPlusPlusService]),
        ours: "fragments of unacknowledged large messages are paced at 600 per second; \
            acknowledgements pace the others. The outgoing messages of one of its components \
            together must fit 655 350 octets",
        place: "src/endpoint/send.rs",
        test: "to_jauspp_large_messages_leave_no_faster_than_it_reads_datagrams",
    },
    Departure {
        name: "duplicate event ids",
        peers: &[JausPlusPlus],
        does: "counts event ids per query, so several events share an id, and Cancel Event ends \
            the first of them",
        source: Provoked,
        recognition: NeedNotBe,
        ours: "events are distinguished by their reports; a subscription that a cancellation may \
            have ended is requested again",
        place: "src/service/client/subscriptions.rs",
        test: "a_cancellation_that_may_have_hit_another_event_has_that_one_renewed",
    },
    Departure {
        name: "crashes on Update Event",
        peers: &[JausPlusPlus],
        does: "crashes when it receives Update Event (01F1h)",
        source: Provoked,
        recognition: NeedNotBe,
        ours: "never sent to any peer: to change an event, it is cancelled and created again",
        place: "src/service/client/subscription.rs",
        test: "no_update_event_is_sent_in_the_whole_life_of_a_subscription",
    },
    Departure {
        name: "repeated first event",
        peers: &[JausPlusPlus],
        does: "sends the first report of an event up to four times, each with its own number",
        source: Recorded,
        recognition: NeedNotBe,
        ours: "each is treated as a normal report, not as a loss or another stream",
        place: "src/service/client/subscription.rs",
        test: "a_first_report_that_comes_four_times_loses_nothing_and_cancels_nothing",
    },
    Departure {
        name: "polls each event",
        peers: &[JausPlusPlus],
        does: "sends Query Events for one id every 5 s, and re-creates at 1 Hz every other event \
            that the answer does not list",
        source: Recorded,
        recognition: NeedNotBe,
        ours: "Report Events lists the requested event first, then all others of the client",
        place: "src/service/events/mod.rs",
        test: "a_client_is_told_of_its_own_events_by_each_question",
    },
    Departure {
        name: "re-creates events",
        peers: &[JausPlusPlus],
        does: "sends Create Event for an existing event",
        source: Recorded,
        recognition: NeedNotBe,
        ours: "same client, type and query are one event: its id is confirmed again, without a \
            second stream",
        place: "src/service/events/mod.rs",
        test: "creating_the_same_again_changes_the_rate_and_not_the_number_of_streams",
    },
    Departure {
        name: "reject codes one too low",
        peers: &[JausPlusPlus],
        does: "writes the response code of Reject Event Request one too low, and regardless of the \
            presence vector",
        source: Provoked,
        recognition: NeedNotBe,
        ours: "a code that the presence vector omits is decoded anyway, and incremented",
        place: "src/service/client/rejection.rs",
        test: "a_code_that_the_presence_vector_does_not_tell_of_is_one_too_low",
    },
    Departure {
        name: "cannot read a rejection",
        peers: &[JausPlusPlus],
        does: "reads the first presence bit of Reject Event Request as the text's, so a message \
            with only a code is too short for it and is ignored",
        source: Provoked,
        recognition: NeedNotBe,
        ours: "each rejection carries code and text, so JAUS++ finds both where it expects them. \
            It shows the code one too high",
        place: "src/service/events/rejecting.rs",
        test: "a_rejection_is_one_that_jauspp_reads_too",
    },
    Departure {
        name: "no wildcard in Query Services",
        peers: &[JausPlusPlus],
        does: "answers Query Services for node 255, component 255 with an empty list",
        source: Provoked,
        recognition: NeedNotBe,
        ours: "each component is queried by its id",
        place: "src/service/discovery/search.rs",
        test: "services_are_asked_for_by_number_and_never_by_wildcard",
    },
    Departure {
        name: "registers everywhere",
        peers: &[JausPlusPlus],
        does: "sends Register Services to components of other subsystems, every 5 s",
        source: Recorded,
        recognition: By(&[Sign::RegistersAcrossSubsystems]),
        ours: "the services are recorded like those of a report, without an answer",
        place: "src/service/discovery/learn.rs",
        test: "a_registration_from_another_subsystem_is_learned_and_not_answered",
    },
    Departure {
        name: "Clear Emergency is Set Emergency",
        peers: &[JausPlusPlus],
        does: "sends Set Emergency (0006h) for Clear Emergency, and does not know 0007h: only \
            Reset (0005h) ends its own emergencies",
        source: Provoked,
        recognition: NeedNotBe,
        ours: "the message is taken literally: the emergency stays, however often it is set. One \
            Clear Emergency with the client's id ends it, or the vehicle's application",
        place: "src/service/control/management.rs",
        test: "an_emergency_that_is_set_again_stays_and_is_cleared_at_once",
    },
    Departure {
        name: "no heartbeats",
        peers: &[JausPlusPlus],
        does: "never sends Report Heartbeat Pulse by itself",
        source: Provoked,
        recognition: NeedNotBe,
        ours: "any message is a sign of life, and a silent peer is sent Query Identification",
        place: "src/service/discovery/search.rs",
        test: "a_peer_that_only_answers_is_not_lost",
    },
    Departure {
        name: "version octet before each message",
        peers: &[JausPlusPlus],
        does: "writes the version octet before each message of a TCP stream, in its own segment",
        source: Recorded,
        recognition: By(&[Sign::RepeatedVersion]),
        ours: "both forms are accepted, and each peer is answered in its own form, because JAUS++ \
            hangs without the octet. It also hangs if a message of ours arrives in two segments: \
            use UDP with it",
        place: "src/wire/jtcp/decoder.rs",
        test: "a_version_octet_before_each_message_is_read",
    },
    Departure {
        name: "one-way connections",
        peers: &[JausPlusPlus],
        does: "opens a TCP connection to each peer it receives UDP from, and sends on it; it reads \
            answers there only after version octets, or hangs",
        source: Recorded,
        recognition: By(&[
            Sign::RegistersAcrossSubsystems,
            Sign::StaleOctets,
            Sign::RepeatedVersion,
        ]),
        ours: "after the first version octet in mid-stream it is answered by UDP, on which it \
            received us before it connected. Do not list it in `tcp.connect`: it then does not \
            find us",
        place: "src/endpoint/receive.rs",
        test: "jauspp_that_connects_is_answered_where_it_reads",
    },
    Departure {
        name: "multicasts to unknown ids",
        peers: &[Junior, Jts, Fkie],
        does: "sends a message for an id with an unknown address to the group, as a global \
            broadcast that requests acknowledgement, until it is acknowledged",
        source: Recorded,
        recognition: By(&[Sign::CallsUnknownIds]),
        ours: "it is acknowledged from our unicast address, and delivered to that component only",
        place: "src/endpoint/receive.rs",
        test: "a_call_of_junior_is_acknowledged_by_the_one_alone_from_its_own_address",
    },
    Departure {
        name: "multicasts without the flag",
        peers: &[Fkie],
        does: "its Python node manager does the same without the broadcast flag",
        source: Recorded,
        recognition: By(&[Sign::CallsUnknownIds]),
        ours: "a multicast message for one id that requests acknowledgement is treated the same \
            way",
        place: "src/endpoint/receive.rs",
        test: "a_call_without_its_flag_is_known_by_the_way_that_it_came",
    },
    Departure {
        name: "priority 0 sets all flags",
        peers: &[Junior, Jts],
        does: "writes flags FFh for priority 0, which decodes as an acknowledgement of a last \
            fragment",
        source: Recorded,
        recognition: By(&[Sign::PriorityFault]),
        ours: "dropped and counted by its own counter, because the flags no longer show whether it \
            is a whole message. Its application must use priorities 1 to 15",
        place: "src/endpoint/receive.rs",
        test: "juniors_priority_zero_fault_is_dropped_and_counted_by_its_name",
    },
    Departure {
        name: "restarts numbering",
        peers: &[Junior, Jts, Fkie],
        does: "starts with number 1 in each process",
        source: Provoked,
        recognition: NeedNotBe,
        ours: "duplicates are recognised by content too, not by number alone, and only briefly: \
            0.9 s for a known Junior, because it stops retransmitting earlier; a fragment missing \
            from a reassembly is always accepted",
        place: "src/endpoint/receive.rs",
        test: "a_large_message_of_a_restarted_junior_arrives_though_its_numbers_and_octets_come_again",
    },
    Departure {
        name: "remembers numbers",
        peers: &[Junior, Jts],
        does: "acknowledges and drops any message whose number it received from the same id within \
            3 s, even if that node was restarted since: if it drops a fragment, the large message \
            never arrives",
        source: Recorded,
        recognition: NeedNotBe,
        ours: "a node derives its first number from the clock, ahead of those it used before",
        place: "src/endpoint/config.rs",
        test: "a_node_that_is_started_again_and_again_uses_no_number_that_junior_remembers",
    },
    Departure {
        name: "one id for each connection",
        peers: &[Junior, Jts, Fkie],
        does: "assigns a TCP connection to the first id received on it, and opens one per id",
        source: Recorded,
        recognition: NeedNotBe,
        ours: "an id is answered on the connection of its last message, however many there are. \
            Over a connection that we open, only one of our components reaches it: let it connect, \
            or use UDP",
        place: "src/link/tcp/mod.rs",
        test: "each_id_is_answered_on_the_connection_on_which_it_was_heard_last",
    },
    Departure {
        name: "dies with a connection",
        peers: &[Junior, Jts, Fkie],
        does: "writes to a reset TCP connection, and SIGPIPE kills it: its engine, with all \
            components of its host",
        source: Recorded,
        recognition: NeedNotBe,
        ours: "a node that stops announces it on its connections, keeps reading, and retransmits \
            nothing on them for 200 ms, because that would be acknowledged late. Nothing helps if \
            our node is killed; start the engine with SIGPIPE ignored",
        place: "src/link/tcp/mod.rs",
        test: "a_peer_that_still_writes_when_the_link_hangs_up_is_not_cut_off",
    },
    Departure {
        name: "compression flags from the wrong end",
        peers: &[Junior, Jts, Fkie],
        does: "reads the header compression flags from bits 0-1 of the first octet, which hold the \
            message type",
        source: Provoked,
        recognition: NeedNotBe,
        ours: "the first octet of our messages is always 0, even in answers to one that is not",
        place: "src/wire/as5669a.rs",
        test: "the_first_octet_of_all_that_is_sent_is_zero",
    },
    Departure {
        name: "discards fragments",
        peers: &[Junior, Jts, Fkie],
        does: "reads ten datagrams at a time and keeps the latest 50 or 100 fragments of all \
            senders",
        source: Recorded,
        recognition: By(&[
            Sign::PriorityFault,
            Sign::LongFragments,
            Sign::CallsUnknownIds,
            Sign::BeginsWithOne,
        ]),
        ours: "messages of more than 50 fragments (71 kB) are sent in its longest fragments, of \
            4079 octets, and more slowly if not acknowledged; acknowledgements pace the others. \
            Messages above 200 kB need a larger `MaxMsgHistory` there",
        place: "src/endpoint/send.rs",
        test: "to_junior_large_messages_have_no_more_fragments_than_it_keeps",
    },
    Departure {
        name: "aliased ids",
        peers: &[Jts],
        does: "reads a 0 in any octet of an id as a wildcard, so it also delivers messages for \
            1.1.1 to 513.1.1",
        source: Recorded,
        recognition: Configured,
        ours: "`Peer::confuses` tells which ids it cannot distinguish; choose only subsystems \
            below 256, or none below 256",
        place: "src/peer/habits.rs",
        test: "junior_of_the_tool_set_confuses_ids_with_zero_octets",
    },
    Departure {
        name: "0 for \"all\"",
        peers: &[Iop, Jts],
        does: "writes 0 for \"all subsystems\", \"all nodes\" or \"all components\" in \
            destinations",
        source: Read,
        recognition: By(&[Sign::IopService]),
        ours: "from such a peer a 0 is decoded as the wildcard of its field; from all others it is \
            invalid",
        place: "src/endpoint/receive.rs",
        test: "a_zero_stands_for_all_from_those_who_mean_it_so_and_from_nobody_else",
    },
    Departure {
        name: "numbers per destination",
        peers: &[OpenJausSdk],
        does: "counts sequence numbers per destination, so numbers repeat",
        source: Recorded,
        recognition: By(&[Sign::NumbersByDestination]),
        ours: "duplicates are recognised by destination, number and content",
        place: "src/endpoint/recent.rs",
        test: "numbers_that_count_for_each_destination_are_no_duplicates",
    },
    Departure {
        name: "queries whole nodes",
        peers: &[OpenJausSdk],
        does: "sends queries for one component to all components of its node, as global broadcasts",
        source: Recorded,
        recognition: By(&[Sign::AsksWholeNodes]),
        ours: "each addressed component answers for itself, by unicast",
        place: "src/endpoint/receive.rs",
        test: "a_question_to_a_whole_node_is_answered_by_unicast",
    },
];
