//! The bridge's task: it joins the state machines with the component, its subscriptions and its
//! sessions. It never waits for the network.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::component::Component;
use jaus::node::{Recorder, now};
use jaus::service::{Directory, State, TimeOfDay};
use jaus_vehicle::parts::PartError;
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval};

use super::counters::{Counter, Counters};
use super::diagnostics::{BridgeState, NO_DRIVER, diagnostics};
use super::drive::{Access, Drive, Refusal};
use super::emergency::Emergency;
use super::following::{Extra, Following, Received};
use super::frames::between_local_and_map;
use super::goal::{Goal, Navigation};
use super::jobs::{Finished, Jobs};
use super::lease::Lease;
use super::ports::{Command, GoalPose, Input, Output};
use super::report::Report;
use super::rights::{Forbidden, Rights, Said};
use super::samples::{FixSample, Odometry, PoseSample, TwistSample};
use super::vehicle::{Role, Vehicle};
use super::velocity::Twist;
use super::{Reports, Settings};
use crate::graph::Gid;

/// The vehicle's side of the bridge.
pub(super) struct Runner {
    component: Component,
    time: TimeOfDay,
    settings: Settings,
    reports: Reports,
    rights: Rights,
    vehicle: Vehicle,
    /// The directory that the vehicle and the subscriptions match.
    known: Option<Arc<Directory>>,
    following: Following,
    jobs: Jobs,
    drive: Drive,
    drive_lease: Lease,
    /// The publisher for which control of the driver was last wanted.
    driver: Option<Gid>,
    navigation: Navigation,
    goal_lease: Lease,
    /// The publisher of the last goal.
    navigator: Option<Gid>,
    emergency: Emergency,
    odometry: Odometry,
    received: mpsc::Receiver<Received>,
    inputs: mpsc::Receiver<Input>,
    outputs: mpsc::Sender<Output>,
    counters: Counters,
    /// When the status was last published, and what it said about control.
    published: Option<(Instant, String)>,
    /// Refusals that were logged.
    logged: BTreeSet<Counter>,
}

impl Runner {
    /// Period of the commands, and of all other periodic work.
    const BEAT: Duration = Duration::from_millis(50);
    /// Period of the status.
    const STATUS: Duration = Duration::from_secs(1);
    /// Capacity of the queue of reports.
    const QUEUE: usize = 1024;

    pub(super) fn new(
        component: Component,
        time: TimeOfDay,
        settings: Settings,
        reports: Reports,
        recorder: Option<Recorder<Gid>>,
        (inputs, outputs): (mpsc::Receiver<Input>, mpsc::Sender<Output>),
    ) -> Self {
        let (sender, received) = mpsc::channel(Self::QUEUE);
        let subsystem = settings.vehicle.subsystem;
        Self {
            rights: Rights::new(settings.rules.clone(), component.id(), subsystem, recorder),
            vehicle: Vehicle::new(component.id(), settings.vehicle.clone()),
            known: None,
            following: Following::new(component.clone(), sender, settings.rate_hz),
            jobs: Jobs::new(component.clone()),
            drive: Drive::new(settings.drive),
            drive_lease: Lease::default(),
            driver: None,
            navigation: Navigation::default(),
            goal_lease: Lease::default(),
            navigator: None,
            emergency: Emergency::default(),
            odometry: Odometry::default(),
            counters: Counters::default(),
            published: None,
            logged: BTreeSet::new(),
            component,
            time,
            settings,
            reports,
            received,
            inputs,
            outputs,
        }
    }

