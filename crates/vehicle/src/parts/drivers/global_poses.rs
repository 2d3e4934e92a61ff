//! Reports of the pose on the globe, checked and converted to the local frame of a driver.

use std::f64::consts::FRAC_PI_4;
use std::time::Instant;

use super::RemotePlatform;
use crate::mobility::Vehicle;
use crate::motion::{Frame, GlobalPose};
use jaus::messages::mobility::ReportGlobalPose;
use jaus::service::SampleStamp;

/// Passes reports to a remote platform.
///
/// A report counts only if its position is certain enough. The remote platform finds jumps.
pub(in crate::parts) struct GlobalPoses {
    remote_platform: RemotePlatform,
    vehicle: Vehicle,
    /// Greatest standard error of the position in metres.
    max_rms: f64,
}

impl GlobalPoses {
    /// Distance from the origin in metres up to which a local frame is accurate enough.
    const REACH: f64 = 5000.0;

    pub(in crate::parts) const fn new(
        remote_platform: RemotePlatform,
        vehicle: Vehicle,
        max_rms: f64,
    ) -> Self {
        Self {
            remote_platform,
            vehicle,
            max_rms,
        }
    }

    /// Errors of a position on the globe and its heading that are no jump, in metres and radians.
    pub(in crate::parts) const fn noise(max_rms: f64) -> (f64, f64) {
        (2.0 * max_rms, FRAC_PI_4)
    }

    /// Handles a report. The frame is moved to the vehicle when it is far away and at rest.
    pub(in crate::parts) fn handle_report(
        &self,
        now: Instant,
        stamp: Option<SampleStamp>,
        report: &ReportGlobalPose,
    ) {
        let is_certain = report
            .position_rms_m()
            .is_none_or(|rms| rms <= self.max_rms);
        let place = report.latitude_deg().zip(report.longitude_deg());
        let place = place.zip(report.yaw_rad()).filter(|_| is_certain);
        let pose = place.map(|((latitude, longitude), yaw)| GlobalPose {
            latitude,
            longitude,
            yaw,
            ..GlobalPose::default()
        });
        let pose = pose.map(|pose| self.to_local(&pose));
        self.remote_platform.handle_pose(now, stamp, pose);
    }

    /// The reports have ceased, or come from another sensor from now on.
    pub(in crate::parts) fn handle_loss(&self, now: Instant) {
        self.remote_platform.handle_pose(now, None, None);
    }

