//! A client of List Manager: builds the list of a component under control, and executes it.

use super::{Component, RequestError};
use crate::address::JausId;
use crate::codec::{FormattedBlob, Message};
use crate::endpoint::Received;
use crate::messages::core::delete_element::DeleteElementRec;
use crate::messages::core::set_element::{ElementDataFormat, ElementRec, RequestIdRec};
use crate::messages::core::{
    ConfirmElementRequest, DeleteElement, QueryElementList, RejectElementRequest, SetElement,
};
#[cfg(feature = "mobility")]
use crate::messages::mobility::{ExecuteList, QueryActiveElement};
use crate::service::{code_of, read};

/// The list of a component that this component controls, see [`Component::list`].
///
/// Every change is confirmed. Elements are numbered from 1, in the order of the list.
///
/// ```no_run
/// # use jaus::component::{Component, Session};
/// # use jaus::messages::mobility::SetLocalWaypoint;
/// # async fn drive(operator: Component, session: Session) -> Result<(), Box<dyn std::error::Error>> {
/// let mut corner = SetLocalWaypoint::default();
/// corner.set_x_m(10.0)?;
/// let home = SetLocalWaypoint::default();
///
/// let list = operator.list(session.check()?);
/// list.replace(&[corner, home]).await?;
/// list.execute(1.5).await?;
/// println!("driving to element {:?}", list.active().await?);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct List {
    component: Component,
    peer: JausId,
}

impl Component {
    /// The list of a peer with a List Manager. Changes need control of the peer, with a
    /// [`Session`](super::Session) or [`Control`](super::Control).
    #[must_use]
    pub fn list(&self, peer: JausId) -> List {
        List {
            component: self.clone(),
            peer,
        }
    }
}

impl List {
    /// Octets of the elements in one message, so that it fits into a packet.
    const AT_ONCE: usize = 1200;
    /// Selects all elements.
    const ALL: u16 = u16::MAX;
    /// Octets of an element besides its data.
    const OVERHEAD: usize = 9;

    /// Replaces the whole list by these elements, for instance waypoints or path segments.
    ///
    /// # Errors
    /// If there are more than 65534 elements, one cannot be encoded, or the peer does not confirm.
    /// The list is then incomplete.
    pub async fn replace<M: Message>(&self, elements: &[M]) -> Result<(), RequestError> {
        let elements = records(elements)?;
        self.clear().await?;
        for batch in batches(&elements) {
            self.set(batch).await?;
        }
        Ok(())
    }

    /// Removes all elements.
    ///
    /// # Errors
    /// If the peer does not confirm.
    pub async fn clear(&self) -> Result<(), RequestError> {
        self.delete(&[Self::ALL]).await
    }

    /// Removes elements by their numbers.
    ///
    /// # Errors
    /// If the peer rejects it, because an element does not exist, or does not confirm.
    pub async fn delete(&self, uids: &[u16]) -> Result<(), RequestError> {
        let uids = uids.iter();
        let delete_element_list = uids.map(|&element_uid| DeleteElementRec { element_uid });
        let request_id_rec = self.number();
        let request = DeleteElement {
            request_id_rec,
            delete_element_list: delete_element_list.collect(),
        };
        self.change(request_id_rec, &request).await
    }

    /// The numbers of the elements, in their order.
    ///
    /// # Errors
    /// If the peer does not answer.
    pub async fn uids(&self) -> Result<Vec<u16>, RequestError> {
        let report = self
            .component
            .query(self.peer, &QueryElementList {})
            .await?;
        let elements = report.element_list.iter();
        Ok(elements.map(|it| it.element_uid).collect())
    }

    /// Executes the list from its first element, at a speed in metres per second. The peer must be
    /// ready. To learn of the end, send [`ExecuteList`] as a [command
    /// event](Component::run).
    ///
    /// # Errors
    /// If the message cannot tell the speed, or the peer does not acknowledge.
    #[cfg(feature = "mobility")]
    pub async fn execute(&self, speed: f64) -> Result<(), RequestError> {
        let mut execute = ExecuteList {
            element_uid: Some(0),
            ..ExecuteList::default()
        };
        execute.set_speed_m_per_s(speed)?;
        Ok(self.component.deliver(self.peer, &execute).await?)
    }

