//! The time stamp of a report.

use jaus::messages::core::report_time::TimeStamp;
use jaus_view::Line;
use serde_json::Value as Json;

/// The field with the standard's time stamp, in reports that have one.
const FIELD: &str = "TimeStamp";

/// When the sender took the sample, by its clock; `None` if the report does not say.
pub(super) fn time_stamp(line: &Line<'_>) -> Option<TimeStamp> {
    let line = serde_json::to_value(line).ok()?;
    stamp_in(line.get("body")?)
}

fn stamp_in(body: &Json) -> Option<TimeStamp> {
    let stamp = body.get(FIELD)?;
    let part = |name: &str| u16::try_from(stamp.get(name)?.as_u64()?).ok();
    let small = |name: &str| u8::try_from(part(name)?).ok();
    let time = TimeStamp::default().with_day(small("Day")?).ok()?;
    let time = time.with_hour(small("Hour")?).ok()?;
    let time = time.with_minutes(small("Minutes")?).ok()?;
    let time = time.with_seconds(small("Seconds")?).ok()?;
    time.with_milliseconds(part("Milliseconds")?).ok()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use bytes::Bytes;
    use jaus::codec::Message;
    use jaus::messages::mobility::{ReportLocalPose, report_local_pose};
    use jaus_view::Dictionary;

    use super::*;

    #[test]
    fn the_stamp_of_a_report_is_found_and_others_have_none() {
        let time = Duration::from_millis(1_709_164_798_250);
        let mut report = ReportLocalPose {
            time_stamp: Some(report_local_pose::TimeStamp::at(time)),
            ..ReportLocalPose::default()
        };
        let dictionary = Dictionary::new();
        let stamp_of = |report: &ReportLocalPose| {
            let octets: Bytes = report.encode().unwrap();
            time_stamp(&dictionary.line(&octets))
        };
        assert_eq!(stamp_of(&report), Some(TimeStamp::at(time)));
        report.time_stamp = None;
        assert_eq!(stamp_of(&report), None);
    }
}
