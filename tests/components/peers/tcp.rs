//! Recorded TCP connections of Junior and JAUS++, replayed to our listening node, which answers on
//! the same connection.

use std::net::SocketAddr;

use super::asked::answers_to;
use super::stand_in::StandIn;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::{Config, Outgoing};
use jaus::messages::core::{QueryAuthority, QueryStatus, RegisterServices};
use jaus::peer::Implementation;
use jaus::wire::jtcp::Decoder;
use jaus::wire::{Frame, judp};
use jaus_test_kit::evidence;

/// The messages of the stream to (or from) the listening side.
fn messages(file: &str, to_listener: bool) -> Vec<(SocketAddr, Vec<Frame>)> {
    let all = crate::streams::streams(&evidence::captures().join(file));
    let wanted = all
        .into_iter()
        .filter(|((_, to), _)| (*to == judp::PORT) == to_listener);
    let decode = |((from, to), octets): ((u16, u16), Vec<u8>)| {
        let mut decoder = Decoder::new();
        decoder.input().extend_from_slice(&octets);
        let frames = std::iter::from_fn(|| decoder.next_frame().expect("a sound stream"));
        let client = if to_listener { from } else { to };
        (SocketAddr::from(([10, 77, 0, 1], client)), frames.collect())
    };
    wanted.map(decode).collect()
}

fn listening(id: JausId, address: &str) -> StandIn {
    let mut stand_in = StandIn::new(address.parse().unwrap(), Config::default());
    stand_in.listen();
    stand_in.endpoint.attach(id).unwrap();
    stand_in
}

#[test]
fn junior_is_answered_on_its_connection_with_the_messages_that_junior_answered() {
    let us = JausId::new(2, 1, 1);
    let asked = messages("junior/13-jtcp.pcap", true);
    let answered = messages("junior/13-jtcp.pcap", false);
    let mut stand_in = listening(us, "10.77.0.2:3794");
    let (connection, frames) = &asked[0];
    for frame in frames {
        stand_in.hear_frame(*connection, frame);
        for heard in std::mem::take(&mut stand_in.heard) {
            stand_in.say(Outgoing::new(us, heard.source, heard.payload));
        }
    }
    assert!(
        stand_in
            .said
            .iter()
            .all(|it| it.is_to(*connection) && !it.by_udp)
    );
    let ours: Vec<_> = stand_in.said.iter().map(|it| it.frame.clone()).collect();
    assert_eq!(ours, answered[0].1);
}

#[test]
fn juniors_64_kb_arrive_whole_over_its_connection() {
    let us = JausId::new(2, 1, 1);
    let asked = messages("junior/14-jtcp-64KB.pcap", true);
    let mut stand_in = listening(us, "10.77.0.2:3794");
    for frame in &asked[0].1 {
        stand_in.hear_frame(asked[0].0, frame);
    }
    let lengths: Vec<_> = stand_in.heard.iter().map(|it| it.payload.len()).collect();
    assert_eq!(lengths, [8, 65_536]);
}

/// JAUS++ reads nothing on a connection that it opened. Once it is recognised, its next UDP
/// message, at most five seconds later, gives the address for all further answers.
#[test]
fn jauspp_is_answered_by_udp_once_it_has_registered_and_called() {
    let captures = evidence::captures();
    let (us, peer) = (JausId::new(102, 1, 1), JausId::new(101, 1, 1));
    let its_address: SocketAddr = "10.99.0.1:3794".parse().unwrap();
    let mut stand_in = StandIn::new("10.99.0.2:3794".parse().unwrap(), Config::default());
    stand_in.listen();
    stand_in.stand_in(super::drivable::operator(us));
    let calls = super::recorded::datagrams(&captures.join("jauspp/06-jtcp.pcap"));
    let mut calls = calls.iter().filter(|it| it.source == its_address);
    stand_in.hear(its_address, calls.next().unwrap().payload.clone());
    let streams = messages("jauspp/06-jtcp.pcap", true);
    let (connection, frames) = streams
        .iter()
        .find(|(_, frames)| frames[0].source == peer)
        .unwrap();
    let connection = SocketAddr::new(its_address.ip(), connection.port());
    let (mut registered, mut answered) = (false, 0);
    for frame in frames {
        let code = frame.code().unwrap();
        let before = stand_in.said.len();
        stand_in.hear_frame(connection, frame);
        let wanted = answers_to(code);
        let answer = stand_in.said[before..]
            .iter()
            .find(|it| wanted.contains(&it.code()));
        match answer {
            Some(answer) => {
                answered += 1;
                assert_eq!(answer.is_to(its_address), answer.by_udp);
                assert!(
                    answer.by_udp || !registered,
                    "{code:04X}h by the connection"
                );
            }
            // An operator offers neither service.
            None => assert!(
                wanted.is_empty() || [QueryAuthority::CODE, QueryStatus::CODE].contains(&code),
                "{code:04X}h has no answer"
            ),
        }
        if code == RegisterServices::CODE && !registered {
            registered = true;
            stand_in.hear(its_address, calls.next().unwrap().payload.clone());
        }
    }
    assert!(registered && answered > 3, "{answered}");
    let known = stand_in.endpoint.peers().find(|it| it.id == peer).unwrap();
    assert_eq!(known.profile, Implementation::JausPlusPlus);
}
