//! Replies too large for one message. The parts are sent one after the other until the client
//! terminates the transfer.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::messages::ground::report_vks_objects::{
    CountRec, DataSeq, ObjectSeq, Objects, RequestRec,
};
use crate::messages::ground::{ReportVksObjects, ReportVksTraversability};
use crate::world::{Object, ObjectId};
use jaus::address::JausId;
use jaus::codec::Composite;
use jaus::endpoint::Received;
use jaus::service::Context;

use super::convert;

/// The message code of a reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Code {
    /// 4A23h
    Objects,
    /// 4423h
    Traversability,
}

/// A transfer of objects to one client.
#[derive(Debug)]
pub(super) struct Transfer {
    pub(super) request: Received,
    pub(super) request_id: u8,
    pub(super) code: Code,
    pub(super) objects: VecDeque<(ObjectId, Arc<Object>)>,
}

/// The transfers in progress.
#[derive(Debug, Default)]
pub(super) struct Transfers {
    open: VecDeque<Transfer>,
    due: Option<Instant>,
}

impl Transfers {
    /// Maximum number of transfers. Another client receives only the count.
    const MOST: usize = 16;
    /// Size of a part in octets. A part exceeds it only by its last object.
    const PART: usize = 256 * 1024;
    /// Interval between two parts.
    const PAUSE: Duration = Duration::from_millis(10);

    /// Sends the first part and queues the rest.
    pub(super) fn begin(
        &mut self,
        now: Instant,
        mut transfer: Transfer,
        context: &mut Context<'_>,
    ) {
        let count = transfer.objects.len();
        let part = transfer.next_part();
        if transfer.objects.is_empty() {
            transfer.send(part, context);
        } else if self.open.len() < Self::MOST {
            transfer.send(part, context);
            self.open.push_back(transfer);
            self.due.get_or_insert(now + Self::PAUSE);
        } else {
            transfer.send(count_of(transfer.request_id, count), context);
        }
    }

    /// Sends one part of the next transfer in turn.
    pub(super) fn handle_timeout(&mut self, now: Instant, context: &mut Context<'_>) {
        if self.due.is_none_or(|due| due > now) {
            return;
        }
        if let Some(mut transfer) = self.open.pop_front() {
            let part = transfer.next_part();
            transfer.send(part, context);
            if !transfer.objects.is_empty() {
                self.open.push_back(transfer);
            }
        }
        self.due = (!self.open.is_empty()).then_some(now + Self::PAUSE);
    }

    pub(super) const fn poll_timeout(&self) -> Option<Instant> {
        self.due
    }

    /// Drops the transfers of a client.
    pub(super) fn terminate(&mut self, client: JausId) {
        self.open.retain(|it| it.request.source != client);
        if self.open.is_empty() {
            self.due = None;
        }
    }
}

impl Transfer {
    fn next_part(&mut self) -> Objects {
        let mut part: Vec<ObjectSeq> = Vec::new();
        let mut octets = 0;
        while let Some((id, object)) = self.objects.front()
            && octets < Transfers::PART
            && part.len() < usize::from(u16::MAX)
        {
            let reported = convert::reported(*id, object);
            octets += reported.encoded_len();
            part.push(reported);
            self.objects.pop_front();
        }
        let request_id = self.request_id;
        Objects::DataSeq(DataSeq {
            request_rec: RequestRec { request_id },
            object_list: part,
        })
    }

    fn send(&self, objects: Objects, context: &mut Context<'_>) {
        reply(&self.request, self.code, objects, context);
    }
}

/// Replies under the code of the query.
pub(super) fn reply(request: &Received, code: Code, objects: Objects, context: &mut Context<'_>) {
    match code {
        Code::Objects => {
            context.reply_until_acknowledged(request, &ReportVksObjects { objects });
        }
        Code::Traversability => {
            context.reply_until_acknowledged(request, &ReportVksTraversability { objects });
        }
    }
}

/// A reply with the count only, saturating at 65535.
pub(super) fn count_of(request_id: u8, count: usize) -> Objects {
    Objects::CountRec(CountRec {
        request_id,
        object_count: count.try_into().unwrap_or(u16::MAX),
    })
}
