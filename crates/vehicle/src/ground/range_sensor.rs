//! Range Sensor (AS6060): reports the scans of one range sensor in the vehicle's coordinates.
//!
//! The settings are fixed, and the data are not compressed.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::messages::environment_sensing::confirm_sensor_configuration::{
    ConfirmSensorConfigurationVariant, RangeSensorErrorCode, RangeSensorErrorRec, RequestIdRec,
};
use crate::messages::environment_sensing::report_range_sensor_capabilities::{
    MaximumRange, RangeSensorCapabilitiesRec,
};
use crate::messages::environment_sensing::report_range_sensor_compressed_data::RangeSensorCompressedDataVariant;
use crate::messages::environment_sensing::report_range_sensor_configuration::{
    HorizontalFieldOfViewStartAngle, HorizontalFieldOfViewStopAngle,
    MaximumRange as ConfiguredRange, RangeSensorConfigurationRec, UpdateRate,
};
use crate::messages::environment_sensing::report_range_sensor_data::{
    Bearing, DataErrorCode, Inclination, Range, RangeSensorDataErrorRec, RangeSensorDataPointRec,
    RangeSensorDataRec, RangeSensorDataSeq, RangeSensorDataVariant, RangeValidity,
    ReportCoordinateSystem, TimeStamp,
};
use crate::messages::environment_sensing::report_sensor_geometric_properties::{
    GeometricPropertiesSequence, GeometricPropertiesVariant, PositionVectorElement, SensorIdRec,
    StaticGeometricPropertiesRec, UnitQuaternionElement,
};
use crate::messages::environment_sensing::{
    ConfirmSensorConfiguration, QueryRangeSensorCapabilities, QueryRangeSensorCompressedData,
    QueryRangeSensorConfiguration, QueryRangeSensorData, QuerySensorGeometricProperties,
    ReportRangeSensorCapabilities, ReportRangeSensorCompressedData, ReportRangeSensorConfiguration,
    ReportRangeSensorData, ReportSensorGeometricProperties, SetRangeSensorConfiguration,
    range_sensor,
};
use crate::sensing::{RangerConfig, Ray, Scan};
use jaus::codec::Call as _;
use jaus::component::{Call, Handlers};

/// The number of the sensor.
const SENSOR: u16 = 1;
/// A sensor most of whose distances are below this, in metres, is covered.
const COVERED: f64 = 0.05;
/// Its name, for people.
const NAME: &str = "range sensor";

/// Reports the latest scan to any client. Cheap to clone; all clones share one state.
///
/// Of the published services, Range Sensor carries the time of each measurement and needs no
/// knowledge of the vehicle's pose. Cost Map 2D of the interoperability profiles has neither: its
/// cells are placed and aged by the sender, and a driver could not tell a frozen map from a current
/// one.
///
/// A ray that meets nothing has the sensor's reach as its range.
#[derive(Debug, Clone)]
pub struct RangeSensor {
    config: RangerConfig,
    hz: f64,
    latest: Arc<Mutex<Option<RangeSensorDataSeq>>>,
}

impl RangeSensor {
    /// A sensor that measures `hz` times a second.
    #[must_use]
    pub fn new(config: RangerConfig, hz: f64) -> Self {
        Self {
            config,
            hz,
            latest: Arc::default(),
        }
    }

    /// Creates the service that reports the scans.
    #[must_use]
    pub fn service(&self) -> Handlers<range_sensor::Server<Self>> {
        Handlers::of(range_sensor::Server::new(self.clone()))
    }

    /// Sets the latest scan and the time of its measurement (UTC); `None` while the sensor does not
    /// measure.
    pub fn publish(&self, scan: Option<&Scan>, sampled_at: SystemTime) {
        // Clocks before 1970 are not set.
        let since_1970 = sampled_at.duration_since(UNIX_EPOCH).unwrap_or_default();
        let data = scan.map(|scan| RangeSensorDataSeq {
            range_sensor_data_rec: RangeSensorDataRec {
                sensor_id: SENSOR,
                report_coordinate_system: ReportCoordinateSystem::VEHICLE_COORDINATE_SYSTEM,
                time_stamp: TimeStamp::at(since_1970),
            },
            range_sensor_data_point_list: scan.rays().iter().filter_map(point).collect(),
        });
        *self.latest.lock().unwrap_or_else(PoisonError::into_inner) = data;
    }

