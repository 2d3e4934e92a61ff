//! A flood over real sockets: while one socket sends 100 000 packets of 10 000 forged senders, two
//! components keep communicating. Loopback only.

use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Counter, Outgoing};
use jaus::node::{Config, Node, Port};
use jaus::wire::{Frame, judp};
use jaus_test_kit::group::own_group;

const FLOOD: u32 = 100_000;
const SOURCES: u32 = 10_000;
/// Packets at once, and the pause behind them: 20 000 a second.
const VOLLEY: u32 = 40;
const PAUSE: Duration = Duration::from_millis(2);

/// What counts as lost; far more than a round trip takes.
const LOST: Duration = Duration::from_millis(500);

/// The bound for the median, which is some 0.3 ms also without optimisation.
const BOUND: Duration = Duration::from_millis(10);

/// Sends the flood, and says when it is over.
fn flood(victim: SocketAddr, receiver: JausId, over: &AtomicBool) {
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    for number in 0..FLOOD {
        let source = number % SOURCES;
        let source = JausId::new(1000 + (source / 250) as u16, 1, (source % 250 + 1) as u8);
        let frame = Frame {
            sequence: number as u16,
            ..Frame::new(
                source,
                receiver,
                Bytes::from_static(&[0x02, 0x42, 1, 2, 3, 4]),
            )
        };
        // Datagrams that the kernel refuses are lost, as on a network.
        let _ = socket.send_to(&judp::encode(&frame).unwrap(), victim);
        if number % VOLLEY == 0 {
            std::thread::sleep(PAUSE);
        }
    }
    over.store(true, Ordering::Relaxed);
}

/// One question and its answer, or [`LOST`].
async fn round_trip(asker: &mut Port, answerer: JausId, number: u32) -> Duration {
    let [one, two, three, four] = number.to_le_bytes();
    let question = Bytes::from(vec![0x02, 0x22, one, two, three, four]);
    let start = Instant::now();
    asker
        .send(Outgoing::new(asker.id(), answerer, question.clone()))
        .unwrap();
    let answer = async {
        while let Some(message) = asker.recv().await {
            if message.payload == question {
                return;
            }
        }
    };
    match tokio::time::timeout(LOST, answer).await {
        Ok(()) => start.elapsed(),
        Err(_) => LOST,
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_conversation_goes_on_under_a_flood() {
    let group = own_group();
    let start = |subsystem| Node::start(Config::loopback(subsystem, 1).group(group)).unwrap();
    let (victim, other) = (start(101), start(102));
    let (mut answerer, mut asker) = (victim.attach(1).unwrap(), other.attach(1).unwrap());
    let (answerer_id, asker_id) = (answerer.id(), asker.id());
    let answers = tokio::spawn(async move {
        while let Some(question) = answerer.recv().await {
            if question.source == asker_id {
                let answer = Outgoing::new(answerer_id, asker_id, question.payload);
                let _ = answerer.send(answer);
            }
        }
    });
    round_trip(&mut asker, answerer_id, 0).await;

    let over = Arc::new(AtomicBool::new(false));
    let (target, told) = (victim.links()[0].local, over.clone());
    let flooding = std::thread::spawn(move || flood(target, answerer_id, &told));
    let mut times = Vec::new();
    for number in 1.. {
        if over.load(Ordering::Relaxed) && times.len() >= 200 {
            break;
        }
        times.push(round_trip(&mut asker, answerer_id, number).await);
    }
    flooding.join().unwrap();
    times.sort_unstable();
    let (median, lost) = (
        times[times.len() / 2],
        times.iter().filter(|t| **t == LOST).count(),
    );
    println!(
        "{} round trips, {lost} lost, median {median:?}",
        times.len()
    );
    println!("{}", victim.counters());
    assert!(
        median < BOUND,
        "median {median:?} of {} round trips",
        times.len()
    );
    assert!(lost * 100 <= times.len(), "{lost} of {} lost", times.len());
    assert!(
        victim.counters().get(Counter::NewIdRate) > 0,
        "the flood is seen"
    );
    assert!(victim.peers().len() <= 1024);
    answers.abort();
}
