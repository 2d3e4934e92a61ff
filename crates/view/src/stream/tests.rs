//! Filters and duplicate detection.

use bytes::Bytes;
use serde_json::json;

use super::*;
use jaus::address::JausId;
use jaus::codec::Message as _;
use jaus::messages::mobility::ReportVelocityState;
use jaus::wire::{Acknowledgement, DataControl, Flags, Priority};

fn entry(json: Json) -> Entry {
    match json {
        Json::Object(object) => Entry::of_object(object),
        other => panic!("{other}"),
    }
}

fn velocity() -> Entry {
    entry(json!({
        "time": "2026-01-01T12:00:00.000000Z", "direction": "sent", "source": "101.2.33",
        "destination": "42.1.1", "priority": "standard", "sequence": 7, "code": "4404",
        "message": "ReportVelocityState",
        "service": "urn:jaus:jss:mobility:VelocityStateSensor",
        "body": {
            "Velocity_X": 1.5, "State": "Ready",
            "Records": [{"Pose": {"X": 1, "Y": -2}}, {"Pose": {"X": 5, "Y": 0}}],
        },
    }))
}

#[track_caller]
fn passes(filter: &str) -> bool {
    let parsed: Filter = filter.parse().unwrap();
    let again: Filter = parsed.to_string().parse().unwrap();
    assert_eq!(parsed, again, "{filter}");
    parsed.passes(&velocity())
}

#[test]
fn a_message_must_meet_every_term() {
    for filter in [
        "",
        "component=101",
        "component=101.2.33",
        "component=42.*.1",
        "component=7,42",
        "from=101.2 to=42",
        "service=velocitystate",
        "service=urn:jaus:jss:mobility:VelocityStateSensor",
        "message=ReportVelocityState",
        "message=velocity",
        "message=Report*State",
        "message=4404 message=4404h",
        "message=Nothing,4404",
        "direction=sent,local",
        "velocity_x>1.0",
        "Velocity_X>=1.5 velocityx<2",
        "velocity_x!=2",
        "state=READY",
        "state~ead",
        "pose.x=5",
        "records.1.pose.x=5",
        "body.records.0.pose.y<0",
        "sequence=7",
        "priority=standard",
        "ready",
        "\"2026-01-01T12\"",
        "text=VelocityStateSensor velocity_x=1.5 component=101",
    ] {
        assert!(passes(filter), "{filter}");
    }
    for filter in [
        "component=102",
        "to=101",
        "from=42",
        "service=PoseSensor",
        "message=Query*",
        "message=ReportVelocity*X",
        "message=4403",
        "direction=received",
        "velocity_x>1.5",
        "velocity_x=1.4",
        "velocity_y>0",
        "records.0.pose.x=5",
        "state>1",
        "state!=ready",
        "nowhere",
        "component=101 velocity_x>2",
    ] {
        assert!(!passes(filter), "{filter}");
    }
}

#[test]
fn a_mistake_in_a_filter_is_told_with_what_would_be_right() {
    for (filter, part) in [
        ("component=rover", "write 101.2.33"),
        ("component=1.2.3.4", "write 101.2.33"),
        ("velocity_x>fast", "need a number after them"),
        ("direction=up", "received, sent, local, passing"),
        ("\"open", "lacks a closing double quote"),
    ] {
        let said = filter.parse::<Filter>().unwrap_err().to_string();
        assert!(said.contains(part), "{filter}: {said}");
    }
    let mut filter = Filter::default();
    filter.add("text", "").unwrap();
    assert!(filter.is_empty());
    let said = filter.add("mesage", "x").unwrap_err().to_string();
    assert!(
        said.contains("`mesage`") && said.contains("component, from"),
        "{said}"
    );
    assert!(filter.add("field", "velocity").is_err());
    assert!(filter.add("text", &"x".repeat(5000)).is_err(), "bounded");
}

fn frame(sequence: u16, payload: &'static [u8]) -> Frame {
    Frame {
        sequence,
        ..Frame::new(
            JausId::new(101, 1, 1),
            JausId::new(42, 1, 1),
            Bytes::from_static(payload),
        )
    }
}

const QUERY: &[u8] = b"\x00\x2B\x02";

