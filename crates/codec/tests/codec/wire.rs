//! Octets, and the errors of octets.

use jaus_codec::{
    Bytes, DecodeErrorKind, EncodeErrorKind, FormattedBlob, Message, Reader, Text, Writer,
};

use crate::messages::{Mode, ReportSurvey, SURVEY, SetMode, Shape, survey};

/// The octets of a survey with some of them replaced from an offset on.
fn with(at: usize, octets: &[u8]) -> Bytes {
    let mut changed = SURVEY.to_vec();
    changed[at..at + octets.len()].copy_from_slice(octets);
    changed.into()
}

#[test]
fn a_message_is_its_code_and_its_fields_little_endian_and_unpadded() {
    assert_eq!(survey().encode().unwrap(), SURVEY);
    assert_eq!(survey().encoded_len(), SURVEY.len());
    assert_eq!(ReportSurvey::decode(&SURVEY).unwrap(), survey());
}

#[test]
fn absent_fields_take_no_octets() {
    let least = ReportSurvey {
        depth: None,
        mark: None,
        photo: None,
        shape: Shape::Circle(0x0102),
        ..survey()
    };
    let octets = [
        b"\x01\x4C\x00\x07\xAC\x98\x3A",
        &SURVEY[19..60],
        b"\x00\x02\x01",
    ]
    .concat();
    assert_eq!(least.encode().unwrap(), octets);
    assert_eq!(least.encoded_len(), octets.len());
    assert_eq!(ReportSurvey::decode(&octets.into()).unwrap(), least);
}

#[test]
fn what_the_definition_does_not_name_is_kept() {
    for (at, octets) in [(3, b"\x05"), (4, b"\xFF"), (4, b"\x06"), (13, b"\xC8")] {
        let octets = with(at, octets);
        let message = ReportSurvey::decode(&octets).unwrap();
        assert_eq!(message.encode().unwrap(), octets);
    }
    assert_eq!(format!("{:?} {:?}", Mode(7), Mode(5)), "7 (Run) 5");
    let flags = survey().flags;
    assert_eq!(format!("{flags:?}"), r#"{"Side": 2, "Level": 10}"#);
}

#[test]
fn counts_and_lengths_may_be_at_their_limits() {
    let point = survey().points[0].clone();
    for (points, name, photo) in [(1, "a", 0), (3, "eight...", 300)] {
        let message = ReportSurvey {
            points: vec![point.clone(); points],
            name: name.into(),
            mark: Some(name.get(..4).unwrap_or_default().into()),
            photo: Some(FormattedBlob::new(2, vec![1; photo])),
            ..survey()
        };
        let octets = message.encode().unwrap();
        assert_eq!(octets.len(), message.encoded_len());
        assert_eq!(ReportSurvey::decode(&octets).unwrap(), message);
    }
}

#[test]
fn a_message_that_ends_early_is_refused_with_the_field_where_it_ends() {
    // The first and the last length at which a field is short, the place at which it is noticed,
    // and what is wanted there.
    let fields = [
        (0, 1, "", 0, 2),
        (2, 2, "", 2, 1),
        (3, 3, "Mode", 3, 1),
        (4, 4, "Flags", 4, 1),
        (5, 6, "Course", 5, 2),
        (7, 8, "Depth", 7, 2),
        (9, 12, "Mark", 9, 4),
        (13, 13, "Photo", 13, 1),
        (14, 15, "Photo", 14, 2),
        (16, 18, "Photo", 16, 3),
        (19, 19, "Name", 19, 1),
        (20, 23, "Name", 20, 4),
        (24, 47, "Samples", 24, 24),
        (48, 48, "Points", 48, 1),
        (49, 56, "Points", 49, 8),
        (57, 59, "Points[1].Height", 56, 4),
        (60, 60, "Shape", 60, 1),
        (61, 61, "Shape.Polygon", 61, 1),
        (62, 65, "Shape.Polygon", 62, 4),
    ];
    for (first, last, path, offset, wanted) in fields {
        for length in first..=last {
            let error = ReportSurvey::decode(&SURVEY.slice(..length)).unwrap_err();
            let left = length - offset;
            assert_eq!(error.kind(), DecodeErrorKind::Short { wanted, left });
            assert_eq!((&*error.path(), error.offset()), (path, offset), "{length}");
            assert_eq!(error.message(), Some("ReportSurvey"));
        }
    }
    assert_eq!(fields[fields.len() - 1].1 + 1, SURVEY.len());
}

#[test]
fn octets_that_no_message_has_are_refused_with_their_place() {
    let longer = [&SURVEY[..], b"\0\0"].concat();
    let cases = [
        (
            with(0, b"\x02\x4C"),
            "at octet 0: message code 4C02h, 4C01h expected",
        ),
        (
            with(2, b"\x1B"),
            "at octet 2: presence vector 0x1b sets undefined bits 0x18",
        ),
        (
            with(14, b"\x2D\x01"),
            "Photo at octet 14: count 301 is not in 0 to 300",
        ),
        (
            with(19, b"\0"),
            "Name at octet 19: count 0 is not in 1 to 8",
        ),
        (
            with(19, b"\x09"),
            "Name at octet 19: count 9 is not in 1 to 8",
        ),
        (
            with(48, b"\x04"),
            "Points at octet 48: count 4 is not in 1 to 3",
        ),
        (
            with(48, b"\x00"),
            "Points at octet 48: count 0 is not in 1 to 3",
        ),
        (
            with(55, b"\x02"),
            "Points[1].Height at octet 55: index 2 chooses no type",
        ),
        (
            with(60, b"\x02"),
            "Shape at octet 60: tag 2 chooses none of 2 alternatives",
        ),
        (
            with(60, b"\xFF"),
            "Shape at octet 60: tag 255 chooses none of 2 alternatives",
        ),
        (
            with(61, b"\x03"),
            "Shape.Polygon at octet 62: 6 octets wanted, 4 left",
        ),
        (
            with(61, b"\x01"),
            "at octet 64: 2 octets follow the message",
        ),
        (longer.into(), "at octet 66: 2 octets follow the message"),
    ];
    for (octets, sentence) in cases {
        let error = ReportSurvey::decode(&octets).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!("ReportSurvey (4C01h): {sentence}")
        );
    }
}

