//! Control, and actions that require it.

use std::time::Duration;

use jaus::component::{Component, Control, When};
use jaus::messages::core::{QueryControl, ReportControl};
use jaus::messages::mobility::SetWrenchEffort;
use tokio::time::{MissedTickBehavior, interval};

use super::asking::FORWARD;
use super::{Outcome, RoleArguments, operator};

/// Authority codes of the two clients, lower first.
const AUTHORITIES: [u8; 2] = [100, 200];
/// Interval of the commands.
const BEAT: Duration = Duration::from_millis(100);
/// Wrench effort, in percent.
const EFFORT: f64 = 60.0;
/// Least speed that counts as motion, in m/s.
const MOTION: f64 = 0.1;
/// Number of different velocities that proves reports on change.
const CHANGES: usize = 3;

fn in_words(error: impl std::fmt::Display) -> String {
    error.to_string()
}

/// Takes control, loses it to a client with more authority, which then releases it.
pub(super) async fn control(arguments: &RoleArguments) -> Outcome {
    let (node, weak) = arguments.component()?;
    let strong = operator(&node, arguments.colleague())?;
    let mut held = weak
        .control(arguments.other, AUTHORITIES[0])
        .await
        .map_err(in_words)?;
    controller_is(&weak, arguments, &weak).await?;
    let stronger = strong
        .control(arguments.other, AUTHORITIES[1])
        .await
        .map_err(in_words)?;
    println!("lost as it must be: {}", held.lost().await);
    controller_is(&weak, arguments, &strong).await?;
    stronger.release().await;
    let report = ask(&weak, arguments).await?;
    if report.subsystem_id != 0 {
        return Err(format!(
            "it was released, and still controlled by {report:?}"
        ));
    }
    Ok(())
}

async fn ask(component: &Component, arguments: &RoleArguments) -> Result<ReportControl, String> {
    component
        .query(arguments.other, &QueryControl {})
        .await
        .map_err(in_words)
}

async fn controller_is(
    component: &Component,
    arguments: &RoleArguments,
    wanted: &Component,
) -> Outcome {
    let report = ask(component, arguments).await?;
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

/// Takes control, moves the vehicle, and stops it.
pub(super) async fn drive(arguments: &RoleArguments) -> Outcome {
    let (_node, component) = arguments.component()?;
    let control = ready(&component, arguments).await?;
    push_until(&control, async {
        loop {
            let report = component.query(arguments.sensor(), &FORWARD).await;
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

/// Subscribes to the velocity on change, changes it, and waits for the reports.
pub(super) async fn on_change(arguments: &RoleArguments) -> Outcome {
    let (_node, component) = arguments.component()?;
    let mut reports = component
        .subscribe(arguments.sensor(), &FORWARD, When::OnChange)
        .await
        .map_err(in_words)?;
    let control = ready(&component, arguments).await?;
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

/// Takes control of the vehicle and makes it Ready.
async fn ready(component: &Component, arguments: &RoleArguments) -> Result<Control, String> {
    let control = component
        .control(arguments.other, AUTHORITIES[0])
        .await
        .map_err(in_words)?;
    control.resume().await.map_err(in_words)?;
    Ok(control)
}

/// Sends forward effort until `happened` completes.
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

/// Stops the vehicle and releases control.
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
