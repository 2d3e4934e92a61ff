//! Places of an RA client in a JAUS driver's list.

use proptest::prelude::*;

use super::super::entries::{Entries, Want};
use super::super::list::Refused;
use super::*;
use jaus::messages::core::reject_element_request::ResponseCode;
use jaus::messages::core::{ConfirmElementRequest, RejectElementRequest};
use jaus::service::{ElementList, code_of};

/// Set Travel Speed.
const SPEED: u16 = 0x040A;

struct World {
    now: Instant,
    entries: Entries,
    list: ElementList,
    /// The active element of the driver.
    active: u16,
    /// Whether it is ready: otherwise it executes no list.
    ready: bool,
    executed: Vec<(Option<u16>, f64)>,
    refused: Vec<Refused>,
    loses: u32,
    sent: u32,
    deaf: bool,
}

impl World {
    fn new() -> Self {
        Self {
            now: start(),
            entries: Entries::new(waypoints(), PATIENCE),
            list: ElementList::default(),
            active: 0,
            ready: true,
            executed: Vec::new(),
            refused: Vec::new(),
            loses: 0,
            sent: 0,
            deaf: false,
        }
    }

    fn set(&mut self, number: u16, place: u16) {
        let data = waypoints().to_ra(&element(waypoints(), place), number);
        self.entries.handle_set(self.now, &data.unwrap());
        self.run();
    }

    fn speed(&mut self, speed: f64) {
        let raw = (speed * 65_535.0 / 10_000.0).round() as u16;
        let data = Bytes::copy_from_slice(&raw.to_le_bytes());
        self.entries.handle_speed(self.now, SPEED, &data);
        self.run();
    }

    fn run(&mut self) {
        self.settle();
        while let Some(wake) = self.entries.poll_timeout() {
            self.now = self.now.max(wake);
            self.entries.handle_timeout(self.now);
            self.settle();
        }
    }

    fn settle(&mut self) {
        loop {
            let wants = self.entries.take_wants();
            if wants.is_empty() {
                return;
            }
            for want in wants {
                match want {
                    Want::Refuse(_, why) => self.refused.push(why),
                    Want::Ask(_) => {
                        let active = (!self.deaf).then_some(self.active);
                        self.entries.handle_active(self.now, active);
                    }
                    Want::Send(payload) => self.arrive(&payload),
                }
            }
        }
    }

    /// Delivers a message to the driver, and its answer.
    fn arrive(&mut self, payload: &Bytes) {
        self.sent += 1;
        let is_lost = self.loses > 0 && self.sent.is_multiple_of(self.loses);
        if is_lost || self.deaf {
            return;
        }
        let (id, done) = match code_of(payload).unwrap() {
            SetElement::CODE => {
                let set = SetElement::decode(payload).unwrap();
                let done = self.list.set(&set.element_list);
                (set.request_id_rec.request_id, done)
            }
            DeleteElement::CODE => {
                let delete = DeleteElement::decode(payload).unwrap();
                let uids = delete.delete_element_list.iter();
                let uids: Vec<u16> = uids.map(|it| it.element_uid).collect();
                (delete.request_id_rec.request_id, self.list.delete(&uids))
            }
            _ => return self.execute(payload),
        };
        let answer = answer(id, done);
        self.sent += 1;
        if self.loses == 0 || !self.sent.is_multiple_of(self.loses) {
            self.entries.handle_answer(self.now, &answer);
        }
    }

    fn execute(&mut self, payload: &Bytes) {
        let execute = ExecuteList::decode(payload).unwrap();
        let speed = (execute.speed_m_per_s() * 10.0).round() / 10.0;
        self.executed.push((execute.element_uid, speed));
        if let (Some(uid), true) = (execute.element_uid, self.ready) {
            self.active = self.list.get(uid).map_or(0, |element| element.element_uid);
        }
    }

    /// The elements of the list with their content.
    fn held(&self) -> Vec<(u16, Element)> {
        let uids = self.list.uids();
        let data = |uid| (uid, self.list.get(uid).unwrap().element_data.clone());
        uids.map(data).collect()
    }
}

fn answer(request_id: u8, done: Result<(), ResponseCode>) -> Bytes {
    match done {
        Ok(()) => ConfirmElementRequest { request_id }.encode(),
        Err(response_code) => RejectElementRequest {
            request_id,
            response_code,
        }
        .encode(),
    }
    .unwrap()
}

