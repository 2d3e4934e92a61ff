//! Tests of the configuration of a node.

use super::*;

#[test]
fn ids_that_name_nobody_or_everybody_are_refused() {
    for (subsystem, node) in [(0, 1), (65535, 1), (1, 0), (1, 255)] {
        let error = Config::new(subsystem, node).validate().unwrap_err();
        assert!(
            error
                .to_string()
                .contains("is out of range: choose from 1 to"),
            "{error}"
        );
    }
    assert_eq!(Config::new(65534, 254).validate(), Ok(()));
}

#[test]
fn sizes_that_no_packet_has_are_refused() {
    let with = |payload_limit, max_message| {
        let config = Config {
            payload_limit,
            max_message,
            ..Config::new(1, 1)
        };
        config.validate().map_err(|error| error.to_string())
    };
    assert!(with(63, 1000).unwrap_err().contains("64 to 4079"));
    assert!(with(4080, 70_000).unwrap_err().contains("64 to 4079"));
    assert!(with(1000, 999).unwrap_err().contains("from 1000"));
    assert!(with(1000, 16_777_217).unwrap_err().contains("16777216"));
    assert_eq!(with(4079, 16_777_216), Ok(()));
    assert!(with(64, 4_194_240).is_ok());
    assert_eq!(
        with(64, 4_194_241).unwrap_err(),
        "max_message 4194241 is out of range: choose from 64 to 4194240"
    );
}

#[cfg(feature = "serial")]
#[test]
fn what_no_line_can_have_is_refused_with_the_port() {
    let line = || SerialLine::new("/dev/ttyUSB0");
    let error = |lines: &[SerialLine]| validate_serial(lines).unwrap_err().to_string();
    assert_eq!(
        validate_serial(&[line(), SerialLine::new("/dev/ttyUSB1")]),
        Ok(())
    );
    assert!(
        error(&[SerialLine { baud: 0, ..line() }]).contains("serial line /dev/ttyUSB0: baud 0")
    );
    assert!(
        error(&[SerialLine {
            stop_bits: 3,
            ..line()
        }])
        .contains("choose from 1 to 2")
    );
    assert!(error(&[line(), line()]).contains("/dev/ttyUSB0 appears twice"));
}

#[cfg(feature = "serde")]
mod toml_files {
    use super::*;

    fn error(text: &str) -> String {
        toml::from_str::<Config>(text).unwrap_err().to_string()
    }

    #[test]
    fn a_file_may_do_without_udp_where_there_is_another_way() {
        let read = |streams: &str| -> Config {
            toml::from_str(&format!(
                "subsystem = 1\nnode = 1\ninterfaces = []\n{streams}"
            ))
            .unwrap()
        };
        let tcp = read("tcp = { connect = [\"10.0.0.7\"] }");
        assert!(!tcp.uses_udp(false) && read("").uses_udp(false));
        assert_eq!(tcp.validate(), Ok(()));
        #[cfg(feature = "serial")]
        {
            let serial = read("[[serial]]\ndevice = \"/dev/ttyUSB0\"");
            assert!(!serial.uses_udp(false));
            assert_eq!(serial.validate(), Ok(()));
        }
        let local = Config::loopback(1, 1).local(Address::Default);
        assert!(local.uses_udp(false) && !local.without_udp().uses_udp(false));
        let closed = read("tcp = { listen = \"0.0.0.0\", max_accepted = 0 }").validate();
        assert!(closed.unwrap_err().to_string().contains("choose 1 or more"));
    }

    #[test]
    fn a_file_sets_what_it_names_and_leaves_the_rest() {
        let config: Config = toml::from_str(
            r#"
            subsystem = 101
            node = 1
            interfaces = ["eth0", "10.0.3.2"]
            port = 0
            port_taken = "use-free"
            group = "239.255.0.9"
            peers = ["192.168.7.2"]
            [mailbox]
            messages = 10
            "#,
        )
        .unwrap();
        let expected = Config {
            mailbox: MailboxLimits {
                messages: 10,
                ..MailboxLimits::default()
            },
            ..Config::new(101, 1)
                .interfaces(["eth0", "10.0.3.2"])
                .port(0)
                .or_any_free_port()
                .group("239.255.0.9:3794".parse().unwrap())
                .peer("192.168.7.2:3794".parse().unwrap())
        };
        assert_eq!(config, expected);
    }

