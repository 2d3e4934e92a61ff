//! The README's component: reports its position to queries and subscriptions, until Ctrl-C.
#![expect(clippy::disallowed_methods, reason = "an application has a clock")]

use jaus::component::{Component, Handlers, Kind};
use jaus::messages::mobility::{QueryNavigation, ReportNavigation, navigation_state};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(107, 1))?;
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(Handlers::new(navigation_state::LATEST).publishes::<QueryNavigation>())
        .attach(&node, 53)?;

    let mut report = ReportNavigation::default();
    report.report_local_pose_ext_rec.set_x_m(2.5)?; // a real vehicle reads its sensors here
    rover.publish(report, std::time::SystemTime::now()).await?;
    Ok(tokio::signal::ctrl_c().await?)
}
