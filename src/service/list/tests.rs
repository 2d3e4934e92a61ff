//! Tests of the elements that a list accepts, and of those that it rejects, with the reject codes.

use super::*;
use crate::codec::FormattedBlob;
use crate::messages::core::delete_element::DeleteElementRec;
use crate::messages::core::set_element::RequestIdRec;
use crate::messages::core::{QueryHeartbeatPulse, QueryStatus};
use crate::service::rig::{CLIENT, Rig, STRANGER};

/// An element with its number and its neighbours.
fn element(element_uid: u16, previous_uid: u16, next_uid: u16) -> ElementRec {
    let data = QueryHeartbeatPulse {}.encode().unwrap();
    ElementRec {
        element_uid,
        previous_uid,
        next_uid,
        element_data: FormattedBlob::new(ElementDataFormat::JAUS_MESSAGE, data),
    }
}

fn list(elements: &[(u16, u16, u16)]) -> ElementList {
    let mut list = ElementList::default();
    list.set(&records(elements)).unwrap();
    list
}

fn records(elements: &[(u16, u16, u16)]) -> Vec<ElementRec> {
    let elements = elements.iter();
    elements
        .map(|&(uid, previous, next)| element(uid, previous, next))
        .collect()
}

fn uids(list: &ElementList) -> Vec<u16> {
    list.uids().collect()
}

#[test]
fn four_elements_of_one_request_are_a_list_in_the_order_of_their_links() {
    let list = list(&[(3, 2, 4), (1, 0, 2), (4, 3, 0), (2, 1, 3)]);
    assert_eq!(uids(&list), [1, 2, 3, 4]);
    assert_eq!(list.get(0).unwrap().element_uid, 1);
}

#[test]
fn elements_are_appended_inserted_put_in_front_replaced_and_moved() {
    let mut list = list(&[(1, 0, 0)]);
    list.set(&[element(2, 1, 0)]).unwrap();
    assert_eq!(uids(&list), [1, 2]);
    list.set(&[element(3, 1, 2)]).unwrap();
    assert_eq!(uids(&list), [1, 3, 2]);
    list.set(&[element(4, 0, 1)]).unwrap();
    assert_eq!(uids(&list), [4, 1, 3, 2]);
    list.set(&[element(3, 1, 2)]).unwrap();
    assert_eq!(uids(&list), [4, 1, 3, 2]);
    list.set(&[element(4, 2, 0)]).unwrap();
    assert_eq!(uids(&list), [1, 3, 2, 4]);
    list.set(&records(&[(8, 3, 9), (9, 8, 2)])).unwrap();
    assert_eq!(uids(&list), [1, 3, 8, 9, 2, 4]);
    for uid in [1, 3, 8, 9, 2, 4] {
        let element = list.get(uid).unwrap();
        let next = list.get(element.next_uid).filter(|_| element.next_uid != 0);
        assert!(next.is_none_or(|next| next.previous_uid == uid));
    }
}

#[test]
fn what_would_not_be_one_chain_is_refused_and_changes_nothing() {
    let id = ResponseCode::INVALID_ELEMENT_ID;
    let previous = ResponseCode::INVALID_PREVIOUS_ELEMENT;
    let next = ResponseCode::INVALID_NEXT_ELEMENT;
    let before = list(&[(1, 0, 2), (2, 1, 0)]);
    for (request, code) in [
        (vec![(0, 0, 0)], id),
        (vec![(65535, 2, 0)], id),
        (vec![(5, 2, 0), (5, 2, 0)], id),
        (vec![(5, 7, 0)], previous),
        (vec![(5, 2, 7)], next),
        (vec![(5, 0, 0)], previous),
        (vec![(5, 1, 0)], next),
        (vec![(5, 0, 2)], previous),
        (vec![(5, 5, 5)], next),
        (vec![(5, 6, 6), (6, 5, 5)], next),
        (vec![(1, 2, 2)], previous),
        (vec![(5, 2, 6), (6, 1, 0)], next),
        (vec![(5, 2, 1)], previous),
    ] {
        let mut list = before.clone();
        assert_eq!(list.set(&records(&request)), Err(code), "{request:?}");
        assert_eq!(list, before);
    }
}

#[test]
fn a_cycle_in_an_empty_list_is_refused() {
    let cycle = records(&[(1, 3, 2), (2, 1, 3), (3, 2, 1)]);
    let refused = ElementList::default().set(&cycle);
    assert_eq!(refused, Err(ResponseCode::INVALID_PREVIOUS_ELEMENT));
}

#[test]
fn deleting_joins_what_remains_and_deletes_all_or_nothing() {
    let mut list = list(&[(1, 0, 2), (2, 1, 3), (3, 2, 0)]);
    assert_eq!(
        list.delete(&[2, 9]),
        Err(ResponseCode::ELEMENT_ID_NOT_FOUND)
    );
    assert_eq!(uids(&list), [1, 2, 3]);
    list.delete(&[2]).unwrap();
    assert_eq!(uids(&list), [1, 3]);
    list.delete(&[1]).unwrap();
    assert_eq!(uids(&list), [3]);
    list.delete(&[65535]).unwrap();
    assert!(list.is_empty());
}

