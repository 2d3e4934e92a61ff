//! What goes wrong in a trial, and when it is right again.

use std::collections::BTreeMap;
use std::time::Duration;

use serde_json::json;

use crate::air::Weather;
use crate::cable::Wire;
use crate::world::{STATION, World};

pub(crate) struct Mishaps {
    next: Duration,
    ends: BTreeMap<(Duration, u64), End>,
    count: u64,
}

/// The end of a mishap.
#[derive(Clone, Copy, Debug)]
enum End {
    Cable(usize),
    Air(usize),
    Station,
    Vehicle(usize),
    Show(usize),
    /// The station notices that the connections of a page are broken.
    Connection(usize, (u64, u64)),
}

/// The greatest slew: the default limit of chrony.
const SLEW: f64 = 0.08;

impl Mishaps {
    pub(crate) const fn new(begin: Duration) -> Self {
        Self {
            next: begin,
            ends: BTreeMap::new(),
            count: 0,
        }
    }

    pub(crate) fn live(&mut self, world: &mut World) {
        while let Some(entry) = self.ends.first_entry() {
            if entry.key().0 > world.now {
                break;
            }
            let end = entry.remove();
            Self::end(world, end);
        }
        if world.now >= self.next {
            self.next = world.now + world.random.between(&ms(100, 2500));
            self.happen(world);
        }
    }

    /// Nothing goes wrong any more, and what is wrong becomes right.
    pub(crate) fn heal(&mut self, world: &mut World) {
        for end in std::mem::take(&mut self.ends).into_values() {
            Self::end(world, end);
        }
        for page in &mut world.pages {
            page.cable.mend(world.now);
        }
        world.air.weather = Weather::good();
        world.trace(|| "all is well".to_owned());
    }

    fn end(world: &mut World, end: End) {
        world.trace(|| format!("over: {end:?}"));
        let now = world.now;
        match end {
            End::Cable(page) => world.pages[page].cable.restore(now),
            End::Air(host) => world.air.set_cut(STATION, host, false),
            End::Station => world.start_station(),
            End::Vehicle(vehicle) => world.start_vehicle(vehicle),
            End::Show(page) => world.pages[page].happen(json!(["hide", false])),
            End::Connection(page, connection) => {
                let frame = crate::cable::Frame::Close;
                world.pages[page].cable.send_up(now, connection, frame);
            }
        }
    }

    fn later(&mut self, world: &mut World, from: u64, to: u64, end: End) {
        let at = world.now + world.random.between(&ms(from, to));
        self.count += 1;
        self.ends.insert((at, self.count), end);
    }

    fn happen(&mut self, world: &mut World) {
        let page = world.random.below(2);
        let vehicle = world.random.below(2);
        match world.random.below(14) {
            0 => self.cut(world, page),
            1 => self.break_connections(world, page),
            2 if world.host(STATION).is_alive() => self.kill_station(world),
            3 if world.host(1 + vehicle).is_alive() => {
                world.trace(|| format!("vehicle {vehicle} is killed"));
                world.kill_vehicle(vehicle);
                self.later(world, 1, 400, End::Vehicle(vehicle));
            }
            4 => {
                let now = world.now;
                world.interrupt(page, json!(["window", "pagehide"]));
                world.pages[page].open(now, false);
                world.witness.forget_stops(page);
            }
            5 if world.pages[page].frozen.is_none() => {
                let until = world.now + world.random.between(&ms(50, 3000));
                world.trace(|| format!("page {page} stands still until {until:.3?}"));
                world.pages[page].frozen = Some(until);
            }
            6 => {
                let events = [
                    json!(["window", "blur"]),
                    json!(["window", "resize"]),
                    json!(["menu"]),
                ];
                let event = events[world.random.below(3)].clone();
                world.interrupt(page, event);
            }
            7 => {
                world.interrupt(page, json!(["hide", true]));
                self.later(world, 100, 2000, End::Show(page));
            }
            8 => {
                let wire = some_wire(world);
                world.trace(|| format!("page {page}: {wire:?}"));
                world.pages[page].cable.wire = wire;
            }
            9 => {
                world.air.weather = some_weather(world);
                world.trace(|| format!("{:?}", world.air.weather));
            }
            10 if !world.air.is_cut(STATION, 1 + vehicle) => {
                world.trace(|| format!("vehicle {vehicle} is cut off"));
                world.air.set_cut(STATION, 1 + vehicle, true);
                self.later(world, 50, 3000, End::Air(1 + vehicle));
            }
            11 => step_a_clock(world),
            12 => slew_a_clock(world),
            // Nothing.
            _ => {}
        }
    }

