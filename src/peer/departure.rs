//! The departures of known peers from the standard.

use super::Implementation::{Fkie, Iop, JausPlusPlus, Jts, Junior, OpenJausSdk};
use super::Sign::{
    AsksWholeNodes, BeginsWithOne, CallsUnknownIds, IopService, JausPlusPlusService, LongFragments,
    NumbersByDestination, PriorityFault, RegistersAcrossSubsystems, RepeatedCode, RepeatedVersion,
    StaleOctets,
};
use super::{Implementation, Sign};
use Recognition::{By, Configured, NeedNotBe};

/// A way in which a peer departs from the standard, or from what other peers do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Departure {
    /// A short name.
    pub name: &'static str,
    /// The peers that it applies to.
    pub peers: &'static [Implementation],
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

/// Defines the table: for each departure its name, its peers, how it is known, and how it is
/// recognised; then what these peers do, our handling, its file, and its test.
macro_rules! departures {
    ($(
        $name:literal: $peers:expr, $source:ident, $recognition:expr =>
            does $does:literal, ours $ours:literal, in $place:literal, tested by $test:literal;
    )+) => {
        /// All departures that this implementation handles.
        pub const DEPARTURES: &[Departure] = &[$(Departure {
            name: $name,
            peers: &$peers,
            does: $does,
            source: Source::$source,
            recognition: $recognition,
            ours: $ours,
            place: $place,
            test: $test,
        },)+];
    };
}

