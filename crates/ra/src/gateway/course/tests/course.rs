//! The list of JAUS clients at an RA driver.

use std::collections::BTreeMap;

use proptest::prelude::*;

use super::super::list::{Course, Refused};
use super::*;

/// An RA driver: its places by number, their order of arrival, and its speeds.
#[derive(Debug, Default)]
struct Driver {
    held: BTreeMap<u16, Bytes>,
    order: Vec<u16>,
    /// All received messages, in order.
    came: Vec<Bytes>,
    speeds: Vec<f64>,
    mute: bool,
    /// Whether it keeps the first place of a number, and reports only that.
    keeps: bool,
    /// Whether it stores several places under a number and reports all, as OpenJAUS does.
    appends: bool,
}

struct World {
    places: Places,
    now: Instant,
    course: Course,
    driver: Driver,
    /// Codes of the answers to clients.
    answers: Vec<u16>,
    refused: Vec<Refused>,
    /// Loses every n-th message; 0 loses none.
    loses: u32,
    sent: u32,
}

impl World {
    fn new(places: Places) -> Self {
        Self {
            places,
            now: start(),
            course: Course::new(places, PATIENCE),
            driver: Driver::default(),
            answers: Vec::new(),
            refused: Vec::new(),
            loses: 0,
            sent: 0,
        }
    }

    fn is_lost(&mut self) -> bool {
        self.sent += 1;
        self.loses > 0 && self.sent.is_multiple_of(self.loses)
    }

    fn command(&mut self, payload: &Bytes) {
        self.course.handle_command(self.now, payload);
        self.settle();
        for _ in 0..100_000 {
            let Some(wake) = self.course.poll_timeout() else {
                return;
            };
            self.now = self.now.max(wake);
            self.course.handle_timeout(self.now);
            self.settle();
        }
        panic!("it never ends");
    }

    fn settle(&mut self) {
        loop {
            let said = self.course.take_said();
            let answers = said.answers.iter();
            let codes = answers.filter_map(|answer| jaus::service::code_of(answer));
            self.answers.extend(codes);
            self.refused
                .extend(said.refused.into_iter().map(|(_, why)| why));
            if said.to_ra.is_empty() {
                return;
            }
            for (code, data) in said.to_ra {
                if !self.is_lost() {
                    self.arrive(code, &data);
                }
            }
        }
    }

    fn arrive(&mut self, code: u16, data: &Bytes) {
        let places = self.places;
        match code {
            0x040A => {
                let raw = u16::from_le_bytes([data[0], data[1]]);
                self.driver
                    .speeds
                    .push(f64::from(raw) * 10_000.0 / 65_535.0);
            }
            _ if code == places.set => {
                let number = places.number(data).unwrap();
                let held = self.driver.held.entry(number).or_default();
                if held.is_empty() || !self.driver.keeps {
                    *held = data.clone();
                }
                self.driver.order.push(number);
                self.driver.came.push(data.clone());
            }
            _ if code == places.query && !self.driver.mute => {
                let number = places.queried(data).unwrap();
                let all = self.driver.came.iter();
                let all = all.filter(|data| places.number(data) == Some(number));
                let told: Vec<Bytes> = match self.driver.appends {
                    true => all.cloned().collect(),
                    false => self.driver.held.get(&number).cloned().into_iter().collect(),
                };
                for held in told {
                    if !self.is_lost() {
                        let report = places.report();
                        self.course.handle_report(self.now, report, &held);
                    }
                }
            }
            _ => {}
        }
    }

    /// Sets elements 1, 2, … of these places.
    fn set_list(&mut self, places: &[u16]) {
        let kind = self.places;
        let count = places.len() as u16;
        let recs = (1..).zip(places).map(|(uid, &place)| {
            let next = if uid == count { 0 } else { uid + 1 };
            rec(kind, [uid - 1, uid, next], place)
        });
        self.command(&delete(u16::MAX));
        for chunk in recs.collect::<Vec<_>>().chunks(200) {
            let mut chunk = chunk.to_vec();
            // The next element follows in the next message.
            chunk.last_mut().unwrap().next_uid = 0;
            self.command(&set(chunk));
        }
    }

