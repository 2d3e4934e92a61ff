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
    pub told: Recognition,
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
        does: "leaves the end of an older, longer datagram behind a message",
        source: Recorded,
        told: By(&[Sign::StaleOctets]),
        ours: "reading stops at the first implausible header; what is left is counted, and neither \
               delivered nor learned from",
        place: "src/wire/judp.rs",
        test: "stale_octets_behind_a_message_are_counted_and_nothing_else",
    },
    Departure {
        name: "code in each fragment",
        peers: &[JausPlusPlus],
        does: "begins each fragment of a large message with the message code, 1573 octets in all \
               but the last, and reads nothing else",
        source: Provoked,
        told: By(&[Sign::RepeatedCode, Sign::JausPlusPlusService]),
        ours: "its large messages are put together without the repeated codes, and ours to it are \
               cut as it cuts",
        place: "src/endpoint/large/style.rs",
        test: "the_code_that_jauspp_repeats_is_left_out_and_repeated_to_it_from_then_on",
    },
    Departure {
        name: "no last fragment",
        peers: &[JausPlusPlus],
        does: "does not mark the last fragment of a message that fills all its fragments",
        source: Read,
        told: By(&[Sign::RepeatedCode]),
        ours: "the message is whole when its sender's next message has the number of the last \
               fragment, which JAUS++ gives twice",
        place: "src/endpoint/large/reassembly.rs",
        test: "a_message_of_jauspp_that_fills_its_fragments_is_whole_with_the_next_message",
    },
    Departure {
        name: "narrow reassembly",
        peers: &[JausPlusPlus],
        does: "takes at most 1425 octets in one packet, refuses the number 0 in fragments, and \
               loses a message whose numbers go round",
        source: Read,
        told: By(&[Sign::RepeatedCode, Sign::JausPlusPlusService]),
        ours: "no packet to it is longer; numbers leave out 0 and do not go round within a message \
               to anybody",
        place: "src/endpoint/large/split.rs",
        test: "to_jauspp_no_packet_is_longer_than_it_takes_and_numbers_do_not_go_round",
    },
    Departure {
        name: "slow reader",
        peers: &[JausPlusPlus],
        does: "reads one datagram in a millisecond, so that what comes faster overflows its \
               receive buffer: 200 kB without acknowledgements never arrive",
        source: Provoked,
        told: By(&[Sign::RepeatedCode, Sign::JausPlusPlusService]),
        ours: "the fragments of a large message that is not acknowledged leave at 600 in a second; \
               what is acknowledged goes no faster than it reads anyway. What one of its components \
               has to send must fit 655 350 octets",
        place: "src/endpoint/send.rs",
        test: "to_jauspp_large_messages_leave_no_faster_than_it_reads_datagrams",
    },
    Departure {
        name: "event numbers given twice",
        peers: &[JausPlusPlus],
        does: "counts events for each query by itself, so that several have one number, and Cancel \
               Event ends the first of them",
        source: Provoked,
        told: NeedNotBe,
        ours: "events are told apart by their reports; a subscription that a cancellation may have \
               hit is asked for again",
        place: "src/service/client/subscriptions.rs",
        test: "a_cancellation_that_may_have_hit_another_event_has_that_one_renewed",
    },
    Departure {
        name: "Update Event ends it",
        peers: &[JausPlusPlus],
        does: "crashes when it gets Update Event (01F1h)",
        source: Provoked,
        told: NeedNotBe,
        ours: "nobody is ever sent one: what is wanted otherwise is cancelled and created",
        place: "src/service/client/subscription.rs",
        test: "no_update_event_is_sent_in_the_whole_life_of_a_subscription",
    },
    Departure {
        name: "first event several times",
        peers: &[JausPlusPlus],
        does: "sends the first report of an event up to four times at once, with numbers of their \
               own",
        source: Recorded,
        told: NeedNotBe,
        ours: "each is a report like any other; none is taken for lost or for a stream of another",
        place: "src/service/client/subscription.rs",
        test: "a_first_report_that_comes_four_times_loses_nothing_and_cancels_nothing",
    },
    Departure {
        name: "looks after each event",
        peers: &[JausPlusPlus],
        does: "asks Query Events for one number every 5 s, and creates anew at 1 Hz whatever else \
               the answer does not list",
        source: Recorded,
        told: NeedNotBe,
        ours: "Report Events lists the event that was asked for, and then all others of the client",
        place: "src/service/events/mod.rs",
        test: "a_client_is_told_of_its_own_events_by_each_question",
    },
    Departure {
        name: "creates events again",
        peers: &[JausPlusPlus],
        does: "sends Create Event for what it has already",
        source: Recorded,
        told: NeedNotBe,
        ours: "same client, type and query are one event: its number is confirmed again, and no \
               second stream begins",
        place: "src/service/events/mod.rs",
        test: "creating_the_same_again_changes_the_rate_and_not_the_number_of_streams",
    },
    Departure {
        name: "reject codes one too low",
        peers: &[JausPlusPlus],
        does: "writes the response code of Reject Event Request one too low, and always, whatever \
               the presence vector says",
        source: Provoked,
        told: NeedNotBe,
        ours: "a code that the presence vector does not tell of is read, and one added",
        place: "src/service/client/rejection.rs",
        test: "a_code_that_the_presence_vector_does_not_tell_of_is_one_too_low",
    },
    Departure {
        name: "cannot read a rejection",
        peers: &[JausPlusPlus],
        does: "takes the first bit of the presence vector of Reject Event Request for a text, so \
               that one with a code alone is too short for it, and it waits in vain",
        source: Provoked,
        told: NeedNotBe,
        ours: "each rejection has code and text: then what JAUS++ expects is in the places where \
               the standard has it. It shows the code one too high",
        place: "src/service/events/rejecting.rs",
        test: "a_rejection_is_one_that_jauspp_reads_too",
    },
    Departure {
        name: "no wildcard in Query Services",
        peers: &[JausPlusPlus],
        does: "answers Query Services for node 255, component 255 with an empty list",
        source: Provoked,
        told: NeedNotBe,
        ours: "each component is asked for by its numbers",
        place: "src/service/discovery/search.rs",
        test: "services_are_asked_for_by_number_and_never_by_wildcard",
    },
    Departure {
        name: "registers everywhere",
        peers: &[JausPlusPlus],
        does: "sends Register Services to components of other subsystems, every 5 s",
        source: Recorded,
        told: By(&[Sign::RegistersAcrossSubsystems]),
        ours: "the services are taken note of like those of a report, and nothing is answered",
        place: "src/service/discovery/learn.rs",
        test: "a_registration_from_another_subsystem_is_learned_and_not_answered",
    },
    Departure {
        name: "Clear Emergency is Set Emergency",
        peers: &[JausPlusPlus],
        does: "sends Set Emergency (0006h) for Clear Emergency, and does not know 0007h: of its own \
               emergencies Reset (0005h) alone is the end",
        source: Provoked,
        told: NeedNotBe,
        ours: "it is taken at its word: the emergency stays, however often it is set. One Clear \
               Emergency with the client's id ends it, or the vehicle's application does",
        place: "src/service/control/management.rs",
        test: "an_emergency_that_is_set_again_stays_and_is_cleared_at_once",
    },
    Departure {
        name: "no heartbeats",
        peers: &[JausPlusPlus],
        does: "never sends Report Heartbeat Pulse by itself",
        source: Provoked,
        told: NeedNotBe,
        ours: "anything that comes is a sign of life, and who is silent is asked who it is",
        place: "src/service/discovery/search.rs",
        test: "a_peer_that_only_answers_is_not_lost",
    },
    Departure {
        name: "version octet before each message",
        peers: &[JausPlusPlus],
        does: "writes the version octet before each message of a TCP stream, as a segment of its \
               own",
        source: Recorded,
        told: By(&[Sign::RepeatedVersion]),
        ours: "both ways of writing are read, and who writes so is answered so, for it hangs when one \
               is missing. It hangs as well when a message of ours comes in two segments: use UDP \
               with it",
        place: "src/wire/jtcp/decoder.rs",
        test: "a_version_octet_before_each_message_is_read",
    },
    Departure {
        name: "one-way connections",
        peers: &[JausPlusPlus],
        does: "opens a TCP connection to whoever it hears by UDP and writes on it; what it is \
               answered there it reads behind version octets alone, or hangs",
        source: Recorded,
        told: By(&[
            Sign::RegistersAcrossSubsystems,
            Sign::StaleOctets,
            Sign::RepeatedVersion,
        ]),
        ours: "from the first version octet in the middle of its stream on it is answered by UDP, by \
               which it has heard us before it connects. Leave it out of `tcp.connect`: it does not \
               find us then",
        place: "src/endpoint/receive.rs",
        test: "jauspp_that_connects_is_answered_where_it_reads",
    },
    Departure {
        name: "calls unknown ids",
        peers: &[Junior, Jts, Fkie],
        does: "sends a message for one id whose address it does not know to the group, as a global \
               broadcast that wants an acknowledgement, until one comes",
        source: Recorded,
        told: By(&[Sign::CallsUnknownIds]),
        ours: "it is acknowledged from where we want to be reached, and delivered to the one",
        place: "src/endpoint/receive.rs",
        test: "a_call_of_junior_is_acknowledged_by_the_one_alone_from_its_own_address",
    },
    Departure {
        name: "calls without the flag",
        peers: &[Fkie],
        does: "its node manager in Python sends the same without the broadcast flag",
        source: Recorded,
        told: By(&[Sign::CallsUnknownIds]),
        ours: "a message for one id that comes by the group and wants an acknowledgement is such a \
               call",
        place: "src/endpoint/receive.rs",
        test: "a_call_without_its_flag_is_known_by_the_way_that_it_came",
    },
    Departure {
        name: "priority 0 sets all flags",
        peers: &[Junior, Jts],
        does: "writes flags FFh for priority 0, which reads as an acknowledgement of a last \
               fragment",
        source: Recorded,
        told: By(&[Sign::PriorityFault]),
        ours: "dropped and counted by its name: whether it is a whole message is lost with the \
               flags. The application must use priorities 1 to 15",
        place: "src/endpoint/receive.rs",
        test: "juniors_priority_zero_fault_is_dropped_and_counted_by_its_name",
    },
    Departure {
        name: "begins with 1 again",
        peers: &[Junior, Jts, Fkie],
        does: "begins with number 1 in each process",
        source: Provoked,
        told: NeedNotBe,
        ours: "content counts, not the number alone, and only for a short time: of who is known to \
               be Junior 0.9 s, because it gives up repeating sooner; and a fragment that a message \
               which is being put together lacks is taken in any case",
        place: "src/endpoint/receive.rs",
        test: "a_large_message_of_a_restarted_junior_arrives_though_its_numbers_and_octets_come_again",
    },
    Departure {
        name: "remembers numbers",
        peers: &[Junior, Jts],
        does: "acknowledges and drops what has a number that it heard of the same id within 3 s, \
               also of a node that was started again since: a fragment of it, and a large message \
               never arrives",
        source: Recorded,
        told: NeedNotBe,
        ours: "a node begins at a number that the clock tells, ahead of those that it used before",
        place: "src/endpoint/config.rs",
        test: "a_node_that_is_started_again_and_again_uses_no_number_that_junior_remembers",
    },
    Departure {
        name: "one id for each connection",
        peers: &[Junior, Jts, Fkie],
        does: "takes a TCP connection for the first id that is heard on it, and opens one for each \
               id",
        source: Recorded,
        told: NeedNotBe,
        ours: "an id is answered on the connection on which it was heard last, however many there \
               are. Only one of our components reaches it by a connection of ours: let it connect, \
               or use UDP",
        place: "src/link/tcp/mod.rs",
        test: "each_id_is_answered_on_the_connection_on_which_it_was_heard_last",
    },
    Departure {
        name: "ends with a connection",
        peers: &[Junior, Jts, Fkie],
        does: "writes to a TCP connection that was reset as to any other, and is ended by the \
               signal SIGPIPE: its engine, with all that are on its host",
        source: Recorded,
        told: NeedNotBe,
        ours: "a node that stops says so on its connections and takes in what still comes, and \
               repeats nothing on them within 200 ms, which would be acknowledged late. Nothing \
               helps when a node of ours is killed; start the engine with that signal ignored",
        place: "src/link/tcp/mod.rs",
        test: "a_peer_that_still_writes_when_the_link_hangs_up_is_not_cut_off",
    },
    Departure {
        name: "compression flags from the wrong end",
        peers: &[Junior, Jts, Fkie],
        does: "reads the header compression flags from bits 0-1 of the first octet, where the \
               message type is",
        source: Provoked,
        told: NeedNotBe,
        ours: "the first octet of what we send is always 0, also in answer to one that is not",
        place: "src/wire/as5669a.rs",
        test: "the_first_octet_of_all_that_is_sent_is_zero",
    },
    Departure {
        name: "forgets fragments",
        peers: &[Junior, Jts, Fkie],
        does: "takes ten datagrams in a turn and keeps the latest 50 or 100 fragments of all \
               senders",
        source: Recorded,
        told: By(&[
            Sign::PriorityFault,
            Sign::LongFragments,
            Sign::CallsUnknownIds,
            Sign::BeginsWithOne,
        ]),
        ours: "what would be more than 50 fragments (71 kB) is cut in its longest, of 4079 octets, \
               and leaves more slowly if it is not acknowledged; what is acknowledged goes no \
               faster than its receiver takes it anyway. Messages above 200 kB need a larger \
               `MaxMsgHistory` there",
        place: "src/endpoint/send.rs",
        test: "to_junior_large_messages_have_no_more_fragments_than_it_keeps",
    },
    Departure {
        name: "aliased ids",
        peers: &[Jts],
        does: "takes a 0 in any octet of an id for \"all\", so that it delivers what is for 1.1.1 \
               also to 513.1.1",
        source: Recorded,
        told: Configured,
        ours: "`Peer::confuses` tells which ids it cannot keep apart; choose subsystems below 256 \
               only, or none",
        place: "src/peer/habits.rs",
        test: "junior_of_the_tool_set_confuses_ids_with_zero_octets",
    },
    Departure {
        name: "0 for \"all\"",
        peers: &[Iop, Jts],
        does: "writes 0 for \"all subsystems\", \"all nodes\", \"all components\" into destinations",
        source: Read,
        told: By(&[Sign::IopService]),
        ours: "from such a peer a 0 is read as the wildcard of its field; from all others it names \
               nobody",
        place: "src/endpoint/receive.rs",
        test: "a_zero_stands_for_all_from_those_who_mean_it_so_and_from_nobody_else",
    },
    Departure {
        name: "numbers for each destination",
        peers: &[OpenJausSdk],
        does: "counts sequence numbers for each destination by itself, so that numbers come again",
        source: Recorded,
        told: By(&[Sign::NumbersByDestination]),
        ours: "the destination counts with the number, and the content with both",
        place: "src/endpoint/recent.rs",
        test: "numbers_that_count_for_each_destination_are_no_duplicates",
    },
    Departure {
        name: "asks whole nodes",
        peers: &[OpenJausSdk],
        does: "sends what is for one component to all of its node, as global broadcasts",
        source: Recorded,
        told: By(&[Sign::AsksWholeNodes]),
        ours: "each component that it is for answers to the asker alone, for itself",
        place: "src/endpoint/receive.rs",
        test: "a_question_to_a_whole_node_is_answered_by_unicast",
    },
];