fn expected(places: &[u16]) -> Vec<(u16, Element)> {
    let data = |(uid, &place)| (uid, element(waypoints(), place));
    (1..).zip(places).map(data).collect()
}

#[test]
fn places_become_elements_in_the_order_of_their_numbers() {
    let mut world = World::new();
    for (number, place) in [(0, 10), (2, 12), (1, 11), (3, 13)] {
        world.set(number, place);
    }
    assert_eq!(world.held(), expected(&[10, 11, 12, 13]));
    world.set(1, 21);
    assert_eq!(world.held(), expected(&[10, 21, 12, 13]));
    assert_eq!(world.refused, []);
}

#[test]
fn what_others_have_left_in_the_list_is_deleted_first() {
    let mut world = World::new();
    let foreign = rec(waypoints(), [0, 99, 0], 50);
    world.list.set(&[foreign]).unwrap();
    world.set(0, 10);
    assert_eq!(world.held(), expected(&[10]));
}

#[test]
fn a_change_of_speed_under_way_does_not_begin_the_list_again() {
    let mut world = World::new();
    world.set(0, 10);
    world.set(1, 11);
    world.speed(2.0);
    world.speed(3.0);
    world.speed(0.0);
    world.speed(1.0);
    let expected = [(Some(0), 2.0), (None, 3.0), (None, 0.0), (None, 1.0)];
    for ((uid, speed), (expected_uid, expected_speed)) in world.executed.iter().zip(expected) {
        assert_eq!(*uid, expected_uid);
        assert!(
            (speed - expected_speed).abs() < 0.11,
            "{:?}",
            world.executed
        );
    }
}

#[test]
fn a_list_that_was_driven_is_not_driven_again_but_goes_on_with_what_was_added() {
    let mut world = World::new();
    world.set(0, 10);
    world.set(1, 11);
    world.speed(2.0);
    world.active = 0;
    world.speed(2.0);
    assert_eq!(world.executed.last().unwrap().0, None);
    world.set(2, 12);
    world.speed(2.0);
    assert_eq!(world.executed.last().unwrap().0, Some(3));
    // A new path, from its first place on.
    world.active = 0;
    world.set(0, 20);
    world.speed(2.0);
    assert_eq!(world.executed.last().unwrap().0, Some(0));
}

#[test]
fn a_driver_that_was_not_ready_begins_when_it_is() {
    let mut world = World::new();
    world.ready = false;
    world.set(0, 10);
    world.speed(2.0);
    world.ready = true;
    world.speed(2.0);
    assert_eq!(world.active, 1);
}

#[test]
fn a_list_with_a_gap_is_not_driven() {
    let mut world = World::new();
    world.set(0, 10);
    world.set(2, 12);
    world.speed(2.0);
    assert_eq!(world.refused, [Refused::Missing(1)]);
    assert_eq!(world.executed, []);
}

#[test]
fn a_list_that_was_emptied_by_others_is_made_anew() {
    let mut world = World::new();
    world.set(0, 10);
    world.set(1, 11);
    world.list.clear();
    world.set(2, 12);
    assert_eq!(world.held(), expected(&[10, 11, 12]));
}

#[test]
fn a_driver_that_says_nothing_is_given_up() {
    let mut world = World::new();
    world.deaf = true;
    world.set(0, 10);
    assert_eq!(world.refused, [Refused::Unanswered]);
    assert_eq!(world.entries.poll_timeout(), None);
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn what_the_client_sets_is_what_the_list_holds(
        places in prop::collection::vec((0_u16..12, 0_u16..90), 1..40),
        loses in prop::sample::select(vec![0_u32, 3, 5]),
    ) {
        let mut world = World::new();
        world.loses = loses;
        let mut set = std::collections::BTreeMap::new();
        for (number, place) in places {
            world.set(number, place);
            set.insert(number, place);
            prop_assert_eq!(&world.refused, &[]);
        }
        let there = (0..).zip(&set).take_while(|(at, (number, _))| at == *number);
        let there: Vec<u16> = there.map(|(_, (_, &place))| place).collect();
        prop_assert_eq!(world.held(), expected(&there));
    }
}