    /// The data of these places, numbered from 0.
    fn expected(&self, places: &[u16]) -> BTreeMap<u16, Bytes> {
        let kind = self.places;
        let data = |(number, &place)| (number, kind.to_ra(&element(kind, place), number).unwrap());
        (0..).zip(places).map(data).collect()
    }
}

fn near(speeds: &[f64], expected: &[f64]) {
    assert_eq!(speeds.len(), expected.len(), "{speeds:?}");
    for (speed, expected) in speeds.iter().zip(expected) {
        assert!((speed - expected).abs() < 0.1, "{speeds:?}");
    }
}

#[test]
fn a_list_arrives_in_order_and_then_the_speed() {
    for kind in [waypoints(), segments()] {
        let mut world = World::new(kind);
        world.set_list(&[10, 11, 12]);
        assert!(world.driver.held.is_empty(), "nothing is driven yet");
        world.command(&execute(Some(0), 2.0));
        assert_eq!(world.driver.held, world.expected(&[10, 11, 12]));
        assert_eq!(world.driver.order, [0, 1, 2]);
        near(&world.driver.speeds, &[2.0]);
        assert_eq!(world.refused, []);
    }
}

#[test]
fn a_list_is_driven_from_the_element_that_it_is_executed_from() {
    let mut world = World::new(waypoints());
    world.set_list(&[10, 11, 12]);
    world.command(&execute(Some(2), 2.0));
    assert_eq!(world.driver.held, world.expected(&[11, 12]));
}

#[test]
fn another_speed_gives_no_place_again_and_a_stop_comes_at_once() {
    let mut world = World::new(waypoints());
    world.set_list(&[10, 11]);
    world.command(&execute(None, 2.0));
    assert_eq!(world.refused, [Refused::NoSuchElement]);
    world.command(&execute(Some(0), 2.0));
    world.command(&execute(None, 3.0));
    world.command(&execute(None, 0.0));
    world.command(&execute(None, 1.0));
    near(&world.driver.speeds, &[2.0, 3.0, 0.0, 1.0]);
    assert_eq!(world.driver.order, [0, 1]);
}

#[test]
fn what_is_put_behind_the_last_or_replaced_under_way_is_given_at_once() {
    let mut world = World::new(waypoints());
    world.set_list(&[10, 11]);
    world.command(&execute(Some(0), 2.0));
    let more = vec![
        rec(waypoints(), [1, 2, 3], 21),
        rec(waypoints(), [2, 3, 0], 12),
    ];
    world.command(&set(more));
    assert_eq!(world.driver.held, world.expected(&[10, 21, 12]));
    assert_eq!(world.driver.order, [0, 1, 1, 2]);
}

#[test]
fn the_order_is_not_changed_under_way_but_after_a_stop_and_another_execution() {
    let mut world = World::new(waypoints());
    world.set_list(&[10, 11]);
    world.command(&execute(Some(0), 2.0));
    world.answers.clear();
    let between = set(vec![rec(waypoints(), [1, 9, 2], 19)]);
    world.command(&between);
    world.command(&delete(1));
    assert_eq!(world.answers, [0x041D, 0x041D]);
    assert_eq!(world.refused, [Refused::UnderWay, Refused::UnderWay]);
    world.command(&execute(None, 0.0));
    world.command(&between);
    assert_eq!(world.answers.last(), Some(&0x041C));
    world.command(&execute(None, 1.0));
    assert_eq!(world.refused.last(), Some(&Refused::Reordered));
    world.command(&execute(Some(0), 1.0));
    assert_eq!(world.driver.held, world.expected(&[10, 19, 11]));
}

#[test]
fn a_shorter_list_ends_with_its_last_waypoint_and_one_of_segments_is_refused() {
    let mut world = World::new(waypoints());
    world.set_list(&[10, 11, 12, 13]);
    world.command(&execute(Some(0), 2.0));
    world.set_list(&[20, 21]);
    near(&world.driver.speeds, &[2.0, 0.0]);
    world.command(&execute(Some(0), 2.0));
    assert_eq!(world.driver.held, world.expected(&[20, 21, 21, 21]));

    let mut world = World::new(segments());
    world.set_list(&[10, 11, 12]);
    world.command(&execute(Some(0), 2.0));
    world.set_list(&[20]);
    world.command(&execute(Some(0), 2.0));
    assert_eq!(world.refused, [Refused::Shorter(3)]);
    world.course.reset();
    world.set_list(&[20]);
    world.command(&execute(Some(0), 2.0));
    assert_eq!(world.driver.held[&0], world.expected(&[20])[&0]);
}