    #[test]
    fn the_words_for_interfaces_and_group_are_understood() {
        let config: Config = toml::from_str("interfaces = \"loopback\"\ngroup = \"off\"").unwrap();
        assert_eq!(
            (config.interfaces, config.group),
            (Interfaces::Loopback, Group::Off)
        );
        assert_eq!(
            toml::from_str::<Config>("interfaces = \"all\"").unwrap(),
            Config::default()
        );
    }

    #[test]
    fn a_file_says_what_peers_are_that_cannot_be_recognised() {
        let text = "[[profile]]\nid = \"7.255.255\"\nprofile = \"jaus++\"\n\
                    [[profile]]\nid = \"8.1.1\"\nprofile = \"iop\"";
        let config: Config = toml::from_str(text).unwrap();
        let endpoint = config.endpoint(0);
        let found = |id: &str| Assignment::find(&endpoint.profiles, id.parse().unwrap());
        assert_eq!(
            found("7.1.33"),
            Some(crate::peer::Implementation::JausPlusPlus)
        );
        assert_eq!(found("8.1.1"), Some(crate::peer::Implementation::Iop));
        assert_eq!(found("8.1.2"), None);
        let wrong = error("[[profile]]\nid = \"7.1.1\"\nprofile = \"jauspp\"");
        assert!(
            wrong.contains("line 3") && wrong.contains("\"jaus++\""),
            "{wrong}"
        );
    }

    #[test]
    fn versions_of_ip_and_broadcasts_are_chosen_by_words() {
        let text = "ip = \"both\"\ngroup6 = \"ff15::efff:1\"\nbroadcast = \"off\"\n\
                    peers = [\"[fe80::2%eth0]:9\"]";
        let config: Config = toml::from_str(text).unwrap();
        assert_eq!((config.ip, config.broadcast), (Ip::Both, Broadcasts::Off));
        assert_eq!(config.group6.to_string(), "[ff15::efff:1]:3794");
        assert_eq!(config.peers[0].to_string(), "[fe80::2%eth0]:9");
        assert!(error("ip = \"5\"").contains("expected one of `4`, `6`, `both`"));
        assert!(error("broadcast = \"yes\"").contains("`auto`, `on`, `off`"));
        assert!(error("group6 = \"239.255.0.1\"").contains("[ff12::efff:1]:3794"));
        assert!(error("peers = [\"fe80::2\"]").contains("[fe80::2%eth0]:3794"));
    }

    #[test]
    fn mistakes_in_a_file_are_named_with_their_place() {
        let unknown = error("subsystem = 1\nprot = 3794");
        assert!(
            unknown.contains("line 2") && unknown.contains("unknown field `prot`"),
            "{unknown}"
        );
        let range = error("ttl = 300");
        assert!(range.contains("line 1") && range.contains("300"), "{range}");
        let group = error("group = \"10.0.0.1\"");
        assert!(group.contains("224.0.0.0 to 239.255.255.255"), "{group}");
        let interfaces = error("interfaces = \"eth0\"");
        assert!(interfaces.contains("[\"eth0\"]"), "{interfaces}");
        let peer = error("peers = [\"nobody\"]");
        assert!(peer.contains("`nobody` is not a peer's address"), "{peer}");
    }

    #[test]
    fn what_is_written_is_read_back() {
        let config = Config::loopback(7, 3)
            .peer("10.0.0.2".parse().unwrap())
            .group(Group::Off);
        let text = serde_json::to_string(&config).unwrap();
        assert_eq!(serde_json::from_str::<Config>(&text).unwrap(), config);
    }

    #[cfg(feature = "serial")]
    #[test]
    fn a_line_needs_no_more_than_its_device() {
        let read =
            |text: &str| toml::from_str::<SerialLine>(text).map_err(|error| error.to_string());
        assert_eq!(read("device = \"COM3\"").unwrap(), SerialLine::new("COM3"));
        assert!(
            read("baud = 9600")
                .unwrap_err()
                .contains("missing field `device`")
        );
        let unknown = read("device = \"COM3\"\nparity = \"mark\"").unwrap_err();
        assert!(
            unknown.contains("expected one of `none`, `odd`, `even`"),
            "{unknown}"
        );
    }
}