    fn data(&self, sensor: u16) -> RangeSensorDataVariant {
        let why = if is_meant(sensor) {
            let latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(data) = latest.as_ref() {
                return RangeSensorDataVariant::RangeSensorDataSeq(data.clone());
            }
            "the sensor does not measure"
        } else {
            "there is only sensor 1"
        };
        let code = DataErrorCode::SENSOR_IS_NOT_ACTIVE;
        RangeSensorDataVariant::RangeSensorDataErrorRec(data_error(sensor, code, why))
    }

    fn configuration(&self) -> RangeSensorConfigurationRec {
        let half = self.config.field_of_view / 2.0;
        RangeSensorConfigurationRec {
            sensor_id: SENSOR,
            horizontal_field_of_view_start_angle: HorizontalFieldOfViewStartAngle::new(-half).ok(),
            horizontal_field_of_view_stop_angle: HorizontalFieldOfViewStopAngle::new(half).ok(),
            update_rate: UpdateRate::new(self.hz).ok(),
            maximum_range: ConfiguredRange::new(self.config.reach).ok(),
            ..RangeSensorConfigurationRec::default()
        }
    }

    fn capabilities(&self) -> RangeSensorCapabilitiesRec {
        RangeSensorCapabilitiesRec {
            sensor_id: SENSOR,
            sensor_name: NAME.into(),
            maximum_range: MaximumRange::new(self.config.reach).ok(),
            ..RangeSensorCapabilitiesRec::default()
        }
    }
}

impl range_sensor::Service<Call<'_>> for RangeSensor {
    fn set_range_sensor_configuration(
        &mut self,
        set: SetRangeSensorConfiguration,
        call: &mut Call<'_>,
    ) {
        call.send(&refusal(&set));
    }

    fn query_sensor_geometric_properties(
        &mut self,
        query: QuerySensorGeometricProperties,
        _: &mut Call<'_>,
    ) -> Option<ReportSensorGeometricProperties> {
        let asked = query.sensor_id_list.iter();
        let asked = asked.filter(|it| is_meant(it.sensor_id.0));
        Some(ReportSensorGeometricProperties {
            geometric_properties_list: asked.map(|_| in_the_middle()).collect(),
        })
    }

    fn query_range_sensor_compressed_data(
        &mut self,
        query: QueryRangeSensorCompressedData,
        _: &mut Call<'_>,
    ) -> Option<ReportRangeSensorCompressedData> {
        let asked = query.query_range_sensor_compressed_data_list.iter();
        let refused = asked.map(|it| {
            let code = DataErrorCode::INVALID_COMPRESSION_FORMAT;
            let why = "the data are not compressed: query Range Sensor Data";
            let error = data_error(it.sensor_id.0, code, why);
            RangeSensorCompressedDataVariant::RangeSensorDataErrorRec(error)
        });
        Some(ReportRangeSensorCompressedData {
            range_sensor_compressed_data_list: refused.collect(),
        })
    }

    fn query_range_sensor_data(
        &mut self,
        query: QueryRangeSensorData,
        _: &mut Call<'_>,
    ) -> Option<ReportRangeSensorData> {
        let asked = query.query_range_sensor_data_list.iter();
        Some(ReportRangeSensorData {
            range_sensor_data_list: asked.map(|it| self.data(it.sensor_id.0)).collect(),
        })
    }

    fn query_range_sensor_capabilities(
        &mut self,
        query: QueryRangeSensorCapabilities,
        _: &mut Call<'_>,
    ) -> Option<ReportRangeSensorCapabilities> {
        let asked = query.range_sensor_capabilities_list.iter();
        let asked = asked.filter(|it| is_meant(it.sensor_id.0));
        Some(ReportRangeSensorCapabilities {
            range_sensor_capabilities_list: asked.map(|_| self.capabilities()).collect(),
        })
    }

    fn query_range_sensor_configuration(
        &mut self,
        query: QueryRangeSensorConfiguration,
        _: &mut Call<'_>,
    ) -> Option<ReportRangeSensorConfiguration> {
        let asked = query.range_sensor_configuration_list.iter();
        let asked = asked.filter(|it| is_meant(it.sensor_id.0));
        Some(ReportRangeSensorConfiguration {
            range_sensor_configuration_list: asked.map(|_| self.configuration()).collect(),
        })
    }
}

/// Whether a number in a query stands for the sensor.
const fn is_meant(number: u16) -> bool {
    number == 0 || number == SENSOR
}