departures! {
    "stale octets": [JausPlusPlus], Recorded, By(&[StaleOctets]) =>
        does "leaves the end of an older, longer datagram after a message",
        ours "decoding stops at the first implausible header; the rest is counted and otherwise \
            ignored",
        in "src/wire/judp.rs",
        tested by "stale_octets_behind_a_message_are_counted_and_nothing_else";
    "code in each fragment": [JausPlusPlus], Provoked, By(&[RepeatedCode, JausPlusPlusService]) =>
        does "starts each fragment of a large message with the message code, uses 1573 octets in \
            all but the last, and accepts no other form",
        ours "its large messages are reassembled without the repeated codes, and ours to it are \
            fragmented its way",
        in "src/endpoint/large/style.rs",
        tested by "the_code_that_jauspp_repeats_is_left_out_and_repeated_to_it_from_then_on";
    "no last fragment": [JausPlusPlus], Read, By(&[RepeatedCode]) =>
        does "does not mark the last fragment of a message that fills all its fragments",
        ours "the message is complete when its sender's next message has the number of the last \
            fragment, because JAUS++ uses that number twice",
        in "src/endpoint/large/reassembly.rs",
        tested by "a_message_of_jauspp_that_fills_its_fragments_is_whole_with_the_next_message";
    "narrow reassembly": [JausPlusPlus], Read, By(&[RepeatedCode, JausPlusPlusService]) =>
        does "accepts at most 1425 octets in a packet, rejects fragments with the number 0, and \
            loses a message whose numbers wrap around",
        ours "no packet to it is longer; for every receiver, fragment numbers skip 0 and do not \
            wrap around within a message",
        in "src/endpoint/large/split.rs",
        tested by "to_jauspp_no_packet_is_longer_than_it_takes_and_numbers_do_not_go_round";
    "slow reader": [JausPlusPlus], Provoked, By(&[RepeatedCode, JausPlusPlusService]) =>
        does "reads one datagram per millisecond, so faster traffic overflows its receive buffer: \
            200 kB without acknowledgements never arrive",
        ours "fragments of unacknowledged large messages are paced at 600 per second; \
            acknowledgements pace the others. The outgoing messages of one of its components \
            together must fit 655 350 octets",
        in "src/endpoint/send.rs",
        tested by "to_jauspp_large_messages_leave_no_faster_than_it_reads_datagrams";
    "duplicate event ids": [JausPlusPlus], Provoked, NeedNotBe =>
        does "counts event ids per query, so several events share an id, and Cancel Event ends the \
            first of them",
        ours "events are distinguished by their reports; a subscription that a cancellation may \
            have ended is requested again",
        in "src/service/client/subscriptions.rs",
        tested by "a_cancellation_that_may_have_hit_another_event_has_that_one_renewed";
    "crashes on Update Event": [JausPlusPlus], Provoked, NeedNotBe =>
        does "crashes when it receives Update Event (01F1h)",
        ours "never sent to any peer: to change an event, it is cancelled and created again",
        in "src/service/client/subscription.rs",
        tested by "no_update_event_is_sent_in_the_whole_life_of_a_subscription";
    "repeated first event": [JausPlusPlus], Recorded, NeedNotBe =>
        does "sends the first report of an event up to four times, each with its own number",
        ours "each is treated as a normal report, not as a loss or another stream",
        in "src/service/client/subscription.rs",
        tested by "a_first_report_that_comes_four_times_loses_nothing_and_cancels_nothing";
    "polls each event": [JausPlusPlus], Recorded, NeedNotBe =>
        does "sends Query Events for one id every 5 s, and re-creates at 1 Hz every other event \
            that the answer does not list",
        ours "Report Events lists the requested event first, then all others of the client",
        in "src/service/events/mod.rs",
        tested by "a_client_is_told_of_its_own_events_by_each_question";
    "re-creates events": [JausPlusPlus], Recorded, NeedNotBe =>
        does "sends Create Event for an existing event",
        ours "same client, type and query are one event: its id is confirmed again, without a \
            second stream",
        in "src/service/events/mod.rs",
        tested by "creating_the_same_again_changes_the_rate_and_not_the_number_of_streams";
    "reject codes one too low": [JausPlusPlus], Provoked, NeedNotBe =>
        does "writes the response code of Reject Event Request one too low, and regardless of the \
            presence vector",
        ours "a code that the presence vector omits is decoded anyway, and incremented",
        in "src/service/client/rejection.rs",
        tested by "a_code_that_the_presence_vector_does_not_tell_of_is_one_too_low";
    "cannot read a rejection": [JausPlusPlus], Provoked, NeedNotBe =>
        does "reads the first presence bit of Reject Event Request as the text's, so a message \
            with only a code is too short for it and is ignored",
        ours "each rejection carries code and text, so JAUS++ finds both where it expects them. It \
            shows the code one too high",
        in "src/service/events/rejecting.rs",
        tested by "a_rejection_is_one_that_jauspp_reads_too";
    "no wildcard in Query Services": [JausPlusPlus], Provoked, NeedNotBe =>
        does "answers Query Services for node 255, component 255 with an empty list",
        ours "each component is queried by its id",
        in "src/service/discovery/search.rs",
        tested by "services_are_asked_for_by_number_and_never_by_wildcard";
    "registers everywhere": [JausPlusPlus], Recorded, By(&[RegistersAcrossSubsystems]) =>
        does "sends Register Services to components of other subsystems, every 5 s",
        ours "the services are recorded like those of a report, without an answer",
        in "src/service/discovery/learn.rs",
        tested by "a_registration_from_another_subsystem_is_learned_and_not_answered";
    "Clear Emergency is Set Emergency": [JausPlusPlus], Provoked, NeedNotBe =>
        does "sends Set Emergency (0006h) for Clear Emergency, and does not know 0007h: only Reset \
            (0005h) ends its own emergencies",
        ours "the message is taken literally: the emergency stays, however often it is set. One \
            Clear Emergency with the client's id ends it, or the vehicle's application",
        in "src/service/control/management.rs",
        tested by "an_emergency_that_is_set_again_stays_and_is_cleared_at_once";
    "no heartbeats": [JausPlusPlus], Provoked, NeedNotBe =>
        does "never sends Report Heartbeat Pulse by itself",
        ours "any message is a sign of life, and a silent peer is sent Query Identification",
        in "src/service/discovery/search.rs",
        tested by "a_peer_that_only_answers_is_not_lost";
    "version octet before each message": [JausPlusPlus], Recorded, By(&[RepeatedVersion]) =>
        does "writes the version octet before each message of a TCP stream, in its own segment",
        ours "both forms are accepted, and each peer is answered in its own form, because JAUS++ \
            hangs without the octet. It also hangs if a message of ours arrives in two segments: \
            use UDP with it",
        in "src/wire/jtcp/decoder.rs",
        tested by "a_version_octet_before_each_message_is_read";
    "one-way connections": [JausPlusPlus], Recorded,
        By(&[RegistersAcrossSubsystems, StaleOctets, RepeatedVersion]) =>
        does "opens a TCP connection to each peer it receives UDP from, and sends on it; it reads \
            answers there only after version octets, or hangs",
        ours "after the first version octet in mid-stream it is answered by UDP, on which it \
            received us before it connected. Do not list it in `tcp.connect`: it then does not \
            find us",
        in "src/endpoint/receive.rs",
        tested by "jauspp_that_connects_is_answered_where_it_reads";
    "multicasts to unknown ids": [Junior, Jts, Fkie], Recorded, By(&[CallsUnknownIds]) =>
        does "sends a message for an id with an unknown address to the group, as a global \
            broadcast that requests acknowledgement, until it is acknowledged",
        ours "it is acknowledged from our unicast address, and delivered to that component only",
        in "src/endpoint/receive.rs",
        tested by "a_call_of_junior_is_acknowledged_by_the_one_alone_from_its_own_address";
    "multicasts without the flag": [Fkie], Recorded, By(&[CallsUnknownIds]) =>
        does "its Python node manager does the same without the broadcast flag",
        ours "a multicast message for one id that requests acknowledgement is treated the same way",
        in "src/endpoint/receive.rs",
        tested by "a_broadcast_without_its_flag_is_recognised_by_its_multicast_address";
    "priority 0 sets all flags": [Junior, Jts], Recorded, By(&[PriorityFault]) =>
        does "writes flags FFh for priority 0, which decodes as an acknowledgement of a last \
            fragment",
        ours "dropped and counted by its own counter, because the flags no longer show whether it \
            is a whole message. Its application must use priorities 1 to 15",
        in "src/endpoint/receive.rs",
        tested by "juniors_priority_zero_fault_is_dropped_and_counted_by_its_name";
    "restarts numbering": [Junior, Jts, Fkie], Provoked, NeedNotBe =>
        does "starts with number 1 in each process",
        ours "duplicates are recognised by content too, not by number alone, and only briefly: 0.9 \
            s for a known Junior, because it stops retransmitting earlier; a fragment missing from \
            a reassembly is always accepted",
        in "src/endpoint/receive.rs",
        tested by "a_large_message_of_a_restarted_junior_arrives_despite_repeated_numbers_and_octets";
    "remembers numbers": [Junior, Jts], Recorded, NeedNotBe =>
        does "acknowledges and drops any message whose number it received from the same id within \
            3 s, even if that node was restarted since: if it drops a fragment, the large message \
            never arrives",
        ours "a node derives its first number from the clock, ahead of those it used before",
        in "src/endpoint/config.rs",
        tested by "a_restarted_node_uses_no_sequence_number_that_junior_remembers";
    "one id for each connection": [Junior, Jts, Fkie], Recorded, NeedNotBe =>
        does "assigns a TCP connection to the first id received on it, and opens one per id",
        ours "an id is answered on the connection of its last message, however many there are. \
            Over a connection that we open, only one of our components reaches it: let it connect, \
            or use UDP",
        in "src/link/tcp/mod.rs",
        tested by "each_id_is_answered_on_the_connection_on_which_it_was_heard_last";
    "dies with a connection": [Junior, Jts, Fkie], Recorded, NeedNotBe =>
        does "writes to a reset TCP connection, and SIGPIPE kills it: its engine, with all \
            components of its host",
        ours "a node that stops announces it on its connections, keeps reading, and retransmits \
            nothing on them for 200 ms, because that would be acknowledged late. Nothing helps if \
            our node is killed; start the engine with SIGPIPE ignored",
        in "src/link/tcp/mod.rs",
        tested by "a_peer_that_still_writes_when_the_link_hangs_up_is_not_cut_off";
    "compression flags from the wrong end": [Junior, Jts, Fkie], Provoked, NeedNotBe =>
        does "reads the header compression flags from bits 0-1 of the first octet, which hold the \
            message type",
        ours "the first octet of our messages is always 0, even in answers to one that is not",
        in "src/wire/as5669a.rs",
        tested by "the_first_octet_of_all_that_is_sent_is_zero";
    "discards fragments": [Junior, Jts, Fkie], Recorded,
        By(&[PriorityFault, LongFragments, CallsUnknownIds, BeginsWithOne]) =>
        does "reads ten datagrams at a time and keeps the latest 50 or 100 fragments of all \
            senders",
        ours "messages of more than 50 fragments (71 kB) are sent in its longest fragments, of \
            4079 octets, and more slowly if not acknowledged; acknowledgements pace the others. \
            Messages above 200 kB need a larger `MaxMsgHistory` there",
        in "src/endpoint/send.rs",
        tested by "to_junior_large_messages_have_no_more_fragments_than_it_keeps";
    "aliased ids": [Jts], Recorded, Configured =>
        does "reads a 0 in any octet of an id as a wildcard, so it also delivers messages for \
            1.1.1 to 513.1.1",
        ours "`Implementation::confuses` tells which ids it cannot distinguish; choose only subsystems below \
            256, or none below 256",
        in "src/peer/habits.rs",
        tested by "junior_of_the_tool_set_confuses_ids_with_zero_octets";
    "0 for \"all\"": [Iop, Jts], Read, By(&[IopService]) =>
        does "writes 0 for \"all subsystems\", \"all nodes\" or \"all components\" in destinations",
        ours "from such a peer a 0 is decoded as the wildcard of its field; from all others it is \
            invalid",
        in "src/endpoint/receive.rs",
        tested by "a_zero_stands_for_all_from_those_who_mean_it_so_and_from_nobody_else";
    "numbers per destination": [OpenJausSdk], Recorded, By(&[NumbersByDestination]) =>
        does "counts sequence numbers per destination, so numbers repeat",
        ours "duplicates are recognised by destination, number and content",
        in "src/endpoint/recent.rs",
        tested by "numbers_that_count_for_each_destination_are_no_duplicates";
    "queries whole nodes": [OpenJausSdk], Recorded, By(&[AsksWholeNodes]) =>
        does "sends queries for one component to all components of its node, as global broadcasts",
        ours "each addressed component answers for itself, by unicast",
        in "src/endpoint/receive.rs",
        tested by "a_question_to_a_whole_node_is_answered_by_unicast";
}
