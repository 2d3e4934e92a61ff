//! Messages whose type is known only at run time.

use jaus_codec::{AnyMessage, Bytes, MessageInfo, Registry, ServiceId, ServiceInfo, ServiceSet};

use crate::messages::{Mode, OldSetMode, QueryDepth, ReportSurvey, SURVEY, SetMode, survey};

const OLD: ServiceId = ServiceId {
    urn: "urn:example:Surveyor",
    major: 1,
    minor: 0,
};
const NEW: ServiceId = ServiceId { minor: 2, ..OLD };
const SONAR: ServiceId = ServiceId {
    urn: "urn:example:Sonar",
    ..NEW
};

const fn service(name: &'static str, id: ServiceId) -> ServiceInfo {
    ServiceInfo {
        name,
        id,
        inherits_from: None,
        inputs: &[],
        outputs: &[],
    }
}

static BASE: Registry = Registry::new(&[ServiceSet {
    services: &[service("Surveyor", OLD), service("Surveyor", NEW)],
    messages: &[
        MessageInfo::of::<SetMode>(&[NEW]),
        MessageInfo::of::<OldSetMode>(&[OLD]),
        MessageInfo::of::<ReportSurvey>(&[NEW, OLD]),
    ],
}]);

static ALL: Registry = Registry::extending(
    &BASE,
    &[ServiceSet {
        services: &[service("Sonar", SONAR)],
        messages: &[MessageInfo::of::<QueryDepth>(&[SONAR])],
    }],
);

fn shown<'a>(messages: impl Iterator<Item = &'a MessageInfo>) -> String {
    format!("{:?}", messages.collect::<Vec<_>>())
}

#[test]
fn a_registry_lists_its_own_types_before_those_that_it_extends() {
    let services: Vec<_> = ALL.services().map(|info| info.id.to_string()).collect();
    assert_eq!(
        services,
        [
            "urn:example:Sonar 1.2",
            "urn:example:Surveyor 1.0",
            "urn:example:Surveyor 1.2"
        ]
    );
    assert_eq!(
        shown(ALL.iter()),
        "[QueryDepth (2C03h), SetMode (0C02h), SetMode (0C02h), ReportSurvey (4C01h)]"
    );
    assert_eq!(BASE.iter().count(), 3);
}

#[test]
fn a_type_is_found_by_its_code_its_name_and_its_service() {
    for (code, types) in [
        (0x0C01, "[]"),
        (0x0C02, "[SetMode (0C02h), SetMode (0C02h)]"),
        (0x2C03, "[QueryDepth (2C03h)]"),
        (0x4C01, "[ReportSurvey (4C01h)]"),
        (0x4C02, "[]"),
    ] {
        assert_eq!(shown(ALL.by_code(code)), types);
    }
    assert_eq!(
        shown(ALL.by_name("SetMode")),
        "[SetMode (0C02h), SetMode (0C02h)]"
    );
    assert_eq!(shown(ALL.by_name("ReportSurvey")), "[ReportSurvey (4C01h)]");
    assert_eq!(ALL.in_service(OLD, 0x0C02).unwrap().services, [OLD]);
    assert_eq!(ALL.in_service(NEW, 0x0C02).unwrap().services, [NEW]);
    assert!(ALL.in_service(SONAR, 0x0C02).is_none());
    let [query, set] = [0x2C03, 0x0C02].map(|code| ALL.by_code(code).next().unwrap());
    assert!(!query.is_command && set.is_command);
}

#[test]
fn octets_are_read_as_the_newest_type_that_accepts_them() {
    let decode = |octets| ALL.decode(&Bytes::from_static(octets));
    let message = decode(b"\x02\x0C\x07").unwrap().unwrap();
    assert!(message.is::<SetMode>() && !message.is::<OldSetMode>());
    let message = decode(b"\x02\x0C\x07\x08").unwrap().unwrap();
    assert_eq!(message.downcast::<OldSetMode>().unwrap().modes, [7, 8]);
    assert_eq!(
        decode(b"\x02\x0C").unwrap().unwrap_err().to_string(),
        "SetMode (0C02h): Mode at octet 2: 1 octets wanted, 0 left"
    );
    assert!(decode(b"\x03\x0C\x07").is_none());
    assert!(decode(b"\x02").is_none());
}

#[test]
fn a_message_of_any_type_knows_what_it_is() {
    let survey = ALL.decode(&SURVEY).unwrap().unwrap();
    let mode: Box<dyn AnyMessage> = Box::new(SetMode { mode: Mode(7) });
    assert_eq!((survey.code(), survey.name()), (0x4C01, "ReportSurvey"));
    assert_eq!((mode.code(), mode.name()), (0x0C02, "SetMode"));
    assert!(!survey.is_command() && mode.is_command());
    assert_eq!(survey.encode().unwrap(), SURVEY);
    assert_eq!(&*survey.clone(), &*survey);
    assert_ne!(&*mode, &*survey);
    assert_ne!(&*mode, &SetMode { mode: Mode(0) } as &dyn AnyMessage);
    assert!(survey.downcast_ref::<SetMode>().is_none());
    let survey = survey.downcast::<SetMode>().unwrap_err();
    assert_eq!(survey.downcast::<ReportSurvey>().unwrap(), self::survey());
}

#[test]
#[cfg(all(feature = "arbitrary", feature = "serde"))]
fn a_registry_makes_messages_of_random_octets_and_of_views() {
    let octets: Vec<u8> = (0..=255).map(|octet: u8| octet.wrapping_mul(89)).collect();
    for info in ALL.iter() {
        let mut random = jaus_codec::arbitrary::Unstructured::new(&octets);
        let message = (info.arbitrary)(&mut random).unwrap();
        assert_eq!(message.code(), info.code);
        let octets = message.encode().unwrap();
        assert_eq!(&*(info.decode)(&octets).unwrap(), &*message);
        assert_eq!(&*(info.from_view)(&message.view()).unwrap(), &*message);
    }
}