fn point(ray: &Ray) -> Option<RangeSensorDataPointRec> {
    Some(RangeSensorDataPointRec {
        range: Range::new(ray.range).ok()?,
        bearing: Bearing::new(crate::motion::wrap(ray.bearing)).ok()?,
        inclination: Inclination::new(0.0).ok()?,
        ..RangeSensorDataPointRec::default()
    })
}

fn data_error(sensor: u16, data_error_code: DataErrorCode, why: &str) -> RangeSensorDataErrorRec {
    RangeSensorDataErrorRec {
        sensor_id: sensor.max(SENSOR),
        data_error_code,
        error_message: why.into(),
    }
}

fn in_the_middle() -> GeometricPropertiesSequence {
    let place = |metres: f64| PositionVectorElement::new(metres).unwrap_or_default();
    let share = |number: f64| UnitQuaternionElement::new(number).unwrap_or_default();
    GeometricPropertiesSequence {
        sensor_id_rec: SensorIdRec { sensor_id: SENSOR },
        geometric_properties_variant: GeometricPropertiesVariant::StaticGeometricPropertiesRec(
            StaticGeometricPropertiesRec {
                sensor_position: [0.0; 3].map(place),
                unit_quaternion: [1.0, 0.0, 0.0, 0.0].map(share),
            },
        ),
    }
}

/// The settings are flags of the sensor's program.
fn refusal(set: &SetRangeSensorConfiguration) -> ConfirmSensorConfiguration {
    let sensors = set.range_sensor_configuration_list.iter();
    let refused = sensors.map(|it| {
        let (range_sensor_error_code, why) = match it.sensor_id {
            SENSOR => (
                RangeSensorErrorCode::UNKNOWN_ERROR_FAULT,
                "its settings are fixed",
            ),
            _ => (
                RangeSensorErrorCode::UNKNOWN_SENSOR_ID,
                "there is only sensor 1",
            ),
        };
        ConfirmSensorConfigurationVariant::RangeSensorErrorRec(RangeSensorErrorRec {
            sensor_id: it.sensor_id,
            range_sensor_error_code,
            error_message: why.into(),
        })
    });
    ConfirmSensorConfiguration {
        request_id_rec: RequestIdRec {
            request_id: set.request_id_rec.request_id,
        },
        confirm_sensor_list: refused.collect(),
    }
}

