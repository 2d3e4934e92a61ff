//! The element list: elements by number, each with links to the previous and the next one.

use std::collections::{BTreeMap, BTreeSet};

use bytes::Bytes;

use crate::messages::core::reject_element_request::ResponseCode;
use crate::messages::core::set_element::ElementRec;

/// A doubly linked list. It is always a single chain, with one first and one last element, and each
/// element's neighbours link back to it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ElementList {
    elements: BTreeMap<u16, ElementRec>,
}

/// Means no element, or the first one in a query.
const NONE: u16 = 0;
/// Means all elements.
const ALL: u16 = u16::MAX;

impl ElementList {
    /// Limit of elements.
    pub const MAX_ELEMENTS: usize = 4096;
    /// Limit of the data of one element in octets: several times the longest command message.
    pub const MAX_DATA: usize = 1024;

    /// The number of elements.
    #[must_use]
    pub fn len(&self) -> u16 {
        u16::try_from(self.elements.len()).unwrap_or(u16::MAX)
    }

    /// Whether the list is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.elements.is_empty()
    }

    /// The element with a number; 0 means the first one.
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
        // The list is a single chain. The limit only prevents an endless loop after a bug.
        chain
            .map(|element| element.element_uid)
            .take(self.elements.len())
    }

    fn first(&self) -> Option<&ElementRec> {
        let mut elements = self.elements.values();
        elements.find(|element| element.previous_uid == NONE)
    }

    /// Adds elements between their neighbours, or replaces and moves existing ones. Either all
    /// changes take effect, or none.
    ///
    /// A neighbour may be an element of the list or of the same request. A neighbour in the list is
    /// linked to the new element automatically. Links between elements of the request must agree.
    ///
    /// # Errors
    /// The response code of Reject Element Request (041Dh): an invalid or repeated number, a
    /// neighbour that does not exist or would create a cycle or two lists, too many elements, or
    /// too much data.
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
            // A slice would keep the whole datagram allocated.
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

    /// Removes elements, and joins the rest; 65535 means all elements. Either all are removed, or
    /// none.
    ///
    /// # Errors
    /// The response code of Reject Element Request (041Dh) if one of them does not exist.
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

    /// Removes all elements.
    pub fn clear(&mut self) {
        self.elements.clear();
    }

    /// Removes an element, if it exists, and joins its neighbours.
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

    /// Links the neighbours of a new element to it.
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

    /// Checks that the elements form a single chain.
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
        // Any others would form a cycle beside the list.
        if count == self.elements.len() {
            Ok(())
        } else {
            Err(ResponseCode::INVALID_NEXT_ELEMENT)
        }
    }
}
