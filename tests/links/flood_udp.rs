//! A flood over real sockets: while one socket sends 100 000 packets from 10 000 forged senders,
//! two components keep communicating. Loopback only.

use std::collections::BTreeSet;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Counter, Outgoing};
use jaus::node::{Config, Node, Port};
use jaus::wire::{Frame, judp};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::within_limit;

const FLOOD: u32 = 100_000;
const SOURCES: u32 = 10_000;
/// Packets per volley, and the pause after each: 20 000 packets a second.
const VOLLEY: u32 = 40;
const PAUSE: Duration = Duration::from_millis(2);

/// How long the client waits for an answer before its next query. A later answer counts too.
const PATIENCE: Duration = Duration::from_millis(500);

/// Sends the flood, and sets `over` at its end.
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
        // Datagrams refused by the kernel are lost, as on a network.
        let _ = socket.send_to(&judp::encode(&frame).unwrap(), victim);
        if number % VOLLEY == 0 {
            std::thread::sleep(PAUSE);
        }
    }
    over.store(true, Ordering::Relaxed);
}

/// Sends queries, and tracks the unanswered ones.
struct Asker {
    port: Port,
    answerer: JausId,
    asked: u32,
    unanswered: BTreeSet<u32>,
}

impl Asker {
    /// Sends one query, and waits up to `PATIENCE` for its answer.
    async fn ask(&mut self) {
        self.asked += 1;
        let number = self.asked;
        let question = [&[0x02, 0x22][..], &number.to_le_bytes()].concat();
        let question = Outgoing::new(self.port.id(), self.answerer, question.into());
        self.port.send(question).unwrap();
        self.unanswered.insert(number);
        let answered = async {
            while self.unanswered.contains(&number) {
                self.hear().await;
            }
        };
        let _ = tokio::time::timeout(PATIENCE, answered).await;
    }

    async fn hear(&mut self) {
        let message = self.port.recv().await.expect("a running node");
        if let Some(number) = message.payload.get(2..).and_then(|it| it.first_chunk()) {
            self.unanswered.remove(&u32::from_le_bytes(*number));
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_conversation_goes_on_under_a_flood() {
    let group = own_group();
    let start = |subsystem| Node::start(Config::loopback(subsystem, 1).group(group)).unwrap();
    let (victim, other) = (start(101), start(102));
    let mut answerer = victim.attach(1).unwrap();
    let mut asker = Asker {
        port: other.attach(1).unwrap(),
        answerer: answerer.id(),
        asked: 0,
        unanswered: BTreeSet::new(),
    };
    let (answerer_id, asker_id) = (answerer.id(), asker.port.id());
    let answers = tokio::spawn(async move {
        while let Some(question) = answerer.recv().await {
            if question.source == asker_id {
                let answer = Outgoing::new(answerer_id, asker_id, question.payload);
                let _ = answerer.send(answer);
            }
        }
    });
    asker.ask().await;

    let over = Arc::new(AtomicBool::new(false));
    let (target, told) = (victim.links()[0].local, over.clone());
    let flooding = std::thread::spawn(move || flood(target, answerer_id, &told));
    while !over.load(Ordering::Relaxed) || asker.asked < 200 {
        asker.ask().await;
    }
    flooding.join().unwrap();
    println!(
        "{} questions, {} unanswered",
        asker.asked,
        asker.unanswered.len()
    );
    println!("{}", victim.counters());
    within_limit(async {
        while asker.unanswered.len() * 100 > asker.asked as usize {
            asker.hear().await;
        }
    })
    .await;
    assert!(
        victim.counters().get(Counter::NewIdRate) > 0,
        "the flood is seen"
    );
    assert!(victim.peers().len() <= 1024);
    answers.abort();
}