#[test]
fn a_message_outside_its_definition_is_not_encoded_and_leaves_no_octets() {
    let cases: [(fn(&mut ReportSurvey), _); 7] = [
        (
            |survey| survey.mark = Some("N1234".into()),
            "Mark at octet 9: count 5 is not in 0 to 4",
        ),
        (
            |survey| survey.photo = Some(FormattedBlob::new(0, vec![0; 301])),
            "Photo at octet 14: count 301 is not in 0 to 300",
        ),
        (
            |survey| survey.name = "".into(),
            "Name at octet 19: count 0 is not in 1 to 8",
        ),
        (
            |survey| survey.name = "nine.....".into(),
            "Name at octet 19: count 9 is not in 1 to 8",
        ),
        (
            |survey| survey.points.clear(),
            "Points at octet 48: count 0 is not in 1 to 3",
        ),
        (
            |survey| survey.points = vec![survey.points[0].clone(); 4],
            "Points at octet 48: count 4 is not in 1 to 3",
        ),
        (
            |survey| survey.shape = Shape::Polygon(vec![0; 256]),
            "Shape.Polygon at octet 61: count 256 is not in 0 to 255",
        ),
    ];
    for (change, sentence) in cases {
        let mut message = survey();
        change(&mut message);
        let sentence = format!("ReportSurvey (4C01h): {sentence}");
        assert_eq!(message.encode().unwrap_err().to_string(), sentence);
        let mut buffer = b"before".to_vec();
        let error = message.encode_into(&mut buffer).unwrap_err();
        assert_eq!(error.to_string(), sentence, "offsets count from the code");
        assert_eq!(buffer, b"before");
    }
    let mut buffer = b"before".to_vec();
    survey().encode_into(&mut buffer).unwrap();
    assert_eq!(buffer, [b"before", &SURVEY[..]].concat());
}

#[test]
fn an_error_of_encoding_says_what_is_wrong_and_where() {
    let mut buffer = vec![0; 3];
    let mut output = Writer::new(&mut buffer);
    output.fixed(1_u16);
    assert_eq!(output.offset(), 2);
    let error = output
        .list::<u8, u8>(&[1, 2], 0, 9, |element, output| {
            output.member("Name", |output| {
                output.text::<u8>(&Text::from_static("abc"), 0, 4 - u64::from(*element))
            })
        })
        .unwrap_err();
    let kind = EncodeErrorKind::Count {
        found: 3,
        min: 0,
        max: 2,
    };
    assert_eq!((error.kind(), error.offset()), (kind, 7));
    assert_eq!((&*error.path(), error.message()), ("[1].Name", None));
    assert_eq!(
        error.to_string(),
        "[1].Name at octet 7: count 3 is not in 0 to 2"
    );
}

