//! A vehicle that obeys the client in control while it is ready. The operator's example drives it.

use jaus::component::{Call, Component, Handlers, Kind, Management};
use jaus::messages::mobility::{
    QueryWrenchEffort, ReportWrenchEffort, SetWrenchEffort, primitive_driver,
};
use jaus::node::{Config, Node};

/// A motor that runs at an effort in percent.
struct Motor(f64);

impl primitive_driver::Service<Call<'_>> for Motor {
    fn set_wrench_effort(&mut self, message: SetWrenchEffort, call: &mut Call<'_>) {
        self.0 = message.propulsive_linear_effort_x_percent().unwrap_or(0.0);
        let Some(client) = call.source() else { return };
        println!("{client} drives with {:.0} %", self.0);
    }

    fn query_wrench_effort(
        &mut self,
        _: QueryWrenchEffort,
        _: &mut Call<'_>,
    ) -> Option<ReportWrenchEffort> {
        let mut report = ReportWrenchEffort::default();
        report.set_propulsive_linear_effort_x_percent(self.0).ok()?;
        Some(report)
    }

    /// Runs on standby, emergency, lost control, a silent client, and shutdown.
    fn stop(&mut self, _: &mut Call<'_>) {
        self.0 = 0.0;
    }
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let subsystem = std::env::args().nth(1).map_or(Ok(102), |it| it.parse())?;
    let node = Node::start(Config::loopback(subsystem, 1))?;
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(Handlers::of(primitive_driver::Server::new(Motor(0.0))))
        .management(Management::new())
        .attach(&node, 33)?;
    println!("{} is up; Ctrl-C ends it", rover.id());
    let mut standing = rover.watch_standing();
    loop {
        tokio::select! {
            _ = tokio::signal::ctrl_c() => break,
            Ok(()) = standing.changed() => {
                let now = rover.standing();
                match now.controller {
                    Some(client) => println!("{} now, controlled by {}", now.state, client.id),
                    None => println!("{} now, not controlled", now.state),
                }
            }
        }
    }
    node.shutdown().await; // stops the motor, too
    Ok(())
}
