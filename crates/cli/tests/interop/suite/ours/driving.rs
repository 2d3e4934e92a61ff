//! Control, and actions that require it.

use std::time::Duration;

use jaus::component::{Component, Control, When};
use jaus::messages::core::{QueryControl, ReportControl};
use jaus::messages::mobility::{ReportVelocityState, SetWrenchEffort};
use tokio::time::{MissedTickBehavior, interval};

use super::asking::FORWARD;
use super::{Outcome, Told, operator};

/// Less and more authority.
const AUTHORITIES: [u8; 2] = [100, 200];
/// Between two commands.
const BEAT: Duration = Duration::from_millis(100);
/// How hard it is pushed, in percent.
const EFFORT: f64 = 60.0;
/// What is motion, in metres a second.
const MOTION: f64 = 0.1;
/// The number of different velocities that show that changes are reported.
const CHANGES: usize = 3;

fn in_words(error: impl std::fmt::Display) -> String {
    error.to_string()
}

/// Takes control, loses it to a client with more authority, which then releases it.
pub(super) async fn control(told: &Told) -> Outcome {
    let (node, weak) = told.component()?;
    let strong = operator(&node, told.colleague())?;
    let mut held = weak
        .control(told.other, AUTHORITIES[0])
        .await
        .map_err(in_words)?;
    controller_is(&weak, told, &weak).await?;
    let stronger = strong
        .control(told.other, AUTHORITIES[1])
        .await
        .map_err(in_words)?;
    println!("lost as it must be: {}", held.lost().await);
    controller_is(&weak, told, &strong).await?;
    stronger.release().await;
    let report = ask(&weak, told).await?;
    if report.subsystem_id != 0 {
        return Err(format!(
            "it was released, and still controlled by {report:?}"
        ));
    }
    Ok(())
}

async fn ask(component: &Component, told: &Told) -> Result<ReportControl, String> {
    component
        .query(told.other, &QueryControl {})
        .await
        .map_err(in_words)
}

async fn controller_is(component: &Component, told: &Told, wanted: &Component) -> Outcome {
    let report = ask(component, told).await?;
    let (id, found) = (
        wanted.id(),
        (report.subsystem_id, report.node_id, report.component_id),
    );
    if found == (id.subsystem(), id.node(), id.component()) {
        return Ok(());
    }
    Err(format!(
        "{id} is in control, and Report Control says {found:?}"
    ))
}

/// Takes control, has it move, and stops it.
pub(super) async fn drive(told: &Told) -> Outcome {
    let (_node, component) = told.component()?;
    let control = ready(&component, told).await?;
    push_until(&control, async {
        loop {
            let report: Result<ReportVelocityState, _> =
                component.query(told.sensor(), &FORWARD).await;
            let velocity = report.map_err(in_words)?.velocity_x_m_per_s();
            if velocity.is_some_and(|velocity| velocity > MOTION) {
                println!("it moves at {velocity:?} m/s");
                return Ok(());
            }
            tokio::time::sleep(BEAT).await;
        }
    })
    .await?;
    stop(control).await
}

/// Subscribes to the velocity on change, changes it, and expects the reports.
pub(super) async fn on_change(told: &Told) -> Outcome {
    let (_node, component) = told.component()?;
    let mut reports = component
        .subscribe::<ReportVelocityState, _>(told.sensor(), &FORWARD, When::OnChange)
        .await
        .map_err(in_words)?;
    let control = ready(&component, told).await?;
    push_until(&control, async {
        let mut velocities = Vec::new();
        while velocities.len() < CHANGES {
            let report = reports.report().await.ok_or("the subscription has ended")?;
            velocities.extend(report.velocity_x_m_per_s());
            velocities.dedup();
        }
        println!("reported: {velocities:?}");
        Ok(())
    })
    .await?;
    stop(control).await
}

/// Control over a vehicle that obeys.
async fn ready(component: &Component, told: &Told) -> Result<Control, String> {
    let control = component
        .control(told.other, AUTHORITIES[0])
        .await
        .map_err(in_words)?;
    control.resume().await.map_err(in_words)?;
    Ok(control)
}

/// Pushes it forward until something has happened.
async fn push_until(control: &Control, happened: impl Future<Output = Outcome>) -> Outcome {
    let mut effort = SetWrenchEffort::default();
    effort
        .set_propulsive_linear_effort_x_percent(EFFORT)
        .map_err(in_words)?;
    let mut beats = interval(BEAT);
    beats.set_missed_tick_behavior(MissedTickBehavior::Delay);
    tokio::pin!(happened);
    loop {
        tokio::select! {
            outcome = &mut happened => return outcome,
            _ = beats.tick() => control.send(&effort).map_err(in_words)?,
        }
    }
}

/// Stops it, and gives control back.
async fn stop(control: Control) -> Outcome {
    let mut effort = SetWrenchEffort::default();
    effort
        .set_propulsive_linear_effort_x_percent(0.0)
        .map_err(in_words)?;
    control.send(&effort).map_err(in_words)?;
    control.standby().await.map_err(in_words)?;
    control.release().await;
    Ok(())
}
