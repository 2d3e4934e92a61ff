//! A bridge between a JAUS vehicle and ROS 2.
#![forbid(unsafe_code)]

pub mod bridge;