#[test]
fn a_list_does_not_grow_beyond_its_bounds() {
    let mut list = ElementList::default();
    let last = ElementList::MAX_ELEMENTS as u16;
    let next = |uid| if uid == last { 0 } else { uid + 1 };
    let elements: Vec<_> = (1..=last).map(|uid| (uid, uid - 1, next(uid))).collect();
    list.set(&records(&elements)).unwrap();
    let refused = list.set(&[element(last + 1, last, 0)]);
    assert_eq!(refused, Err(ResponseCode::OUT_OF_MEMORY));
    let mut large = element(last, last - 1, 0);
    large.element_data.data = vec![0; ElementList::MAX_DATA + 1].into();
    assert_eq!(list.set(&[large]), Err(ResponseCode::OUT_OF_MEMORY));
    assert_eq!(list.len(), last);
}

/// A service whose elements hold Query Heartbeat Pulse.
fn rig() -> Rig {
    let elements = Elements::new();
    elements.accept::<QueryHeartbeatPulse>();
    Rig::new(vec![Box::new(ListManager::new(elements))])
}

fn set(id: u8, element_list: Vec<ElementRec>) -> SetElement {
    SetElement {
        request_id_rec: RequestIdRec { request_id: id },
        element_list,
    }
}

#[test]
fn a_request_is_confirmed_with_its_number_and_can_be_read_back() {
    let mut rig = rig();
    rig.changed().clear();
    rig.send(CLIENT, &set(0x2C, records(&[(1, 0, 2), (2, 1, 0)])));
    let confirmed: ConfirmElementRequest = rig.answer().unwrap();
    assert_eq!(confirmed.request_id, 0x2C);
    assert!(rig.changed().contains(&QueryElementCount::CODE));
    let count: ReportElementCount = rig.ask(&QueryElementCount).unwrap();
    assert_eq!(count.element_count, 2);
    let list: ReportElementList = rig.ask(&QueryElementList).unwrap();
    let uids: Vec<_> = list.element_list.iter().map(|e| e.element_uid).collect();
    assert_eq!(uids, [1, 2]);
    let element: ReportElement = rig.ask(&QueryElement { element_uid: 2 }).unwrap();
    assert_eq!((element.previous_uid, element.next_uid), (1, 0));
    assert!(
        rig.ask::<ReportElement>(&QueryElement { element_uid: 3 })
            .is_none()
    );
}

#[test]
fn a_refusal_has_the_number_of_the_request_and_a_code() {
    let mut rig = rig();
    rig.send(CLIENT, &set(7, records(&[(1, 5, 0)])));
    let refused: RejectElementRequest = rig.answer().unwrap();
    let code = ResponseCode::INVALID_PREVIOUS_ELEMENT;
    assert_eq!((refused.request_id, refused.response_code), (7, code));
}

#[test]
fn an_element_that_no_driver_can_work_with_is_refused() {
    let mut unknown = element(1, 0, 0);
    unknown.element_data.data = QueryStatus {}.encode().unwrap();
    let mut damaged = element(1, 0, 0);
    damaged.element_data.data = Bytes::from_static(&[0x02, 0x22, 0xFF]);
    let mut private = element(1, 0, 0);
    private.element_data.format = ElementDataFormat::USER_DEFINED;
    let mut rig = rig();
    for element in [unknown, damaged, private] {
        rig.send(CLIENT, &set(1, vec![element]));
        let refused: RejectElementRequest = rig.answer().unwrap();
        assert_eq!(
            refused.response_code,
            ResponseCode::UNSUPPORTED_ELEMENT_TYPE
        );
    }
}

#[test]
fn whoever_is_not_in_control_changes_nothing_and_hears_nothing() {
    let mut rig = rig();
    rig.send(STRANGER, &set(1, records(&[(1, 0, 0)])));
    assert!(rig.answer::<ConfirmElementRequest>().is_none());
    rig.send(CLIENT, &set(2, records(&[(1, 0, 0)])));
    assert!(rig.answer::<ConfirmElementRequest>().is_some());
    let everything = DeleteElement {
        request_id_rec: RequestIdRec { request_id: 3 },
        delete_element_list: vec![DeleteElementRec { element_uid: 65535 }],
    };
    rig.send(STRANGER, &everything);
    assert!(rig.answer::<ConfirmElementRequest>().is_none());
    let count: ReportElementCount = rig.ask(&QueryElementCount).unwrap();
    assert_eq!(count.element_count, 1);
    rig.send(CLIENT, &everything);
    assert!(rig.answer::<ConfirmElementRequest>().is_some());
    let count: ReportElementCount = rig.ask(&QueryElementCount).unwrap();
    assert_eq!(count.element_count, 0);
}

#[test]
fn a_reset_empties_the_list_and_standby_does_not() {
    let mut rig = rig();
    rig.send(CLIENT, &set(1, records(&[(1, 0, 0)])));
    let _: Option<ConfirmElementRequest> = rig.answer();
    for (state, expected) in [(State::Standby, 1), (State::Initialize, 0)] {
        rig.stand(state, Some(CLIENT));
        let count: ReportElementCount = rig.ask(&QueryElementCount).unwrap();
        assert_eq!(count.element_count, expected, "{state}");
    }
}
