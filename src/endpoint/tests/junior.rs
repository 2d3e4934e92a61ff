//! What Junior does with what we send, and what its processes send: its memory of numbers, its
//! restarts, its calls.

use std::collections::HashMap;

use super::*;
use crate::peer::{Assignment, Peer as Known};

const CODE: [u8; 2] = [0xF0, 0xD7];

/// For how long Junior takes a number for one that it has heard before, with its settings file and
/// without.
const REMEMBERED: [Duration; 2] = [Duration::from_secs(3), Duration::from_secs(10)];

fn message(octets: usize) -> Bytes {
    let rest = (0..octets - CODE.len()).map(|octet| (octet / 251 + octet) as u8);
    CODE.into_iter().chain(rest).collect()
}

/// Junior's memory of the numbers of one id. Whatever has one of them is acknowledged and dropped.
struct Memory {
    heard: HashMap<u16, Instant>,
    time: Duration,
    dropped: usize,
}

impl Memory {
    fn hear(&mut self, now: Instant, number: u16) {
        match self.heard.get(&number) {
            Some(&before) if now - before <= self.time => self.dropped += 1,
            _ => {
                self.heard.insert(number, now);
            }
        }
    }
}

#[test]
fn a_node_that_is_started_again_and_again_uses_no_number_that_junior_remembers() {
    let started = Duration::from_millis(1_795_294_742_000);
    for time in REMEMBERED {
        let mut junior = Memory {
            heard: HashMap::new(),
            time,
            dropped: 0,
        };
        let begin = Rig::new().now;
        // As a command that is run again and again: greeting, 1 MiB, end.
        for run in 0..40 {
            let alive = Duration::from_millis(200) * run;
            let mut rig = Rig::with(Config {
                first_sequence: first_sequence_at(started + alive),
                profiles: vec![Assignment {
                    id: PEER,
                    profile: Known::Junior,
                }],
                ..Config::default()
            });
            rig.now = begin + alive;
            rig.meet_peer();
            rig.send(to_peer()).unwrap();
            rig.send(Outgoing {
                payload: message(1 << 20),
                ..to_peer()
            })
            .unwrap();
            let mut sent = 0;
            while sent < 1 + 258 {
                for (_, frame) in rig.sent() {
                    junior.hear(rig.now, frame.sequence);
                    sent += 1;
                }
                rig.pass(Duration::from_millis(1));
            }
        }
        assert_eq!(junior.dropped, 0, "remembered for {time:?}");
    }
}