    /// The operator of a page stops its vehicle, and what carries the stop fails at that moment.
    pub(crate) fn strike(&mut self, world: &mut World, page: usize) {
        let fault = world.random.below(4);
        if fault == 0 {
            self.cut(world, page);
        }
        world.stop(page);
        match fault {
            0 | 1 => self.break_connections(world, page),
            2 if world.host(STATION).is_alive() => self.kill_station(world),
            _ => {}
        }
    }

    fn cut(&mut self, world: &mut World, page: usize) {
        if !world.pages[page].cable.is_cut() {
            world.trace(|| format!("page {page}: cut"));
            let now = world.now;
            world.pages[page].cable.cut(now);
            self.later(world, 50, 3000, End::Cable(page));
        }
    }

    fn kill_station(&mut self, world: &mut World) {
        world.trace(|| "the station is killed".to_owned());
        world.kill_station();
        self.later(world, 1, 400, End::Station);
    }

    /// The connections of a page break; the station learns of it later.
    fn break_connections(&mut self, world: &mut World, page: usize) {
        world.trace(|| format!("page {page}: connections break"));
        world.witness.handle_break(page, world.now);
        for connection in world.pages[page].break_connections() {
            self.later(world, 1, 3000, End::Connection(page, connection));
        }
    }
}

pub(crate) fn step_a_clock(world: &mut World) {
    let host = world.random.below(3);
    let seconds = world.random.choose(&[0.2, 1.0, 60.0, 86_400.0, 3e7]);
    let sign = world.random.choose(&[-1.0, 1.0]);
    world.trace(|| {
        format!(
            "the clock of host {host} is stepped by {} s",
            sign * seconds
        )
    });
    world.host(host).step_clock(sign * seconds);
}

/// The rate of a clock that is slewed, or of one that is not.
pub(crate) fn some_rate(world: &mut World) -> f64 {
    world.random.choose(&[1.0, 1.0 + SLEW, 1.0 - SLEW])
}

pub(crate) fn slew_a_clock(world: &mut World) {
    let (clock, rate) = (world.random.below(5), some_rate(world));
    world.trace(|| format!("clock {clock} runs at {rate}"));
    world.witness.handle_rate(rate);
    match clock {
        3 | 4 => world.pages[clock - 3].slew(rate),
        _ => world.host(clock).slew(rate),
    }
}

fn some_wire(world: &mut World) -> Wire {
    let random = &mut world.random;
    let delay = random.choose(&[2, 2, 20, 100, 300, 800]);
    let jitter = random.choose(&[1, 1, 30, 100]);
    Wire {
        delay: Duration::from_millis(delay),
        jitter: Duration::from_millis(jitter),
        lost: random.choose(&[0, 0, 50, 300]),
        rate: random.choose(&[None, None, None, Some(400.0), Some(4000.0)]),
    }
}

fn some_weather(world: &mut World) -> Weather {
    let random = &mut world.random;
    let latency = random.choose(&[3, 3, 30, 150]);
    Weather {
        latency: Duration::from_millis(1)..Duration::from_millis(latency),
        lost: random.choose(&[0, 0, 50, 300]),
        repeated: random.choose(&[0, 100]),
        detoured: random.choose(&[0, 100]),
        detour: Duration::from_millis(random.choose(&[100, 1500])),
    }
}

const fn ms(from: u64, to: u64) -> std::ops::Range<Duration> {
    Duration::from_millis(from)..Duration::from_millis(to)
}
