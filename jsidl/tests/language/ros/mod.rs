//! The ROS 2 package: its files by the rules of ROS, and its values beside its files.

mod definitions;
mod files;
mod interfaces;
mod names;
mod values;