    /// The number of the element that is being executed; `None` if none is.
    ///
    /// # Errors
    /// If the peer does not answer.
    #[cfg(feature = "mobility")]
    pub async fn active(&self) -> Result<Option<u16>, RequestError> {
        let query = QueryActiveElement {};
        let report = self.component.query(self.peer, &query).await?;
        Ok(Some(report.element_uid).filter(|uid| *uid != 0))
    }

    /// Appends consecutive elements.
    async fn set(&self, element_list: Vec<ElementRec>) -> Result<(), RequestError> {
        let request_id_rec = self.number();
        let request = SetElement {
            request_id_rec,
            element_list,
        };
        self.change(request_id_rec, &request).await
    }

    fn number(&self) -> RequestIdRec {
        RequestIdRec {
            request_id: self.component.next_request(),
        }
    }

    async fn change<M: Message>(
        &self,
        RequestIdRec { request_id }: RequestIdRec,
        request: &M,
    ) -> Result<(), RequestError> {
        let mut messages = self.component.messages();
        let answer = |message: &Received| confirmed(request_id, message);
        self.component
            .confirm(&mut messages, self.peer, request, answer)
            .await
    }
}

/// The answer to a request with this number, if the message is one.
fn confirmed(request: u8, message: &Received) -> Option<Result<(), String>> {
    match code_of(&message.payload)? {
        ConfirmElementRequest::CODE => {
            let confirm: ConfirmElementRequest = read(message)?;
            (confirm.request_id == request).then_some(Ok(()))
        }
        RejectElementRequest::CODE => {
            let reject: RejectElementRequest = read(message)?;
            (reject.request_id == request).then(|| Err(format!("{:?}", reject.response_code)))
        }
        _ => None,
    }
}

/// The elements of a list, numbered from 1.
fn records<M: Message>(elements: &[M]) -> Result<Vec<ElementRec>, RequestError> {
    if elements.len() >= usize::from(List::ALL) {
        return Err(RequestError::TooManyElements(elements.len()));
    }
    (1_u16..)
        .zip(elements)
        .map(|(element_uid, element)| {
            Ok(ElementRec {
                element_uid,
                previous_uid: element_uid - 1,
                // Set when the successor is known.
                next_uid: 0,
                element_data: FormattedBlob::new(
                    ElementDataFormat::JAUS_MESSAGE,
                    element.encode()?,
                ),
            })
        })
        .collect()
}

/// The elements in batches for one message each. Within a batch every element names its successor;
/// the last one of a batch gets its successor with the next batch.
fn batches(elements: &[ElementRec]) -> Vec<Vec<ElementRec>> {
    let mut batches: Vec<Vec<ElementRec>> = Vec::new();
    let mut room = 0;
    for element in elements {
        let octets = element.element_data.data.len() + List::OVERHEAD;
        match batches.last_mut().filter(|_| octets <= room) {
            Some(batch) => {
                if let Some(before) = batch.last_mut() {
                    before.next_uid = element.element_uid;
                }
                batch.push(element.clone());
                room -= octets;
            }
            None => {
                batches.push(vec![element.clone()]);
                room = List::AT_ONCE.saturating_sub(octets);
            }
        }
    }
    batches
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::core::SetTime;
    use crate::service::ElementList;

    #[test]
    fn the_elements_make_one_list_however_many_messages_carry_them() {
        let elements = vec![SetTime::default(); 1000];
        let records = records(&elements).unwrap();
        let batches = batches(&records);
        assert!(batches.len() > 5, "{}", batches.len());
        let mut list = ElementList::default();
        for batch in &batches {
            let octets: usize = batch.iter().map(|it| it.element_data.data.len() + 9).sum();
            assert!(octets <= List::AT_ONCE);
            list.set(batch).unwrap();
        }
        assert!(list.uids().eq(1..=1000));
    }

    #[test]
    fn a_list_without_free_numbers_is_refused() {
        let elements = vec![SetTime::default(); 65_535];
        let error = records(&elements).unwrap_err();
        assert_eq!(error, RequestError::TooManyElements(65_535));
    }
}
