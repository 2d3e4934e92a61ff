//! Monitoring of one driver of the chain: its stage, its controller and emergencies.
#![expect(
    clippy::disallowed_methods,
    reason = "waits for a lost driver, and stamps the arrival of scans"
)]

use std::time::Duration;

use tokio::sync::mpsc;

use crate::messages::environment_sensing::ReportRangeSensorData;
use crate::messages::ground::report_stage::State;
use crate::messages::ground::{QueryStage, ReportStage, stage};
use crate::mission::{Link, LinkState};
use crate::motion::Pose;
use crate::parts::PartError;
use crate::parts::drivers::{Sense, reported_pose};
use crate::sensing::Scan;
use jaus::address::JausId;
use jaus::codec::Query;
use jaus::component::{Audience, Component, Subscription, Update, When};
use jaus::messages::core::report_status::Status;
use jaus::messages::core::{QueryControl, QueryStatus, ReportControl, ReportStatus};
use jaus::messages::mobility::{
    ReportLocalPose, local_path_segment_driver, local_vector_driver, primitive_driver,
};
use jaus::node::now;
use jaus::service::SampleAge;

/// An event of a driver of the chain.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum News {
    /// The vehicle's position in the local frame, and its heading.
    Pose(Pose),
    /// A scan of the range sensor.
    Scan(Scan),
    /// The driver was found or lost.
    Found(Link, Option<JausId>),
    /// The driver's stage, and the completed part of its command from 0 to 100 %.
    Stage(Link, LinkState, u8),
    /// The client in control of the driver.
    Controller(Link, Option<JausId>),
    /// The driver was stopped by an emergency.
    Emergency(Link),
    /// The driver has stood down on purpose and commands no other driver.
    StoodDown(Link, String),
}

/// Interval between attempts to subscribe.
const PAUSE: Duration = Duration::from_secs(1);

/// The components of a subsystem that can be this link.
pub(in crate::parts) fn drivers(link: Link, subsystem: u16) -> Audience {
    let service = match link {
        Link::Path => local_path_segment_driver::URN,
        Link::Vector => local_vector_driver::URN,
        Link::Primitive => primitive_driver::URN,
    };
    Audience::providers(service)
        .that_offer(stage::URN)
        .in_subsystem(subsystem)
}

/// Monitors a driver, including its replacements. Ends when the component has stopped.
pub(super) async fn watch(component: &Component, link: Link, tell: &mpsc::Sender<News>) {
    let drivers = drivers(link, component.id().subsystem());
    while let Ok(peer) = component.find_within(&drivers, Duration::MAX).await {
        tracing::info!("the {link} is {peer}");
        if tell.send(News::Found(link, Some(peer))).await.is_err() {
            return;
        }
        watch_peer(component, link, peer, tell).await;
        let lost = [
            News::Found(link, None),
            News::Stage(link, LinkState::Silent, 0),
        ];
        for news in lost {
            if tell.send(news).await.is_err() {
                return;
            }
        }
        tokio::time::sleep(PAUSE).await;
    }
}

/// Passes on the vehicle's position. Ends when the component has stopped.
pub(super) async fn follow(
    mut poses: Sense<ReportLocalPose>,
    tell: &mpsc::Sender<News>,
) -> Result<(), PartError> {
    loop {
        let report = poses.next().await?;
        if let Some(pose) = reported_pose(&report)
            && tell.send(News::Pose(pose)).await.is_err()
        {
            return Ok(());
        }
    }
}

/// Passes on the scans of the range sensor, each once. Ends when the component has stopped.
pub(super) async fn look_around(
    mut scans: Sense<ReportRangeSensorData>,
    tell: &mpsc::Sender<News>,
) -> Result<(), PartError> {
    let mut age = SampleAge::default();
    loop {
        let Some((stamp, scan)) = scans.next_scan().await? else {
            continue;
        };
        if age.handle(now(), stamp).is_some() && tell.send(News::Scan(scan)).await.is_err() {
            return Ok(());
        }
    }
}

/// Monitors one component until it is lost.
async fn watch_peer(
    component: &Component,
    link: Link,
    peer: JausId,
    tell: &mpsc::Sender<News>,
) -> Option<()> {
    let mut stages: Subscription<ReportStage> = component
        .subscribe(peer, &QueryStage {}, When::OnChange)
        .await
        .ok()?;
    let mut controls: Subscription<ReportControl> = component
        .subscribe(peer, &QueryControl {}, When::OnChange)
        .await
        .ok()?;
    let mut states: Subscription<ReportStatus> = component
        .subscribe(peer, &QueryStatus {}, When::OnChange)
        .await
        .ok()?;
    loop {
        let news = tokio::select! {
            stage = stages.next() => match stage? {
                Update::Report(report) => stage_news(link, &report),
                Update::Up => stage_news(link, &ask(component, peer, &QueryStage {}).await?),
                Update::Down { .. } => return None,
            },
            control = controls.next() => match control? {
                Update::Report(report) => News::Controller(link, controller(&report)),
                Update::Up => {
                    let report = ask(component, peer, &QueryControl {}).await?;
                    News::Controller(link, controller(&report))
                }
                Update::Down { .. } => return None,
            },
            state = states.next() => match state? {
                Update::Report(report) if report.status == Status::EMERGENCY => {
                    News::Emergency(link)
                }
                Update::Report(_) | Update::Up => continue,
                Update::Down { .. } => return None,
            },
        };
        tell.send(news).await.ok()?;
    }
}

async fn ask<Q: Query>(component: &Component, peer: JausId, query: &Q) -> Option<Q::Report> {
    component.query(peer, query).await.ok()
}

fn stage_news(link: Link, report: &ReportStage) -> News {
    // The last driver of the chain commands no other in any case.
    let commands = report.next_subsystem_id != 0 || link == Link::Primitive;
    if report.state == State::BLOCKED && !commands {
        let reason = report.reason.to_string_lossy().into_owned();
        return News::StoodDown(link, reason);
    }
    News::Stage(link, state(report), report.progress)
}

/// Converts a reported stage to the state of a link.
pub(super) fn state(report: &ReportStage) -> LinkState {
    match report.state {
        State::IDLE => LinkState::Idle,
        State::ENGAGING => LinkState::Engaging,
        State::ACTIVE => LinkState::Active,
        State::DONE => LinkState::Done,
        State::BLOCKED | State::HALTED if report.reason.is_empty() => {
            LinkState::Blocked("blocked".to_owned())
        }
        State::BLOCKED | State::HALTED => {
            LinkState::Blocked(report.reason.to_string_lossy().into_owned())
        }
        State(other) => LinkState::Blocked(format!("in the unknown state {other}")),
    }
}

/// The client in control.
pub(in crate::parts) fn controller(report: &ReportControl) -> Option<JausId> {
    let id = JausId::new(report.subsystem_id, report.node_id, report.component_id);
    id.is_unicast().then_some(id)
}
