//! Subscriptions that only receive.

use jaus::component::When;
use jaus::messages::mobility::QueryVelocityState;

use super::{Outcome, RoleArguments};

/// The query for the forward velocity alone, which every vehicle reports.
pub(super) const FORWARD: QueryVelocityState = QueryVelocityState::none().with_velocity_x();
/// Consecutive reports that prove a subscription.
const ENOUGH: usize = 10;
/// Report rate.
const HZ: f64 = 10.0;

/// Subscribes to the velocity and waits for [`ENOUGH`] reports.
pub(super) async fn periodic(arguments: &RoleArguments) -> Outcome {
    let (_node, component) = arguments.component()?;
    let mut reports = component
        .subscribe(arguments.sensor(), &FORWARD, When::hz(HZ))
        .await
        .map_err(|error| error.to_string())?;
    for _ in 0..ENOUGH {
        let report = reports.report().await.ok_or("the subscription has ended")?;
        report
            .velocity_x_m_per_s()
            .ok_or("a report without the velocity that was asked for")?;
    }
    println!(
        "{ENOUGH} reports at {:?} Hz, {} lost",
        reports.hz(),
        reports.lost()
    );
    Ok(())
}

/// Prints each velocity report until killed.
pub(super) async fn keep(arguments: &RoleArguments) -> Outcome {
    let (_node, component) = arguments.component()?;
    loop {
        // Retry if the peer has not started yet.
        let subscribed = component
            .subscribe(arguments.sensor(), &FORWARD, When::hz(HZ))
            .await;
        let mut reports = match subscribed {
            Ok(reports) => reports,
            Err(error) => {
                println!("not yet: {error}");
                continue;
            }
        };
        while let Some(report) = reports.report().await {
            println!("report: {:?} m/s", report.velocity_x_m_per_s());
        }
        println!("the subscription has ended: {:?}", reports.end());
    }
}
