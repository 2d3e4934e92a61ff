//! The list itself: elements by number, each naming the one before and the one after it.

use std::collections::{BTreeMap, BTreeSet};

use bytes::Bytes;

use crate::messages::core::reject_element_request::ResponseCode;
use crate::messages::core::set_element::ElementRec;

/// A doubly linked list. At all times it is one chain: it has one first and one last element, and
/// each element is named by its neighbours.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ElementList {
    elements: BTreeMap<u16, ElementRec>,
}

/// Stands for no element, and for the first one when asked for.
const NONE: u16 = 0;
/// Stands for all elements.
const ALL: u16 = u16::MAX;

impl ElementList {
    /// The most elements that are kept.
    pub const MAX_ELEMENTS: usize = 4096;
    /// The most octets of data that an element may hold: several times the longest message that
    /// drives anything.
    pub const MAX_DATA: usize = 1024;

    /// How many elements there are.
    #[must_use]
    pub fn len(&self) -> u16 {
        u16::try_from(self.elements.len()).unwrap_or(u16::MAX)
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.elements.is_empty()
    }

    /// The element with a number; 0 stands for the first one.
    #[must_use]
    pub fn get(&self, uid: u16) -> Option<&ElementRec> {
        match uid {
            NONE => self.first(),
            uid => self.elements.get(&uid),
        }
    }

    /// The numbers of all elements, from the first to the last.
    pub fn uids(&self) -> impl Iterator<Item = u16> {
        let next = |element: &&ElementRec| self.elements.get(&element.next_uid);
        let chain = std::iter::successors(self.first(), next);
        // It is one chain; this only keeps a mistake of ours from being endless.
        chain
            .map(|element| element.element_uid)
            .take(self.elements.len())
    }

    fn first(&self) -> Option<&ElementRec> {
        let mut elements = self.elements.values();
        elements.find(|element| element.previous_uid == NONE)
    }

    /// Adds elements between their neighbours, or replaces and moves those that are there. Either
    /// all of it is done, or nothing.
    ///
    /// The neighbours may be elements of the list or of the same request. A neighbour of the list
    /// is linked to the new element by itself; what the request says itself must agree.
    ///
    /// # Errors
    /// The response code of Reject Element Request (041Dh): a number that is none or comes twice,
    /// a neighbour that does not exist or would make a cycle or two lists, or too many elements.
    pub fn set(&mut self, elements: &[ElementRec]) -> Result<(), ResponseCode> {
        let mut requested = BTreeSet::new();
        for element in elements {
            let uid = element.element_uid;
            if uid == NONE || uid == ALL || !requested.insert(uid) {
                return Err(ResponseCode::INVALID_ELEMENT_ID);
            }
            if element.element_data.data.len() > Self::MAX_DATA {
                return Err(ResponseCode::OUT_OF_MEMORY);
            }
        }
        let mut changed = self.clone();
        for element in elements {
            changed.unlink(element.element_uid);
        }
        for element in elements {
            let mut element = element.clone();
            // A slice of the datagram would keep all of the datagram.
            let data = &mut element.element_data.data;
            *data = Bytes::copy_from_slice(data);
            changed.elements.insert(element.element_uid, element);
        }
        if changed.elements.len() > Self::MAX_ELEMENTS {
            return Err(ResponseCode::OUT_OF_MEMORY);
        }
        for element in elements {
            changed.link(element, &requested)?;
        }
        changed.check()?;
        *self = changed;
        Ok(())
    }

    /// Removes elements, and joins what remains; 65535 stands for all of them. Either all of it is
    /// done, or nothing.
    ///
    /// # Errors
    /// The response code of Reject Element Request (041Dh) if one of them is not there.
    pub fn delete(&mut self, uids: &[u16]) -> Result<(), ResponseCode> {
        if uids.contains(&ALL) {
            self.clear();
            return Ok(());
        }
        if uids.iter().any(|uid| !self.elements.contains_key(uid)) {
            return Err(ResponseCode::ELEMENT_ID_NOT_FOUND);
        }
        for &uid in uids {
            self.unlink(uid);
        }
        Ok(())
    }

    /// Removes everything.
    pub fn clear(&mut self) {
        self.elements.clear();
    }

    /// Takes an element out, if it is there, and joins its neighbours.
    fn unlink(&mut self, uid: u16) {
        let Some(element) = self.elements.remove(&uid) else {
            return;
        };
        if let Some(previous) = self.elements.get_mut(&element.previous_uid) {
            previous.next_uid = element.next_uid;
        }
        if let Some(next) = self.elements.get_mut(&element.next_uid) {
            next.previous_uid = element.previous_uid;
        }
    }

    /// Makes the neighbours of a new element name it.
    fn link(
        &mut self,
        element: &ElementRec,
        requested: &BTreeSet<u16>,
    ) -> Result<(), ResponseCode> {
        let uid = element.element_uid;
        if element.previous_uid != NONE {
            let previous = self.elements.get_mut(&element.previous_uid);
            let previous = previous.ok_or(ResponseCode::INVALID_PREVIOUS_ELEMENT)?;
            if !requested.contains(&previous.element_uid) {
                previous.next_uid = uid;
            } else if previous.next_uid != uid {
                return Err(ResponseCode::INVALID_PREVIOUS_ELEMENT);
            }
        }
        if element.next_uid != NONE {
            let next = self.elements.get_mut(&element.next_uid);
            let next = next.ok_or(ResponseCode::INVALID_NEXT_ELEMENT)?;
            if !requested.contains(&next.element_uid) {
                next.previous_uid = uid;
            } else if next.previous_uid != uid {
                return Err(ResponseCode::INVALID_NEXT_ELEMENT);
            }
        }
        Ok(())
    }

    /// Whether this is one chain.
    fn check(&self) -> Result<(), ResponseCode> {
        let none = |link: fn(&ElementRec) -> u16| {
            let elements = self.elements.values();
            elements.filter(|element| link(element) == NONE).count()
        };
        if self.is_empty() {
            return Ok(());
        }
        if none(|element| element.previous_uid) != 1 {
            return Err(ResponseCode::INVALID_PREVIOUS_ELEMENT);
        }
        if none(|element| element.next_uid) != 1 {
            return Err(ResponseCode::INVALID_NEXT_ELEMENT);
        }
        let mut previous = NONE;
        let mut count = 0;
        for uid in self.uids() {
            let is_named = self
                .elements
                .get(&uid)
                .is_some_and(|element| element.previous_uid == previous);
            if !is_named {
                return Err(ResponseCode::INVALID_PREVIOUS_ELEMENT);
            }
            previous = uid;
            count += 1;
        }
        // The rest would be a cycle beside the list.
        if count == self.elements.len() {
            Ok(())
        } else {
            Err(ResponseCode::INVALID_NEXT_ELEMENT)
        }
    }
}
