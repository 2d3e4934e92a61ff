//! Type hashes, compared with those that ROS 2 publishes.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use jaus_ros2::Interfaces;

/// Hashes in the code that rosidl generates for ROS 2 Jazzy, as public repositories have it; that of
/// `std_msgs/msg/String` is in the documentation of rmw_zenoh.
const PUBLISHED: &[(&str, &str)] = &[
    (
        "builtin_interfaces/msg/Duration",
        "e8d009f659816f758b75334ee1a9ca5b5c0b859843261f14c7f937349599d93b",
    ),
    (
        "builtin_interfaces/msg/Time",
        "b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197",
    ),
    (
        "std_msgs/msg/Bool",
        "feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9",
    ),
    (
        "std_msgs/msg/Empty",
        "20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312",
    ),
    (
        "std_msgs/msg/Header",
        "f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01",
    ),
    (
        "std_msgs/msg/String",
        "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    ),
    (
        "geometry_msgs/msg/Point",
        "6963084842a9b04494d6b2941d11444708d892da2f4b09843b9c43f42a7f6881",
    ),
    (
        "geometry_msgs/msg/Pose",
        "d501954e9476cea2996984e812054b68026ae0bfae789d9a10b23daf35cc90fa",
    ),
    (
        "geometry_msgs/msg/PoseStamped",
        "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    ),
    (
        "geometry_msgs/msg/PoseWithCovariance",
        "9a7c0fd234b7f45c6098745ecccd773ca1085670e64107135397aee31c02e1bb",
    ),
    (
        "geometry_msgs/msg/Quaternion",
        "8a765f66778c8ff7c8ab94afcc590a2ed5325a1d9a076ffff38fbce36f458684",
    ),
    (
        "geometry_msgs/msg/Transform",
        "beb83fbe698636351461f6f35d1abb20010c43d55374d81bd041f1ba2581fddc",
    ),
    (
        "geometry_msgs/msg/TransformStamped",
        "0a241f87d04668d94099cbb5ba11691d5ad32c2f29682e4eb5653424bd275206",
    ),
    (
        "geometry_msgs/msg/Twist",
        "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    ),
    (
        "geometry_msgs/msg/TwistStamped",
        "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    ),
    (
        "geometry_msgs/msg/TwistWithCovariance",
        "49f574f033f095d8b6cd1beaca5ca7925e296e84af1716d16c89d38b059c8c18",
    ),
    (
        "geometry_msgs/msg/Vector3",
        "cc12fe83e4c02719f1ce8070bfd14aecd40f75a96696a67a2a1f37f7dbb0765d",
    ),
    (
        "nav_msgs/msg/Odometry",
        "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    ),
    (
        "sensor_msgs/msg/BatteryState",
        "4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741",
    ),
    (
        "sensor_msgs/msg/Imu",
        "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b",
    ),
    (
        "sensor_msgs/msg/NavSatFix",
        "62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404",
    ),
    (
        "sensor_msgs/msg/NavSatStatus",
        "d1ed3befa628e09571bd273b888ba1c1fd187c9a5e0006b385d7e5e9095a3204",
    ),
    (
        "diagnostic_msgs/msg/DiagnosticArray",
        "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    ),
    (
        "diagnostic_msgs/msg/DiagnosticStatus",
        "b0e3e692ea2d54a8af2f4ef1930e81556a2db55216b771f8a7d2724ed47bf0e4",
    ),
    (
        "diagnostic_msgs/msg/KeyValue",
        "d68081eaa540288c5440753baecef0c4e16e81a5f78ad68902ded5100413bb42",
    ),
    (
        "tf2_msgs/msg/TFMessage",
        "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    ),
];

#[test]
fn every_bundled_type_has_the_hash_that_ros_publishes() {
    let interfaces = Interfaces::bundled().unwrap();
    let names: Vec<_> = interfaces.names().map(ToString::to_string).collect();
    assert_eq!(names.len(), PUBLISHED.len());
    for (name, hash) in PUBLISHED {
        let interface = interfaces.get(name).unwrap();
        assert_eq!(interface.hash(), format!("RIHS01_{hash}"), "{name}");
    }
}

#[test]
fn bounds_arrays_and_texts_are_part_of_the_hash_and_values_are_not() {
    let hash = |text: &str| {
        let mut interfaces = Interfaces::default();
        interfaces.add("a/msg/A", text).unwrap();
        interfaces.get("a/msg/A").unwrap().hash()
    };
    let texts = [
        "uint8 x",
        "byte x",
        "uint8 y",
        "uint8[] x",
        "uint8[2] x",
        "uint8[<=2] x",
        "uint8[3] x",
        "string x",
        "string<=3 x",
        "string<=4 x",
        "string<=3[] x",
        "",
    ];
    let mut hashes: Vec<_> = texts.map(hash).to_vec();
    hashes.sort();
    hashes.dedup();
    assert_eq!(hashes.len(), texts.len());
    assert_eq!(hash("uint8 x"), hash("# comment\nuint8 C=1\nchar x 7"));
}

/// `char` is not among them: rosbags gives it another hash than ROS.
#[test]
fn a_type_with_every_kind_of_field_has_the_hash_that_rosbags_computes() {
    let mut interfaces = Interfaces::bundled().unwrap();
    let every = "uint8 LIMIT=7\nbool[] a\nbyte[3] b\nuint8[<=4] c\nstring<=8 d\nstring<=9[] e\n\
        string[<=2] f\nstring<=3[5] g\nint64 h -3\ngeometry_msgs/Pose[<=6] i\n\
        nav_msgs/Odometry[2] j\nfloat32 k 1.5\n";
    for (name, text, hash) in [
        (
            "test_msgs/msg/Every",
            every,
            "b5f2f09403114841e73c395312fac193d6b8588561b4e13c07094bec1552b71a",
        ),
        (
            "test_msgs/msg/Nothing",
            "uint8 A=1\n",
            "a56c5ec7a81d58b3db0dd15b9da0f88790e3a63215d39def403ef908aa6c38e4",
        ),
    ] {
        interfaces.add(name, text).unwrap();
        let interface = interfaces.get(name).unwrap();
        assert_eq!(interface.hash(), format!("RIHS01_{hash}"), "{name}");
    }
}

#[test]
fn a_char_has_the_hash_of_a_uint8_as_ros_publishes_it() {
    let mut interfaces = Interfaces::default();
    interfaces.add("std_msgs/msg/Char", "char data").unwrap();
    let hash = interfaces.get("std_msgs/msg/Char").unwrap().hash();
    let published = "3ad2d04dd29ba19d04b16659afa3ccaedd691914b02a64e82e252f2fa6a586a9";
    assert_eq!(hash, format!("RIHS01_{published}"));
}
