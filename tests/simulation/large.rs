//! A large acknowledged message over a wire that loses and reorders.

use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Config, Counter, Endpoint, Event, Outgoing};

use crate::sim::{Conditions, Mailbox, Network};
use crate::totals::Counts;

const FROM: JausId = JausId::new(101, 1, 1);
const TO: JausId = JausId::new(102, 1, 1);
const LENGTH: u32 = 1 << 20;

/// Sends one message of 1 MiB; fails if it does not arrive whole or is not acknowledged.
pub(crate) fn run(seed: u64) -> Result<Counts, String> {
    let conditions = Conditions {
        latency: Duration::from_micros(200)..Duration::from_millis(3),
        lost: 50,
        repeated: 10,
        detoured: 50,
        detour: Duration::from_millis(20),
        ..Conditions::good()
    };
    let mut network = Network::new(seed, conditions);
    let [from, to] = [FROM, TO].map(|id| {
        let mut endpoint = Endpoint::new(Config::default());
        endpoint.attach(id).expect("an id of one component");
        network.join(endpoint, Mailbox::default())
    });
    let words = (0..LENGTH / 4).flat_map(|word| (word ^ seed as u32).to_le_bytes());
    let payload: Bytes = words.collect();
    let message = Outgoing {
        acknowledge: true,
        ..Outgoing::new(FROM, TO, payload.clone())
    };
    let handle = network.send(from, message).map_err(|e| e.to_string())?;
    while network.step() {}
    let arrived = network.owner(to).take_messages();
    if !arrived
        .iter()
        .map(|received| &received.payload)
        .eq([&payload])
    {
        return Err(format!("{} messages arrived", arrived.len()));
    }
    let acknowledged = Event::Acknowledged {
        message: handle,
        by: TO,
    };
    let news = network.owner(from).take_news();
    if news.contains(&acknowledged) {
        let again = network
            .endpoint(from)
            .counters()
            .get(Counter::Retransmissions);
        Ok([
            ("fragments sent again", again),
            ("lost", network.harm().lost),
            ("overtaken", network.harm().detoured),
        ]
        .into())
    } else {
        Err(format!("it arrived, but: {news:?}"))
    }
}