#[test]
fn a_variant_without_alternatives_is_its_tag() {
    let octets = Bytes::from_static(b"\0\x01");
    let mut input = Reader::new(&octets);
    assert_eq!(input.tag::<u8>(0), Ok(0));
    assert_eq!((input.offset(), input.remaining()), (1, 1));
    assert_eq!(
        input.tag::<u8>(0).unwrap_err().to_string(),
        "at octet 1: tag 1, but a variant without alternatives has tag 0"
    );
}

#[test]
fn a_count_that_the_input_cannot_hold_allocates_nothing() {
    let octets = Bytes::from_static(b"\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF");
    let max = u64::MAX;
    let list = Reader::new(&octets).list::<u64, u64>(0, max, 8, Reader::fixed);
    let blob = Reader::new(&octets).blob::<u64>(0, max);
    for error in [list.unwrap_err(), blob.unwrap_err()] {
        let kind = DecodeErrorKind::Short {
            wanted: max,
            left: 0,
        };
        assert_eq!((error.kind(), error.offset()), (kind, 8));
    }
    let octets = Bytes::from_static(b"\xFF\xFF\xFF\xFF\0");
    let mut input = Reader::new(&octets);
    let error = input.list::<u32, u64>(0, max, 0, Reader::fixed);
    assert_eq!(error.unwrap_err().path(), "[0]");
}

#[test]
fn a_run_that_is_longer_than_its_named_fields_is_refused_all_the_same() {
    let octets = Bytes::from_static(b"\x01\x02\x03");
    let mut input = Reader::new(&octets);
    let error = input.run::<4>(&[("A", 1), ("B", 2)]).unwrap_err();
    assert_eq!(error.to_string(), "at octet 0: 3 octets wanted, 3 left");
    assert_eq!(input.run::<3>(&[]).unwrap(), b"\x01\x02\x03");
}

#[test]
fn text_and_octets_share_the_memory_of_their_message() {
    let octets = Bytes::copy_from_slice(&SURVEY);
    let message = ReportSurvey::decode(&octets).unwrap();
    for part in [&message.photo.unwrap().data, message.name.as_bytes()] {
        assert!(octets.as_ptr_range().contains(&part.as_ptr()));
    }
}

#[test]
fn fixed_text_loses_its_padding_and_nothing_else() {
    for (octets, text) in [
        (b"\0\0\0\0", &b""[..]),
        (b"a\0b\0", b"a\0b"),
        (b"\0\0\0b", b"\0\0\0b"),
        (b"a\0\0\0", b"a"),
        (b"abcd", b"abcd"),
    ] {
        let octets = Bytes::copy_from_slice(octets);
        let read = Reader::new(&octets).fixed_text(4).unwrap();
        assert_eq!(read.as_bytes(), text);
        let mut buffer = Vec::new();
        Writer::new(&mut buffer).fixed_text(&read, 4).unwrap();
        assert_eq!(buffer, octets);
    }
}

#[test]
fn arrays_of_arrays_are_their_elements_in_order() {
    let array = [[0x0102_u16, 0x0304, 0x0506], [0x0708, 0x090A, 0x0B0C]];
    let mut buffer = vec![0xEE];
    Writer::new(&mut buffer).fixed(array);
    assert_eq!(
        buffer,
        b"\xEE\x02\x01\x04\x03\x06\x05\x08\x07\x0A\x09\x0C\x0B"
    );
    let octets = Bytes::from(buffer);
    let mut input = Reader::new(&octets);
    assert_eq!(input.fixed::<u8>(), Ok(0xEE));
    assert_eq!(input.fixed(), Ok(array));
}

#[test]
fn a_short_message_reads_as_itself() {
    let message = SetMode { mode: Mode(7) };
    let octets = Bytes::from_static(b"\x02\x0C\x07");
    assert_eq!(message.encode().unwrap(), octets);
    assert_eq!(SetMode::decode(&octets), Ok(message));
    let error = SetMode::decode(&SURVEY).unwrap_err();
    assert_eq!(
        error.to_string(),
        "SetMode (0C02h): at octet 0: message code 4C01h, 0C02h expected"
    );
}
