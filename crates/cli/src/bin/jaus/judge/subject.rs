//! The component under test: presence and offered services.
#![expect(clippy::disallowed_methods, reason = "the judge runs in real time")]

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::query_identification::QueryType;
use jaus::messages::core::{
    QueryHeartbeatPulse, QueryIdentification, ReportHeartbeatPulse, ReportIdentification,
    ReportServices,
};
use jaus::peer;
use jaus_cli::failure::Failure;
use tokio::time::Instant;

use super::judge_nodes::{JudgeNodes, SETTLING};
use super::step::{Reach, Speaker, code_of};
use crate::offers::{query_services, services};

/// Attempts of each query, because the first datagrams may be lost while addresses are learned.
const TRIES: u32 = 3;
/// Step name in the recording.
const STEP: &str = "before the steps";

/// The component under test.
#[derive(Debug)]
pub(super) struct Subject {
    pub(super) id: JausId,
    pub(super) name: Option<String>,
    /// URNs with major and minor version; `None` if not reported.
    pub(super) services: Option<BTreeMap<String, (u8, u8)>>,
    /// Its implementation, as far as recognised.
    pub(super) implementation: peer::Verdict,
}

impl Subject {
    /// Queries the subject. `None` if it does not answer at all.
    pub(super) async fn meet(
        judge_nodes: &mut JudgeNodes,
        id: JausId,
        limit: Duration,
    ) -> Result<Option<Self>, Failure> {
        let identify = QueryIdentification {
            query_type: QueryType::SUBSYSTEM_IDENTIFICATION,
        };
        let code = ReportIdentification::CODE;
        let report = ask_again(judge_nodes, &identify, code, limit).await?;
        let name = report.as_ref().and_then(|octets| {
            let report = ReportIdentification::decode(octets).ok()?;
            Some(report.identification.to_string_lossy().into_owned())
        });
        let mut is_there = report.is_some();
        // All five send, so that both nodes learn the address.
        for speaker in Speaker::ALL {
            let answer = if is_there {
                ask(judge_nodes, speaker, &identify, code, SETTLING).await?
            } else {
                let code = ReportHeartbeatPulse::CODE;
                ask(judge_nodes, speaker, &QueryHeartbeatPulse, code, SETTLING).await?
            };
            is_there |= answer.is_some();
        }
        let code = ReportServices::CODE;
        let report = ask_again(judge_nodes, &query_services(id), code, limit).await?;
        is_there |= report.is_some();
        let services =
            report.and_then(|octets| services(&ReportServices::decode(&octets).ok()?, id));
        let mut recogniser = judge_nodes.recognise();
        let listed = services.iter().flatten();
        recogniser.handle_services(listed.map(|(urn, (major, minor))| (urn, *major, *minor)));
        Ok(is_there.then(|| Self {
            id,
            name,
            services,
            implementation: recogniser.verdict(),
        }))
    }

    /// Whether the subject still answers any query.
    pub(super) async fn answers(
        judge_nodes: &mut JudgeNodes,
        limit: Duration,
    ) -> Result<bool, Failure> {
        let identify = QueryIdentification {
            query_type: QueryType::SUBSYSTEM_IDENTIFICATION,
        };
        let code = ReportIdentification::CODE;
        let answer = ask_again(judge_nodes, &identify, code, limit).await?;
        if answer.is_some() {
            return Ok(true);
        }
        let code = ReportHeartbeatPulse::CODE;
        let answer = ask(
            judge_nodes,
            Speaker::Main,
            &QueryHeartbeatPulse,
            code,
            limit,
        )
        .await?;
        Ok(answer.is_some())
    }

    /// The version of an offered service.
    pub(super) fn version(&self, urn: &str) -> Option<(u8, u8)> {
        self.services.as_ref()?.get(urn).copied()
    }

    /// The first of these services that is not offered.
    pub(super) fn lacks<'a>(&self, urns: &'a [Cow<'static, str>]) -> Option<&'a str> {
        let services = self.services.as_ref()?;
        let mut urns = urns.iter().map(AsRef::as_ref);
        urns.find(|urn| !services.contains_key(*urn))
    }
}

async fn ask_again(
    judge_nodes: &mut JudgeNodes,
    query: &impl Message,
    report: u16,
    limit: Duration,
) -> Result<Option<Bytes>, Failure> {
    for _ in 0..TRIES {
        let answer = ask(judge_nodes, Speaker::Main, query, report, limit).await?;
        if answer.is_some() {
            return Ok(answer);
        }
    }
    Ok(None)
}

async fn ask(
    judge_nodes: &mut JudgeNodes,
    from: Speaker,
    query: &impl Message,
    report: u16,
    limit: Duration,
) -> Result<Option<Bytes>, Failure> {
    let query = query.encode().map_err(Failure::of)?;
    judge_nodes.say(from, Reach::Component, query, STEP)?;
    let deadline = Instant::now() + limit;
    while let Some(heard) = judge_nodes.hear(deadline, STEP).await? {
        if code_of(&heard.octets) == Some(report) {
            return Ok(Some(heard.octets));
        }
    }
    Ok(None)
}
