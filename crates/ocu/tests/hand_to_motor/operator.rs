//! An operator at a page: takes control, holds, lets go, stops, and clears, at times of a seed.

use std::time::Duration;

use serde_json::json;

use crate::page::Device;
use crate::world::{VEHICLES, World};

pub(crate) struct Operator {
    page: usize,
    /// When the operator looks at the page next.
    next: Duration,
    /// What the operator is after.
    pub(crate) intent: Intent,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Intent {
    /// Anything that the page offers.
    Any,
    /// Nothing.
    Nothing,
    /// To move what the page shows, without clearing its emergency.
    Push,
    /// To drive a vehicle, by its number from 0, and nothing else.
    Drive(usize),
}

impl Operator {
    pub(crate) const fn new(page: usize, intent: Intent) -> Self {
        Self {
            page,
            next: Duration::from_millis(500),
            intent,
        }
    }

    pub(crate) fn live(&mut self, world: &mut World) {
        if world.now < self.next {
            return;
        }
        self.next = world.now + world.random.between(&ms(50, 400));
        if world.pages[self.page].frozen.is_some() {
            return;
        }
        match self.intent {
            Intent::Any => self.do_anything(world),
            Intent::Nothing => {}
            Intent::Push => self.push(world),
            Intent::Drive(vehicle) => self.drive(world, vehicle),
        }
    }

    fn do_anything(&mut self, world: &mut World) {
        let page = self.page;
        if world.pages[page].grip.is_some() {
            if world.random.happens(30) {
                world.stop(page);
            }
            return;
        }
        let view = world.pages[page].view.clone();
        match view.emergency.as_str() {
            "ready" | "barred" => {}
            _ if world.random.happens(300) => return world.clear(page),
            _ => {}
        }
        if world.random.happens(20) {
            return self.choose(world, VEHICLES[world.now.as_millis() as usize / 2 % 2]);
        }
        if view.by_hand && world.random.happens(800) {
            return self.engage(world);
        }
        let is_ready = view.line.starts_with("Ready");
        if is_ready || world.random.happens(100) {
            let time = world.random.between(&ms(50, 3000));
            self.hold(world, time, 250);
        } else if world.random.happens(20) {
            world.stop(page);
        }
    }

    /// Drives one vehicle, with whatever the page offers for that.
    fn drive(&mut self, world: &mut World, vehicle: usize) {
        let page = self.page;
        if world.pages[page].grip.is_some() {
            return;
        }
        let view = world.pages[page].view.clone();
        if view.vehicle != VEHICLES[vehicle] {
            self.choose(world, VEHICLES[vehicle]);
        } else if !matches!(view.emergency.as_str(), "ready" | "barred") {
            world.clear(page);
            self.next = world.now + Duration::from_millis(700);
        } else if view.by_hand {
            self.engage(world);
        } else if view.line.starts_with("Ready") || view.line.starts_with("Stopped") {
            let time = world.random.between(&ms(1000, 2500));
            self.hold(world, time, 0);
        } else {
            // Keys and gamepads are off in other views.
            world.pages[page].happen(json!(["show", "drive"]));
        }
    }

    fn push(&self, world: &mut World) {
        let page = &mut world.pages[self.page];
        if page.grip.is_none() {
            page.happen(json!(["click", "by-hand"]));
            self.hold(world, Duration::from_secs(1), 0);
        }
    }

    fn hold(&self, world: &mut World, time: Duration, lost_of_1000: u32) {
        let devices = [Device::Keys, Device::Touch, Device::Gamepad];
        let device = world.random.choose(&devices);
        let gets_lost = world.random.happens(lost_of_1000);
        world.hold(self.page, device, time, gets_lost);
    }

    fn engage(&mut self, world: &mut World) {
        world.trace(|| format!("page {}: drive by hand", self.page));
        world.pages[self.page].happen(json!(["click", "by-hand"]));
        self.next = world.now + Duration::from_millis(500);
    }

    fn choose(&mut self, world: &mut World, vehicle: u16) {
        world.interrupt(self.page, json!(["choose", vehicle]));
        self.next = world.now + Duration::from_millis(500);
    }
}

const fn ms(from: u64, to: u64) -> std::ops::Range<Duration> {
    Duration::from_millis(from)..Duration::from_millis(to)
}