fn arrival(milliseconds: u32) -> Arrival {
    let (seconds, rest) = (milliseconds / 1000, milliseconds % 1000);
    let time = Timestamp::new(i64::from(seconds), rest * 1_000_000, 6);
    Arrival {
        time: Some(time),
        from: None,
    }
}

/// The number of lines for each frame and its time.
fn shown(frames: &[(u32, Frame)]) -> Vec<usize> {
    let dictionary = Dictionary::new();
    let mut stream = MessageStream::new(&dictionary, Filter::default());
    let mut read = |(time, frame): &(u32, Frame)| {
        let entry = stream.read_frame(arrival(*time), frame);
        usize::from(entry.is_some())
    };
    frames.iter().map(&mut read).collect()
}

#[test]
fn what_is_repeated_or_comes_by_another_way_is_shown_once() {
    let wants = Flags::new(Priority::Standard).with_acknowledgement(Acknowledgement::Request);
    let repeated = Frame {
        flags: wants,
        ..frame(9, QUERY)
    };
    let counts = shown(&[
        (0, frame(1, QUERY)),
        (1, frame(1, QUERY)),
        (2, frame(2, QUERY)),
        (3, repeated.clone()),
        (800, repeated.clone()),
        (1600, repeated.clone()),
        (9000, repeated),
    ]);
    assert_eq!(counts, [1, 0, 1, 1, 0, 0, 1], "numbers come again later");
}

#[test]
fn what_has_no_number_is_a_copy_only_at_once() {
    let counts = shown(&[
        (0, frame(0, QUERY)),
        (1, frame(0, QUERY)),
        (100, frame(0, QUERY)),
    ]);
    assert_eq!(counts, [1, 0, 1]);
}

#[test]
fn a_message_in_fragments_is_shown_when_it_is_whole_also_when_fragments_come_twice() {
    let part = |data, sequence, payload| Frame {
        flags: Flags::default().with_data(data),
        ..frame(sequence, payload)
    };
    let first = part(DataControl::First, 1, b"\x00\x2B");
    let last = part(DataControl::Last, 2, b"\x02");
    let counts = shown(&[(0, first.clone()), (1, first), (2, last.clone()), (3, last)]);
    assert_eq!(counts, [0, 0, 1, 0]);
}

#[test]
fn acknowledgements_are_not_shown() {
    let acknowledgement = Frame {
        flags: Flags::default().with_acknowledgement(Acknowledgement::Positive),
        ..frame(1, b"")
    };
    assert_eq!(shown(&[(0, acknowledgement)]), [0]);
}

#[test]
fn a_line_for_people_names_who_what_and_the_fields_and_hides_control_characters() {
    let dictionary = Dictionary::new();
    assert_eq!(
        velocity().in_words(&dictionary, false),
        "12:00:00.000   101.2.33 → 42.1.1     sent     ReportVelocityState  Velocity_X=1.5 \
         State=Ready Records([Pose(X=1 Y=-2)] [Pose(X=5 Y=0)])"
    );
    let name = "\u{1b}[2J\r\nforged \u{202e}";
    let hostile = entry(json!({
        "source": name, "direction": name, "message": name, "body": {name: name},
    }));
    let shown = hostile.in_words(&dictionary, false);
    assert!(!shown.contains(jaus_text::is_unprintable), "{shown}");
    let error = entry(json!({"message": "M", "error": name}));
    let shown = error.in_words(&dictionary, false);
    assert!(!shown.contains(jaus_text::is_unprintable), "{shown}");
    assert!(velocity().in_words(&dictionary, true).contains("\u{1b}["));
}