    /// Runs until the component or the ROS side stops.
    pub(super) async fn run(mut self) -> PartError {
        let mut standing = self.component.watch_standing();
        let mut beat = interval(Self::BEAT);
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                changed = standing.changed() => if changed.is_err() {
                    return PartError::NodeStopped;
                },
                input = self.inputs.recv() => match input {
                    Some(input) => {
                        self.handle_input(now(), input);
                        self.command(now());
                    }
                    None => return PartError::Broken("the ROS side has ended".to_owned()),
                },
                Some((by, report)) = self.received.recv() => {
                    self.handle_report(now(), by, report);
                    continue;
                }
                finished = self.jobs.finished() => self.handle_finished(now(), finished),
                _ = beat.tick() => {
                    self.handle_beat(now());
                    self.command(now());
                }
            }
            self.settle(now());
        }
    }

    fn handle_input(&mut self, now: Instant, input: Input) {
        match input {
            Input::Twist(command) => self.handle_twist(now, &command),
            Input::Goal(by, pose) => self.handle_goal(now, by, &pose),
            Input::EmergencyStop(by, on) => self.handle_emergency(now, by, on),
            Input::Release(by) => {
                self.rights.record_release(by);
                self.drive.halt(now);
                self.navigation.cancel(now);
            }
            Input::PublisherGone(publisher) => {
                if self.drive.handle_publisher_gone(now, publisher) {
                    tracing::warn!("the publisher of cmd_vel is gone: stopping the vehicle");
                }
            }
            Input::Unannounced(publisher) => {
                let why = format!("{publisher} is no publisher of the topic");
                self.refuse(Counter::Unannounced, &why);
            }
            Input::Lost { malformed, dropped } => {
                self.counters.add_many(Counter::Malformed, malformed);
                self.counters.add_many(Counter::NotTaken, dropped);
            }
            Input::Disconnected => {
                if self.drive.is_moving() || self.navigation.wants_control() {
                    tracing::warn!("the ROS network was lost: stopping the vehicle");
                }
                self.drive.halt(now);
                self.navigation.cancel(now);
            }
        }
    }

    /// Logs once that no component takes the velocities.
    fn warn_without_driver(&mut self) {
        if self.vehicle.drive().is_none() && self.logged.insert(Counter::Velocities) {
            tracing::warn!("{NO_DRIVER}");
        }
    }

    fn handle_twist(&mut self, now: Instant, command: &Command) {
        self.counters.add(Counter::Velocities);
        let moves = command.twist != Twist::default();
        if let Err(forbidden) = self.rights.check_drive(self.vehicle.drive(), moves) {
            return self.forbid(Counter::Forbidden, command.publisher, &forbidden);
        }
        self.warn_without_driver();
        let refusal = match self.drive.handle_command(now, command) {
            Ok(()) => {
                if self.drive.is_moving() {
                    self.driver = Some(command.publisher);
                    // A velocity replaces a goal.
                    self.navigation.cancel(now);
                }
                return;
            }
            Err(refusal) => refusal,
        };
        let counter = match refusal {
            Refusal::Invalid(_) => Counter::InvalidVelocity,
            Refusal::OtherPublisher => Counter::OtherPublisher,
            Refusal::Outdated(_) => Counter::Outdated,
            Refusal::Locked => Counter::Locked,
        };
        self.refuse(counter, &refusal.to_string());
    }

    fn handle_goal(&mut self, now: Instant, by: Gid, pose: &GoalPose) {
        self.counters.add(Counter::Goals);
        if let Err(forbidden) = self.rights.check_goal(self.vehicle.goal()) {
            return self.forbid(Counter::Forbidden, by, &forbidden);
        }
        match self.goal(pose) {
            Ok(goal) => {
                tracing::info!("goal: {:.1} m north, {:.1} m east", goal.x, goal.y);
                self.drive.halt(now);
                self.navigation.set(now, goal);
                self.navigator = Some(by);
            }
            Err(why) => self.refuse(Counter::GoalRefused, &why),
        }
    }

    /// The goal in the frame of the vehicle, or why it cannot be one.
    fn goal(&self, pose: &GoalPose) -> Result<Goal, String> {
        let goal = Goal::of(pose, &self.settings.map_frame)?;
        if self.drive.is_moving() {
            return Err("the vehicle is driven by cmd_vel".to_owned());
        }
        if self.vehicle.goal().is_none() {
            return Err("the vehicle has no planner and no local waypoint driver".to_owned());
        }
        Ok(goal)
    }

    fn handle_emergency(&mut self, now: Instant, by: Gid, on: bool) {
        let parts = self.vehicle.all(Role::Management);
        if let Err(forbidden) = self.rights.check_emergency(on, parts) {
            let counter = match on {
                true => Counter::EmergencyRefused,
                false => Counter::ClearRefused,
            };
            return self.forbid(counter, by, &forbidden);
        }
        self.rights.record_emergency(by, on);
        if on {
            self.counters.add(Counter::Emergencies);
            if !self.emergency.is_being_set() {
                tracing::warn!("emergency stop from ROS");
            }
            self.drive.halt(now);
            self.navigation.cancel(now);
        } else {
            tracing::info!("the emergency is cleared from ROS");
        }
        self.jobs.end_alarms();
        self.emergency.request(now, on);
    }

    /// Records that a publisher was refused, and counts it.
    fn forbid(&mut self, counter: Counter, by: Gid, forbidden: &Forbidden) {
        self.rights.record_refusal(by, forbidden);
        self.refuse(counter, &forbidden.to_string());
    }

    /// Counts a refusal, and logs the first of its kind.
    fn refuse(&mut self, counter: Counter, why: &str) {
        self.counters.add(counter);
        if self.logged.insert(counter) {
            tracing::warn!("{counter}: {why} (further ones are only counted)");
        }
    }

    fn handle_report(&mut self, now: Instant, by: JausId, report: Report) {
        let received = self.time.now();
        match report {
            Report::Status(code) => self.handle_status(now, by, code),
            Report::Control(controller) => self.vehicle.handle_controller(by, controller),
            Report::Mission(mission) => self.navigation.handle_mission(now, mission),
            Report::LocalPose(report) => match PoseSample::of(&report, received) {
                Some(pose) => {
                    if let Some((_, Role::WaypointDriver)) = self.vehicle.goal() {
                        let [x, y, _] = between_local_and_map(pose.position);
                        self.navigation.handle_position(now, x, y);
                    }
                    self.publish(Output::Pose(pose));
                    if let Some(odometry) = self.odometry.with_pose(received, pose) {
                        self.publish(Output::Odometry(odometry));
                    }
                }
                None => self.counters.add(Counter::Incomplete),
            },
            Report::Velocity(report) => match TwistSample::of(&report, received) {
                Some(twist) => {
                    self.odometry.handle_twist(received, twist);
                    self.publish(Output::Twist(twist));
                }
                None => self.counters.add(Counter::Incomplete),
            },
            Report::GlobalPose(report) => match FixSample::of(&report, received) {
                Some(fix) => self.publish(Output::Fix(fix)),
                None => self.counters.add(Counter::Incomplete),
            },
            Report::Undecoded { definition, octets } => self.publish(Output::Report {
                source: by,
                definition,
                octets,
            }),
        }
    }

    fn handle_status(&mut self, now: Instant, by: JausId, code: u8) {
        self.vehicle.handle_status(now, by, code);
        let is_emergency = code == State::Emergency as u8;
        self.emergency.handle_status(by, is_emergency);
    }

    fn handle_finished(&mut self, now: Instant, finished: Finished) {
        match finished {
            Finished::Begun {
                is_drive,
                peer,
                result,
            } => {
                let lease = match is_drive {
                    true => &mut self.drive_lease,
                    false => &mut self.goal_lease,
                };
                lease.handle_begun(peer, result);
            }
            Finished::Halted { is_acknowledged } => {
                if is_acknowledged {
                    self.drive.handle_stopped();
                }
            }
            Finished::Ordered { order, result } => {
                if let Err(why) = &result {
                    tracing::warn!("{order} was not delivered: {why}");
                }
                self.navigation.handle_delivered(now, order, result);
            }
            Finished::Alarmed { peer, status, .. } => {
                self.emergency.handle_delivered(peer);
                if let Some(status) = status {
                    self.handle_status(now, peer, status.status.0);
                }
            }
        }
    }

    fn handle_beat(&mut self, now: Instant) {
        let directory = self.component.directory();
        let is_known = self.known.as_ref();
        if !is_known.is_some_and(|known| Arc::ptr_eq(known, &directory)) {
            self.vehicle.handle_directory(&directory);
            let extras = self.extras(&directory);
            let refused = self.following.follow(&self.vehicle, extras);
            self.counters.add_many(Counter::NotSubscribed, refused);
            self.known = Some(directory);
        }
        self.drive.handle_time(now);
        self.navigation.handle_time(now);
    }

    /// The further reports to subscribe to.
    fn extras(&self, directory: &Directory) -> Vec<Extra> {
        let parts = self.vehicle.parts().keys();
        let entries = parts.filter_map(|id| directory.component(*id));
        entries.flat_map(|entry| self.reports.of(entry)).collect()
    }

    /// Brings control, goals and the status up to date.
    fn settle(&mut self, now: Instant) {
        self.settle_drive(now);
        self.settle_goal(now);
        self.publish_status(now);
    }

    /// Sends what is to be repeated: the velocity, and an emergency.
    fn command(&mut self, now: Instant) {
        self.steer(now);
        let parts = self.vehicle.all(Role::Management);
        if let Some((on, due)) = self.emergency.poll(now, parts) {
            let rights = &self.rights;
            let allowed = |part: &JausId| rights.check_emergency_of(on, *part).is_ok();
            for part in due.into_iter().filter(allowed) {
                self.jobs.alarm(part, on);
            }
        }
    }

    fn settle_drive(&mut self, now: Instant) {
        if let Some(access) = self.drive_lease.access() {
            self.drive.handle_access(now, access);
        } else {
            self.drive.handle_access(now, Access::Pending);
        }
        let driver = self.vehicle.drive();
        let wanted = driver.filter(|_| self.drive.wants_control());
        let (said, requested) = (self.drive_lease.take_said(), self.drive_lease.want(wanted));
        self.record_control(self.driver, said, requested);
        if let Some(peer) = requested
            && let Some(authority) = self.rights.authority()
        {
            let is_ready = self.rights.may_resume(peer);
            self.jobs.begin(true, peer, authority, is_ready);
        }
    }

    /// Records what a component said about the control of a publisher, and that control is requested for it.
    fn record_control(
        &mut self,
        by: Option<Gid>,
        said: Option<(JausId, Said)>,
        requested: Option<JausId>,
    ) {
        let Some(by) = by else { return };
        if let Some((component, said)) = said {
            self.rights.record_answer(by, component, said);
        }
        if let Some(component) = requested {
            self.rights.record_request(by, component);
        }
    }

    fn steer(&mut self, now: Instant) {
        let Some(velocity) = self.drive.poll_velocity(now) else {
            return;
        };
        if let Some((session, role)) = self.drive_lease.session() {
            let limits = self.settings.drive.limits;
            self.jobs.steer(now, session, role, velocity, limits);
        }
    }

    fn settle_goal(&mut self, now: Instant) {
        match self.goal_lease.access() {
            Some(access) => {
                let why = self.goal_lease.obstacle();
                self.navigation.handle_access(access, why);
            }
            None => self.navigation.handle_released(),
        }
        let target = self.vehicle.goal();
        let wanted = target.filter(|_| self.navigation.wants_control());
        let (said, requested) = (self.goal_lease.take_said(), self.goal_lease.want(wanted));
        self.record_control(self.navigator, said, requested);
        if let Some(peer) = requested
            && let Some(authority) = self.rights.authority()
        {
            let is_ready = self.rights.may_resume(peer);
            self.jobs.begin(false, peer, authority, is_ready);
        }
        if self.navigation.is_superseded() {
            self.jobs.end_order();
        }
        let Some((session, role)) = self.goal_lease.session() else {
            return;
        };
        if let Some(order) = self.navigation.poll_order(now) {
            self.jobs
                .order(session, role, order, self.settings.goal_speed);
        }
    }

    fn publish_status(&mut self, now: Instant) {
        let control = format!(
            "{}; {}",
            self.drive_lease.description(),
            self.navigation.progress()
        );
        let is_due = self.published.as_ref().is_none_or(|(at, said)| {
            now.saturating_duration_since(*at) >= Self::STATUS || *said != control
        });
        if !is_due {
            return;
        }
        let bridge = BridgeState {
            authority: self.rights.authority(),
            drive: self.drive_lease.description(),
            obstacle: self.drive_lease.obstacle(),
            goal: self.navigation.progress().to_string(),
            counters: &self.counters,
        };
        let diagnostics = diagnostics(now, &self.vehicle, &bridge);
        let stamp = self.time.now();
        self.publish(Output::Status { stamp, diagnostics });
        self.published = Some((now, control));
    }

    fn publish(&mut self, output: Output) {
        // Newer samples follow, so none waits for ROS.
        let counter = match self.outputs.try_send(output) {
            Ok(()) => Counter::Published,
            Err(_) => Counter::NotPublished,
        };
        self.counters.add(counter);
    }
}

impl Drop for Runner {
    fn drop(&mut self) {
        for (counter, number) in self.counters.iter().filter(|(_, number)| *number > 0) {
            tracing::info!("{number} {counter}");
        }
    }
}