#[test]
fn an_element_that_is_no_place_of_the_driver_is_refused_with_the_reason() {
    let mut world = World::new(waypoints());
    world.command(&set(vec![rec(segments(), [0, 1, 0], 5)]));
    assert_eq!(world.answers, [0x041D]);
    assert!(matches!(world.refused[..], [Refused::Conversion(_)]));
}

#[test]
fn a_driver_that_tells_no_places_gets_them_all_the_same() {
    let mut world = World::new(waypoints());
    world.driver.mute = true;
    let places: Vec<u16> = (0..50).collect();
    world.set_list(&places);
    let begin = world.now;
    world.command(&execute(Some(0), 2.0));
    assert_eq!(world.driver.held, world.expected(&places));
    near(&world.driver.speeds, &[2.0]);
    assert_eq!(world.refused, [Refused::Mute]);
    assert!(world.now - begin < 2 * PATIENCE);
}

#[test]
fn a_driver_that_puts_places_behind_those_that_it_has_gets_each_once_and_in_order() {
    let mut world = World::new(waypoints());
    world.driver.appends = true;
    for list in [[10, 11], [20, 21]] {
        world.set_list(&list);
        world.command(&execute(Some(0), 2.0));
    }
    let mut expected: Vec<Bytes> = world.expected(&[10, 11]).into_values().collect();
    expected.extend(world.expected(&[20, 21]).into_values());
    assert_eq!(world.driver.came, expected);
    assert_eq!(world.refused, []);
    near(&world.driver.speeds, &[2.0, 0.0, 2.0]);
}

#[test]
fn a_driver_that_keeps_what_it_had_under_a_number_is_told_of() {
    let mut world = World::new(waypoints());
    world.driver.keeps = true;
    for list in [[10, 11], [20, 21]] {
        world.set_list(&list);
        world.command(&execute(Some(0), 2.0));
    }
    assert_eq!(world.refused, [Refused::Keeps(0)]);
    near(&world.driver.speeds, &[2.0, 0.0, 2.0]);
}

#[test]
fn a_driver_that_nobody_controls_any_more_is_stopped_once() {
    let mut world = World::new(waypoints());
    world.set_list(&[10, 11]);
    world.command(&execute(Some(0), 2.0));
    world.course.leave();
    world.course.leave();
    world.settle();
    near(&world.driver.speeds, &[2.0, 0.0]);
    world.command(&execute(None, 2.0));
    assert_eq!(world.refused, [Refused::NoSuchElement]);
}

#[test]
fn a_driver_that_falls_silent_is_not_set_off() {
    let mut world = World::new(waypoints());
    world.set_list(&[10]);
    world.command(&execute(Some(0), 2.0));
    world.driver.mute = true;
    world.set_list(&[20, 21]);
    world.command(&execute(Some(0), 2.0));
    assert_eq!(world.refused, [Refused::Unconfirmed(0)]);
    near(&world.driver.speeds, &[2.0, 0.0]);
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn what_clients_set_is_what_the_driver_holds(
        lists in prop::collection::vec(prop::collection::vec(0_u16..90, 1..12), 1..6),
        from in 0_u16..12,
        loses in prop::sample::select(vec![0_u32, 4, 5, 7]),
    ) {
        let mut world = World::new(waypoints());
        for list in &lists {
            world.set_list(list);
            let uid = from.min(list.len() as u16);
            // Stop commands may be lost like any other.
            world.loses = loses;
            world.command(&execute(Some(uid), 2.0));
            world.loses = 0;
            let driven = &list[usize::from(uid.max(1)) - 1..];
            let held: Vec<&Bytes> = world.driver.held.values().collect();
            let mut expected = driven.to_vec();
            expected.resize(held.len(), *driven.last().unwrap());
            if world.refused.is_empty() {
                prop_assert_eq!(&world.driver.held, &world.expected(&expected));
            }
        }
        prop_assert!(loses > 0 || world.refused.is_empty(), "{:?}", world.refused);
    }
}
