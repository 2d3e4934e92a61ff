//! Setpoints that a stop has overtaken, over a network that loses, delays and repeats.
//!
//! Two clients drive: one of this library, which cancels a setpoint when it sends the next one, and
//! a foreign one, which retransmits each setpoint for seconds, whatever it has sent since.

use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::endpoint::Outgoing;

use crate::cell::{Cell, Driver, Fault};
use crate::commands;
use crate::sim::{Conditions, Random};
use crate::vehicle::VEHICLE;
use crate::world::{CONTROLLER, World};

const SEEDS: u64 = 40;
/// The longest delay of a datagram.
const JITTER: Duration = Duration::from_millis(100);
/// The vehicle's control step: it takes up the stop within this time.
const STEP: Duration = Duration::from_millis(20);
/// Interval of setpoints.
const PERIOD: Duration = Duration::from_millis(100);

/// A client in control of a vehicle that is ready, and then a bad radio.
fn ready(seed: u64, driver: Driver) -> World {
    let cell = Cell {
        driver,
        fault: Fault::Killed,
    };
    let mut random = Random::new(seed);
    let mut world = World::new(&mut random, cell, Conditions::good());
    world.with_client(world.controller, |now, client| client.make_ready(now));
    world.run_for(Duration::from_secs(2));
    world.network.set_conditions(Conditions {
        latency: Duration::from_millis(1)..JITTER,
        lost: 300,
        repeated: 100,
        ..Conditions::good()
    });
    world
}

/// Sends a message with acknowledgement. If it `supersedes` the last one, that is cancelled.
fn deliver(world: &mut World, payload: Bytes, supersedes: bool) {
    let message = Outgoing {
        acknowledge: true,
        ..Outgoing::new(CONTROLLER, VEHICLE, payload)
    };
    let host = world.controller;
    let last = world.last_delivery.take();
    world.last_delivery = world.network.act(host, |now, _, endpoint| {
        if let Some(last) = last.filter(|_| supersedes) {
            endpoint.cancel(VEHICLE, last);
        }
        endpoint.send(now, message).ok()
    });
}

/// Sends setpoints for 1.2 s.
fn drive(world: &mut World, driver: Driver, cancels: bool) {
    for _ in 0..12 {
        for setpoint in commands::motion(driver) {
            deliver(world, setpoint, cancels);
        }
        world.run_for(PERIOD);
    }
}

/// When the program last ordered motion.
fn last_order(world: &World) -> Option<Instant> {
    world.plant.lock().order.last()
}

#[test]
fn no_setpoint_is_retransmitted_after_the_release() {
    for seed in 0..SEEDS {
        let mut world = ready(seed, Driver::Vector);
        drive(&mut world, Driver::Vector, true);
        assert!(last_order(&world).is_some(), "seed {seed}: it drove");
        let released = world.network.now();
        if let Some(last) = world.last_delivery.take() {
            let host = world.controller;
            let network = &mut world.network;
            network.act(host, |_, _, endpoint| endpoint.cancel(VEHICLE, last));
        }
        world.with_client(world.controller, |now, client| client.let_go(now));
        world.run_for(Duration::from_secs(8));
        let arrived = world.witness().last_setpoint.expect("setpoints");
        assert!(
            arrived <= released + JITTER,
            "seed {seed}: a setpoint arrived {:?} after the release",
            arrived - released
        );
    }
}

#[test]
fn a_setpoint_that_arrives_after_a_newer_stop_moves_nothing() {
    let mut late = 0;
    for seed in 0..SEEDS {
        // The vehicle's own drivers, and a service made of functions.
        let driver = [Driver::Effort, Driver::Own][seed as usize % 2];
        let mut world = ready(seed, driver);
        for number in 0..3 {
            drive(&mut world, driver, false);
            assert!(last_order(&world).is_some(), "seed {seed}: it drove");
            let stop = commands::stop(number);
            world.witness().stop = stop.clone();
            world.witness().last_stop = None;
            deliver(&mut world, stop, false);
            world.run_for(Duration::from_secs(6));
            // A stop that never arrives is the dead-man's case.
            let Some(stopped) = world.witness().last_stop else {
                continue;
            };
            let order = last_order(&world).expect("it drove");
            assert!(
                order <= stopped + STEP,
                "seed {seed}: motion was ordered {:?} after the stop had arrived",
                order - stopped
            );
            let setpoint = world.witness().last_setpoint.expect("setpoints");
            late += u64::from(setpoint > stopped);
        }
    }
    assert!(
        late > SEEDS / 2,
        "{late} stops were followed by older efforts"
    );
}
