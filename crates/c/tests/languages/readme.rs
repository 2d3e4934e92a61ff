//! The README's sensor in each language but Rust, whose example has a test of its own.

use jaus::component::{Component, Kind};
use jaus::messages::mobility::{QueryVelocityState, velocity_state_sensor};
use jaus::node::{Config, Node};
use jaus_test_kit::waiting::within_limit;

use super::parts::{Language, missing};

#[tokio::test]
async fn the_readme_shows_the_examples_as_they_are_and_they_answer() {
    let readme = include_str!("../../../../README.md");
    let cpp = include_str!("../../examples/speedometer.cpp");
    let python = include_str!("../../../python/examples/speedometer.py");
    let missing = missing();
    for (language, example) in [(Language::Cpp, cpp), (Language::Python, python)] {
        let (_about, program) = example.split_once("\n\n").expect("a head");
        assert!(readme.contains(program), "not in README:\n{program}");
        if missing.contains(&language) {
            continue;
        }
        let _rover = language.start("speedometer", &[]);
        let node = Node::start(Config::loopback(42, 1)).unwrap();
        let operator = Component::builder(Kind::OperatorControlUnit, "Operator");
        let operator = operator.attach(&node, 1).unwrap();
        let rover = within_limit(operator.find(velocity_state_sensor::URN)).await;
        let rover = rover.unwrap();
        assert_eq!(rover.to_string(), "107.1.44");
        let report = within_limit(operator.query(rover, &QueryVelocityState::all())).await;
        let speed = report.unwrap().velocity_x_m_per_s().unwrap();
        assert!((speed - 1.5).abs() < 0.01, "{language:?}: {speed} m/s");
    }
}
