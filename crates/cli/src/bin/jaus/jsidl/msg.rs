//! `jaus jsidl msg`: writes messages as a ROS 2 package.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use jaus_cli::failure::Failure;
use jsidl::ros::{Package, PackageName};

use super::sources;

/// Write messages as a ROS 2 package of interface definitions (.msg)
///
/// Writes a directory with the name of the package: an interface definition per message and per type
/// inside a message, such as msg/MobilityReportGlobalPoseV1p0.msg, and package.xml and CMakeLists.txt
/// for `colcon build`. Units, ranges and descriptions are in comments. Writes nothing if a definition
/// has errors.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus jsidl msg -o ~/ros2_ws/src\n  \
    jaus jsidl msg my-services/ -o ~/ros2_ws/src --package my_robot_msgs\n\n\
    In the workspace:\n\n  \
    colcon build --packages-select jaus_msgs\n  \
    ros2 interface show jaus_msgs/msg/MobilityReportGlobalPoseV1p0\n\n\
    Exit status: 0 written; 1 not written, because a definition has errors; 2 not written.")]
pub(crate) struct Arguments {
    /// JSIDL files, and directories with `.xml`, `.csd` or `.cjsidl` files; without any, the built-in definitions
    #[arg(value_name = "PATH")]
    paths: Vec<PathBuf>,

    /// The directory to write to; the package is a directory in it
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// The name of the package
    #[arg(long, value_name = "NAME", default_value_t)]
    package: PackageName,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let generate = |library: &_, wanted: &dyn Fn(&_) -> bool| {
        Package::of(library, wanted, &arguments.package).files()
    };
    sources::generate(&arguments.paths, &arguments.output, generate)
}