#[test]
fn lines_that_were_written_are_read_back_as_they_were() {
    let dictionary = Dictionary::new();
    let stream = MessageStream::new(&dictionary, "velocity_x>1".parse().unwrap());
    let line = velocity().to_json();
    assert_eq!(stream.read_json(&line), Ok(Some(velocity())));
    assert_eq!(stream.read_json(r#"{"message":"M"}"#), Ok(None));
    assert!(stream.read_json("{").is_err() && stream.read_json("7").is_err());
}

/// An event 3, number 7, with the velocity 1.5 m/s.
fn event() -> Frame {
    let mut report = ReportVelocityState::default();
    report.set_velocity_x_m_per_s(1.5).unwrap();
    let report = report.encode().unwrap();
    let length = (report.len() as u32).to_le_bytes();
    let payload = [&b"\xF1\x41\x03\x07"[..], &length, &report].concat();
    Frame {
        payload: payload.into(),
        ..frame(1, b"")
    }
}

#[test]
fn an_event_is_shown_with_the_report_inside_and_matches_as_that_report() {
    let dictionary = Dictionary::new();
    let complete = Dictionary::new().with_catalogue();
    for filter in [
        "",
        "message=Event",
        "message=41F1",
        "message=ReportVelocityState",
        "message=4404",
        "service=VelocityStateSensor",
        "service=core:Events",
        "velocity_x>1.0",
        "sequencenumber=7 velocity_x<2",
        "message=ReportVelocityState eventid=3",
    ] {
        let mut stream = MessageStream::new(&dictionary, filter.parse().unwrap());
        let shown = stream.read_frame(arrival(0), &event());
        let words = shown.expect(filter).in_words(&complete, false);
        assert!(words.contains("Event: ReportVelocityState "), "{words}");
        assert!(words.contains("EventID=3 SequenceNumber=7"), "{words}");
        assert!(words.contains("Velocity_X=1.5 m/s"), "{words}");
    }
    for filter in ["velocity_x>2", "message=4403", "service=PoseSensor"] {
        let mut stream = MessageStream::new(&dictionary, filter.parse().unwrap());
        assert_eq!(stream.read_frame(arrival(0), &event()), None, "{filter}");
    }
}

#[test]
fn an_event_in_an_event_is_opened_once_and_a_damaged_report_is_named() {
    let dictionary = Dictionary::new();
    let shown = |report: &[u8]| {
        let length = (report.len() as u32).to_le_bytes();
        let octets = [&b"\xF1\x41\x03\x07"[..], &length, report].concat();
        let line = dictionary.line(&octets.into());
        serde_json::to_value(&line).unwrap()
    };
    let nested = shown(&event().payload);
    assert_eq!(nested["carries"]["message"], "Event");
    assert!(nested["carries"]["body"]["ReportMessage"].is_string());
    let damaged = shown(b"\x02\x42");
    assert_eq!(damaged["carries"]["message"], "ReportHeartbeatPulse");
    let unknown = shown(b"\xEE\xEE\x01");
    assert_eq!(unknown["carries"]["octets"], "eeee01");
    assert!(unknown["carries"]["error"].is_string(), "{unknown}");
    assert!(shown(b"").get("carries").is_none());
}

#[test]
fn what_the_writer_of_a_line_could_not_decode_is_decoded_and_filtered_here() {
    let nothing = Dictionary::of(jaus::codec::Registry::new(&[]));
    let dictionary = Dictionary::new();
    let mut writer = MessageStream::new(&nothing, Filter::default());
    for (frame, name) in [
        (frame(1, b"\x02\x40\x02\0\0\0\0"), "ReportStatus"),
        (event(), "ReportVelocityState"),
    ] {
        let line = writer.read_frame(arrival(0), &frame).unwrap().to_json();
        assert!(!line.contains(name), "{line}");
        let filter = format!("message={name}").parse().unwrap();
        let stream = MessageStream::new(&dictionary, filter);
        let read = stream.read_json(&line).unwrap().unwrap();
        let mut direct = MessageStream::new(&dictionary, Filter::default());
        let direct = direct.read_frame(arrival(0), &frame).unwrap();
        assert_eq!(read.json(), direct.json(), "{line}");
        assert_eq!((read.octets, direct.octets), (None, Some(frame.payload)));
    }
}

#[test]
fn enumerated_values_are_written_by_name_whichever_codec_has_read_them() {
    let mut generated = Dictionary::new();
    let mut read = Dictionary::of(jaus::codec::Registry::new(&[]));
    read.load::<&std::path::Path>([]);
    for dictionary in [&mut generated, &mut read] {
        for (octets, field, value) in [
            (&b"\x02\x40\x02\0\0\0\0"[..], "Status", json!("STANDBY")),
            (b"\x02\x40\x77\0\0\0\0", "Status", json!(0x77)),
        ] {
            let octets = Bytes::from_static(octets);
            let line = dictionary.line(&octets).to_json();
            let line: Json = serde_json::from_str(&line).unwrap();
            assert_eq!(line["body"][field], value, "{line}");
            let request = crate::Request::from_json(&line.to_string()).unwrap();
            assert_eq!(dictionary.write(&request).unwrap(), octets);
        }
    }
}