/// The scan in a report and its time stamp; `None` if no sensor measures.
///
/// Only data in the vehicle's coordinates count, because the mounting of a sensor is not known here.
/// Distances are horizontal: a measurement of the ground is an obstacle. If more than half of the
/// measurements are marked as invalid, or end at the sensor because it is covered, it is blind, and
/// there is no scan.
#[must_use]
pub fn reported_scan(report: &ReportRangeSensorData) -> Option<(TimeStamp, Scan)> {
    report.range_sensor_data_list.iter().find_map(|sensor| {
        let RangeSensorDataVariant::RangeSensorDataSeq(data) = sensor else {
            return None;
        };
        let points = &data.range_sensor_data_point_list;
        let is_valid =
            |it: &&RangeSensorDataPointRec| it.range_validity != Some(RangeValidity::FALSE);
        let sees = |it: &&RangeSensorDataPointRec| it.range.value() > COVERED;
        let seen = points.iter().filter(is_valid).filter(sees).count();
        let is_blind = seen * 2 < points.len();
        let system = data.range_sensor_data_rec.report_coordinate_system;
        let is_of_vehicle = system == ReportCoordinateSystem::VEHICLE_COORDINATE_SYSTEM;
        if points.is_empty() || is_blind || !is_of_vehicle {
            return None;
        }
        let scan = Scan::new(points.iter().filter(is_valid).map(|it| Ray {
            bearing: it.bearing.value(),
            range: it.range.value() * it.inclination.value().cos(),
        }));
        Some((data.range_sensor_data_rec.time_stamp, scan))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::environment_sensing::query_range_sensor_data::{
        QueryRangeSensorDataRec, SensorId,
    };
    use jaus::service::rig::{CLIENT, Rig};
    use std::time::Duration;

    fn query(sensor: u16) -> QueryRangeSensorData {
        QueryRangeSensorData {
            query_range_sensor_data_list: vec![QueryRangeSensorDataRec {
                sensor_id: SensorId(sensor),
                ..QueryRangeSensorDataRec::default()
            }],
        }
    }

    #[test]
    fn a_scan_is_reported_as_it_was_published() {
        let service = RangeSensor::new(RangerConfig::default(), 10.0);
        let mut rig = Rig::new(vec![Box::new(service.service())]);
        let silent: ReportRangeSensorData = rig.ask(&query(0)).unwrap();
        assert_eq!(reported_scan(&silent), None);
        let rays = [(-1.5, 2.0), (0.0, 8.0), (1.5, 0.25)];
        let rays = rays.map(|(bearing, range)| Ray { bearing, range });
        let at = Duration::from_secs(1_700_000_000);
        service.publish(Some(&Scan::new(rays)), UNIX_EPOCH + at);
        let report: ReportRangeSensorData = rig.ask(&query(1)).unwrap();
        let (stamp, scan) = reported_scan(&report).unwrap();
        assert_eq!(stamp, TimeStamp::at(at));
        assert_eq!(scan.rays().len(), rays.len());
        for (found, expected) in scan.rays().iter().zip(&rays) {
            let off = (found.bearing - expected.bearing).abs();
            assert!(
                off < 1e-6 && (found.range - expected.range).abs() < 1e-3,
                "{found:?}"
            );
        }
        let other: ReportRangeSensorData = rig.ask(&query(2)).unwrap();
        assert_eq!(reported_scan(&other), None);
    }

    /// A report of ten rays, as a sensor changes it.
    fn changed(change: impl FnOnce(&mut RangeSensorDataSeq)) -> ReportRangeSensorData {
        let service = RangeSensor::new(RangerConfig::default(), 10.0);
        let ray = |index: u8| Ray {
            bearing: f64::from(index) / 10.0,
            range: 1.0,
        };
        service.publish(Some(&Scan::new((0..10).map(ray))), UNIX_EPOCH);
        let mut data = service.data(0);
        if let RangeSensorDataVariant::RangeSensorDataSeq(data) = &mut data {
            change(data);
        }
        ReportRangeSensorData {
            range_sensor_data_list: vec![data],
        }
    }

    #[test]
    fn invalid_measurements_are_left_out_and_a_sensor_with_most_of_them_is_blind() {
        for invalid in [0, 1, 5, 6, 10] {
            let report = changed(|data| {
                for point in data.range_sensor_data_point_list.iter_mut().take(invalid) {
                    point.range_validity = Some(RangeValidity::FALSE);
                }
            });
            let rays = reported_scan(&report).map(|(_, scan)| scan.rays().len());
            assert_eq!(rays, (invalid <= 5).then_some(10 - invalid), "{invalid}");
        }
        for covered in [5, 6] {
            let report = changed(|data| {
                for point in data.range_sensor_data_point_list.iter_mut().take(covered) {
                    point.range = Range::new(0.01).unwrap();
                }
            });
            assert_eq!(reported_scan(&report).is_some(), covered == 5);
        }
        let nothing = changed(|data| data.range_sensor_data_point_list.clear());
        assert_eq!(reported_scan(&nothing), None);
    }

    #[test]
    fn data_in_the_coordinates_of_a_sensor_are_no_scan() {
        let native = changed(|data| {
            data.range_sensor_data_rec.report_coordinate_system =
                ReportCoordinateSystem::NATIVE_COORDINATE_SYSTEM;
        });
        assert_eq!(reported_scan(&native), None);
    }

    #[test]
    fn numbers_that_are_none_are_not_sent() {
        for (bearing, range) in [(f64::NAN, 1.0), (0.0, f64::NAN), (0.0, -1.0), (0.0, 1e9)] {
            assert_eq!(point(&Ray { bearing, range }), None);
        }
    }

    #[test]
    fn settings_are_refused_with_the_reason() {
        let service = RangeSensor::new(RangerConfig::default(), 10.0).service();
        let mut rig = Rig::new(vec![Box::new(service)]);
        let set = SetRangeSensorConfiguration {
            range_sensor_configuration_list: vec![RangeSensorConfigurationRec {
                sensor_id: SENSOR,
                ..Default::default()
            }],
            ..SetRangeSensorConfiguration::default()
        };
        assert!(rig.send(CLIENT, &set));
        let confirm: ConfirmSensorConfiguration = rig.answer().unwrap();
        assert!(matches!(
            &confirm.confirm_sensor_list[..],
            [ConfirmSensorConfigurationVariant::RangeSensorErrorRec(it)]
                if it.error_message == *"its settings are fixed"
        ));
    }
}
