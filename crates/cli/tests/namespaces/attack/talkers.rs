//! Two nodes that exchange acknowledged messages, small and large, and count their delivery.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::Outgoing;
use jaus::node::{Config, Node, Sender};
use tokio::task::JoinSet;
use tokio::time::sleep;

use jaus_test_kit::hosts::SETTINGS;

/// Prefix of these messages, which no other component sends.
const CODE: [u8; 2] = [0x01, 0xD7];
/// Number of the last message.
const END: u32 = u32::MAX;
const LARGE: usize = 64_000;
const SMALL: usize = 170;
/// How long it sends, the limit of unacknowledged messages, and the pause between messages.
const TIME: Duration = Duration::from_secs(10);
const MOST_WAITING: usize = 8;
const PAUSE: Duration = Duration::from_millis(5);

fn message(number: u32) -> Bytes {
    let length = if number.is_multiple_of(4) {
        LARGE
    } else {
        SMALL
    };
    let content = (0..length as u32).map(|place| (place * 7).wrapping_add(number) as u8);
    let head = CODE.into_iter().chain(number.to_le_bytes());
    head.chain(content).collect()
}

#[derive(Default)]
struct Tally {
    heard: BTreeSet<u32>,
    doubles: u32,
    corrupt: u32,
}

impl Tally {
    fn take(&mut self, payload: &Bytes) {
        let Some(octets) = payload.strip_prefix(&CODE) else {
            return;
        };
        let number = octets.first_chunk().map(|&it| u32::from_le_bytes(it));
        match number.filter(|&number| message(number) == payload) {
            Some(number) => self.doubles += u32::from(!self.heard.insert(number)),
            None => self.corrupt += 1,
        }
    }
}

/// Sends for [`TIME`]. Returns how many messages were acknowledged, and how many were lost.
async fn send(sender: Sender, from: JausId, to: JausId) -> (u32, u32) {
    let outgoing = |number| Outgoing {
        acknowledge: true,
        ..Outgoing::new(from, to, message(number))
    };
    let (mut waiting, mut acknowledged, mut lost) = (JoinSet::new(), 0, 0);
    let mut count = |is_acknowledged: bool| match is_acknowledged {
        true => acknowledged += 1,
        false => lost += 1,
    };
    let end = Instant::now() + TIME;
    for number in 0.. {
        if Instant::now() >= end {
            break;
        }
        let (sender, outgoing) = (sender.clone(), outgoing(number));
        waiting.spawn(async move { sender.deliver(outgoing).await.is_ok() });
        sleep(PAUSE).await;
        while waiting.len() >= MOST_WAITING {
            count(waiting.join_next().await.unwrap().unwrap());
        }
    }
    waiting.join_all().await.into_iter().for_each(count);
    while sender.deliver(outgoing(END)).await.is_err() {}
    (acknowledged, lost)
}

pub(crate) async fn talk() {
    let settings = std::env::var(SETTINGS).unwrap();
    let ids = settings.split_once(' ').unwrap();
    let (own, other): (JausId, JausId) = (ids.0.parse().unwrap(), ids.1.parse().unwrap());
    let node = Node::start(Config::new(own.subsystem(), own.node())).unwrap();
    let mut port = node.attach(own.component()).unwrap();
    let hello = Outgoing {
        acknowledge: true,
        ..Outgoing::new(own, other, Bytes::from_static(b"\x02\x22"))
    };
    while port.deliver(hello.clone()).await.is_err() {}
    println!("\ntalker begins");
    let mut sending = tokio::spawn(send(port.sender(), own, other));
    let (mut sent, mut tally) = (None, Tally::default());
    while sent.is_none() || !tally.heard.contains(&END) {
        tokio::select! {
            received = port.recv() => {
                let received = received.unwrap();
                if received.source == other {
                    tally.take(&received.payload);
                }
            }
            result = &mut sending, if sent.is_none() => sent = Some(result.unwrap()),
        }
    }
    let (acknowledged, lost) = sent.unwrap();
    let heard = tally.heard.len() - 1;
    let Tally {
        doubles, corrupt, ..
    } = tally;
    println!(
        "\ntalker acknowledged={acknowledged} lost={lost} heard={heard} doubles={doubles} \
         corrupt={corrupt}"
    );
    // The peer may still wait for acknowledgements.
    std::future::pending::<()>().await;
}