    fn to_local(&self, pose: &GlobalPose) -> (f64, f64, f64) {
        let mut local = self.vehicle.frame().to_local(pose);
        if local.distance(0.0, 0.0) > Self::REACH && !self.vehicle.is_under_way() {
            let here = Frame::at(pose.latitude, pose.longitude);
            self.vehicle.set_frame(here);
            local = here.to_local(pose);
        }
        (local.x, local.y, local.yaw)
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::motion::{Goal, Limits, Pilot, Pose, Waypoint};
    use crate::parts::drivers::remote_platform::Plan;
    use crate::parts::drivers::{FaultMonitor, RemotePlatformSettings};
    use jaus::messages::core;
    use jaus::messages::mobility::report_global_pose::TimeStamp;

    /// A driver on its way north, with a sensor that reports 25 times a second.
    struct Bench {
        remote_platform: RemotePlatform,
        vehicle: Vehicle,
        poses: GlobalPoses,
        start: Instant,
        now: Instant,
        metres: f64,
    }

    /// What a faulty sensor does to its reports; `None` if it sends none.
    type Fault = fn(ReportGlobalPose) -> Option<ReportGlobalPose>;

    const SOUND: Fault = Some;
    const PERIOD: Duration = Duration::from_millis(40);

    impl Bench {
        fn new() -> Self {
            let limits = Limits::default();
            let remote_platform = RemotePlatform::new(RemotePlatformSettings {
                limits,
                noise: GlobalPoses::noise(5.0),
                stale: Duration::from_millis(600),
                by_heading: false,
                needs_scan: false,
            });
            let mut pilot = Pilot::new(remote_platform.clone(), Frame::at(52.5, 13.4));
            pilot.pursue(Goal::Waypoint {
                to: Waypoint::at(500.0, 0.0),
                speed: 1.0,
                goes_on: false,
            });
            let vehicle = Vehicle::new(pilot);
            let start = Instant::now();
            let poses = GlobalPoses::new(remote_platform.clone(), vehicle.clone(), 5.0);
            let mut bench = Self {
                remote_platform,
                vehicle,
                poses,
                start,
                now: start,
                metres: 0.0,
            };
            bench.run(2.0, SOUND);
            assert_eq!(bench.wait(), None);
            bench
        }

        fn run(&mut self, seconds: f64, fault: Fault) {
            for _ in 0..(seconds / PERIOD.as_secs_f64()) as u32 {
                self.now += PERIOD;
                self.metres += 0.04;
                let velocity = Some((1.0, 0.0));
                self.remote_platform
                    .handle_velocity(self.now, None, velocity);
                if let Some(report) = fault(self.report()) {
                    let stamp = report
                        .time_stamp
                        .map(|it| core::report_time::TimeStamp(it.0));
                    let stamp = stamp.and_then(|it| SampleStamp::of_report(it, None));
                    self.poses.handle_report(self.now, stamp, &report);
                }
                self.vehicle.handle_time(self.now);
            }
        }

        fn report(&self) -> ReportGlobalPose {
            let place = Frame::at(52.5, 13.4).to_global(&Pose::at(self.metres, 0.0));
            let time = self.now.saturating_duration_since(self.start);
            let stamp = TimeStamp::default().with_day(1).unwrap();
            let stamp = stamp.with_seconds(time.as_secs() as u8).unwrap();
            let mut report = ReportGlobalPose {
                time_stamp: stamp.with_milliseconds(time.subsec_millis() as u16).ok(),
                ..ReportGlobalPose::default()
            };
            report.set_latitude_deg(place.latitude).unwrap();
            report.set_longitude_deg(place.longitude).unwrap();
            report.set_yaw_rad(0.0).unwrap();
            report.set_position_rms_m(0.1).unwrap();
            report
        }

        /// Why the order must wait, if it must.
        fn wait(&self) -> Option<String> {
            match self.remote_platform.plan(self.now) {
                Plan::Go(..) => None,
                Plan::Wait(lack) => Some(lack.why),
                Plan::Rest => panic!("it is under way"),
            }
        }
    }

    fn jumped(mut report: ReportGlobalPose) -> Option<ReportGlobalPose> {
        let latitude = report.latitude_deg()?;
        report.set_latitude_deg(latitude + 100.0 / 111_272.0).ok()?;
        Some(report)
    }

    #[test]
    fn a_sensor_that_falls_silent_stops_it_within_the_limit() {
        let mut bench = Bench::new();
        bench.run(0.56, |_| None);
        assert_eq!(bench.wait(), None);
        bench.run(0.1, |_| None);
        assert_eq!(bench.wait().as_deref(), Some("the pose is 0.6 s old"));
        bench.run(0.1, SOUND);
        assert_eq!(bench.wait(), None, "the sensor is back");
    }

    #[test]
    fn a_sensor_that_repeats_its_sample_stops_it_within_the_limit() {
        let mut bench = Bench::new();
        let frozen: Fault = |mut report| {
            let stamp = TimeStamp::default().with_day(1).ok()?;
            report.time_stamp = stamp.with_seconds(2).ok();
            Some(report)
        };
        bench.run(0.72, frozen);
        assert!(bench.wait().is_some_and(|it| it.starts_with("the pose is")));
    }

    #[test]
    fn an_unknown_or_uncertain_position_stops_it_at_once() {
        let faults: [Fault; 3] = [
            // What is not a number is absent from a report.
            |report| {
                Some(ReportGlobalPose {
                    latitude: None,
                    ..report
                })
            },
            |report| {
                Some(ReportGlobalPose {
                    yaw: None,
                    ..report
                })
            },
            |mut report| report.set_position_rms_m(5.1).ok().map(|()| report),
        ];
        for fault in faults {
            let mut bench = Bench::new();
            bench.run(0.04, fault);
            assert_eq!(bench.wait().as_deref(), Some("no pose is known"));
        }
    }

    #[test]
    fn a_position_that_jumps_stops_it_for_so_long_that_the_driver_fails() {
        let mut bench = Bench::new();
        bench.run(0.04, jumped);
        assert!(bench.wait().is_some_and(|it| it.contains("jumped by 100")));
        bench.run(FaultMonitor::LIMIT.as_secs_f64() + 0.5, SOUND);
        assert!(bench.wait().is_some_and(|it| it.contains("jumped by 100")));
        bench.run(1.0, jumped);
        assert_eq!(bench.wait(), None, "then it counts");
    }

    #[test]
    fn a_vehicle_at_rest_may_be_anywhere() {
        let mut bench = Bench::new();
        bench.vehicle.stop();
        bench.run(0.2, jumped);
        assert_eq!(bench.remote_platform.lack(bench.now), None);
    }
}
