// The messages of urn:jaus:jss:mobility, written by `jaus jsidl cpp`.

#ifndef JAUS_MESSAGES_MOBILITY_HPP
#define JAUS_MESSAGES_MOBILITY_HPP

#include "codec.hpp"

namespace jaus::mobility {

namespace v1_1 {

namespace SetWrenchEffort_types {

/// PropulsiveLinearEffortX in percent: -100 to 100, carried in 2 octets.
struct PropulsiveLinearEffortX : codec::Scaled<PropulsiveLinearEffortX, std::uint16_t> {
    static constexpr codec::Range kRange{"PropulsiveLinearEffortX", -100.0, 100.0, "percent", codec::Rounding::nearest};
};

/// PropulsiveLinearEffortY in percent: -100 to 100, carried in 2 octets.
struct PropulsiveLinearEffortY : codec::Scaled<PropulsiveLinearEffortY, std::uint16_t> {
    static constexpr codec::Range kRange{"PropulsiveLinearEffortY", -100.0, 100.0, "percent", codec::Rounding::nearest};
};

/// PropulsiveLinearEffortZ in percent: -100 to 100, carried in 2 octets.
struct PropulsiveLinearEffortZ : codec::Scaled<PropulsiveLinearEffortZ, std::uint16_t> {
    static constexpr codec::Range kRange{"PropulsiveLinearEffortZ", -100.0, 100.0, "percent", codec::Rounding::nearest};
};

/// PropulsiveRotationalEffortX in percent: -100 to 100, carried in 2 octets.
struct PropulsiveRotationalEffortX : codec::Scaled<PropulsiveRotationalEffortX, std::uint16_t> {
    static constexpr codec::Range kRange{"PropulsiveRotationalEffortX", -100.0, 100.0, "percent", codec::Rounding::nearest};
};

/// PropulsiveRotationalEffortY in percent: -100 to 100, carried in 2 octets.
struct PropulsiveRotationalEffortY : codec::Scaled<PropulsiveRotationalEffortY, std::uint16_t> {
    static constexpr codec::Range kRange{"PropulsiveRotationalEffortY", -100.0, 100.0, "percent", codec::Rounding::nearest};
};

/// PropulsiveRotationalEffortZ in percent: -100 to 100, carried in 2 octets.
struct PropulsiveRotationalEffortZ : codec::Scaled<PropulsiveRotationalEffortZ, std::uint16_t> {
    static constexpr codec::Range kRange{"PropulsiveRotationalEffortZ", -100.0, 100.0, "percent", codec::Rounding::nearest};
};

/// ResistiveLinearEffortX in percent: 0 to 100, carried in 1 octets.
struct ResistiveLinearEffortX : codec::Scaled<ResistiveLinearEffortX, std::uint8_t> {
    static constexpr codec::Range kRange{"ResistiveLinearEffortX", 0.0, 100.0, "percent", codec::Rounding::nearest};
};

/// ResistiveLinearEffortY in percent: 0 to 100, carried in 1 octets.
struct ResistiveLinearEffortY : codec::Scaled<ResistiveLinearEffortY, std::uint8_t> {
    static constexpr codec::Range kRange{"ResistiveLinearEffortY", 0.0, 100.0, "percent", codec::Rounding::nearest};
};

/// ResistiveLinearEffortZ in percent: 0 to 100, carried in 1 octets.
struct ResistiveLinearEffortZ : codec::Scaled<ResistiveLinearEffortZ, std::uint8_t> {
    static constexpr codec::Range kRange{"ResistiveLinearEffortZ", 0.0, 100.0, "percent", codec::Rounding::nearest};
};

/// ResistiveRotationalEffortX in percent: 0 to 100, carried in 1 octets.
struct ResistiveRotationalEffortX : codec::Scaled<ResistiveRotationalEffortX, std::uint8_t> {
    static constexpr codec::Range kRange{"ResistiveRotationalEffortX", 0.0, 100.0, "percent", codec::Rounding::nearest};
};

/// ResistiveRotationalEffortY in percent: 0 to 100, carried in 1 octets.
struct ResistiveRotationalEffortY : codec::Scaled<ResistiveRotationalEffortY, std::uint8_t> {
    static constexpr codec::Range kRange{"ResistiveRotationalEffortY", 0.0, 100.0, "percent", codec::Rounding::nearest};
};

/// ResistiveRotationalEffortZ in percent: 0 to 100, carried in 1 octets.
struct ResistiveRotationalEffortZ : codec::Scaled<ResistiveRotationalEffortZ, std::uint8_t> {
    static constexpr codec::Range kRange{"ResistiveRotationalEffortZ", 0.0, 100.0, "percent", codec::Rounding::nearest};
};

} // namespace SetWrenchEffort_types

/// SetWrenchEffort (0405h), a command.
///
/// Drives open loop: pushes, turns and brakes with a share of what is possible. There is no answer.
///
/// Declared by urn:jaus:jss:mobility:PrimitiveDriver 1.1.
struct SetWrenchEffort {
    static constexpr std::uint16_t kCode = 0x0405;
    static constexpr const char* kName = "SetWrenchEffort";
    static constexpr bool kIsCommand = true;
    static constexpr std::array<const char*, 1> kServices{"urn:jaus:jss:mobility:PrimitiveDriver 1.1"};

    using PropulsiveLinearEffortX = SetWrenchEffort_types::PropulsiveLinearEffortX;
    using PropulsiveLinearEffortY = SetWrenchEffort_types::PropulsiveLinearEffortY;
    using PropulsiveLinearEffortZ = SetWrenchEffort_types::PropulsiveLinearEffortZ;
    using PropulsiveRotationalEffortX = SetWrenchEffort_types::PropulsiveRotationalEffortX;
    using PropulsiveRotationalEffortY = SetWrenchEffort_types::PropulsiveRotationalEffortY;
    using PropulsiveRotationalEffortZ = SetWrenchEffort_types::PropulsiveRotationalEffortZ;
    using ResistiveLinearEffortX = SetWrenchEffort_types::ResistiveLinearEffortX;
    using ResistiveLinearEffortY = SetWrenchEffort_types::ResistiveLinearEffortY;
    using ResistiveLinearEffortZ = SetWrenchEffort_types::ResistiveLinearEffortZ;
    using ResistiveRotationalEffortX = SetWrenchEffort_types::ResistiveRotationalEffortX;
    using ResistiveRotationalEffortY = SetWrenchEffort_types::ResistiveRotationalEffortY;
    using ResistiveRotationalEffortZ = SetWrenchEffort_types::ResistiveRotationalEffortZ;

    /// PropulsiveLinearEffortX: percent, -100 to 100, bit 0 of the presence vector.
    ///
    /// Push along the forward axis, percent of the most that is possible.
    std::optional<PropulsiveLinearEffortX> propulsive_linear_effort_x{};

    /// PropulsiveLinearEffortY: percent, -100 to 100, bit 1 of the presence vector.
    ///
    /// Push along the axis to the right, percent of the most that is possible.
    std::optional<PropulsiveLinearEffortY> propulsive_linear_effort_y{};

    /// PropulsiveLinearEffortZ: percent, -100 to 100, bit 2 of the presence vector.
    ///
    /// Push along the axis that points down, percent of the most that is possible.
    std::optional<PropulsiveLinearEffortZ> propulsive_linear_effort_z{};

    /// PropulsiveRotationalEffortX: percent, -100 to 100, bit 3 of the presence vector.
    ///
    /// Turn about the forward axis, percent of the most that is possible.
    std::optional<PropulsiveRotationalEffortX> propulsive_rotational_effort_x{};

    /// PropulsiveRotationalEffortY: percent, -100 to 100, bit 4 of the presence vector.
    ///
    /// Turn about the axis to the right, percent of the most that is possible.
    std::optional<PropulsiveRotationalEffortY> propulsive_rotational_effort_y{};

    /// PropulsiveRotationalEffortZ: percent, -100 to 100, bit 5 of the presence vector.
    ///
    /// Turn about the axis that points down, percent of the most that is possible.
    std::optional<PropulsiveRotationalEffortZ> propulsive_rotational_effort_z{};

    /// ResistiveLinearEffortX: percent, 0 to 100, bit 6 of the presence vector.
    ///
    /// Brake along the forward axis, percent of the most that is possible.
    std::optional<ResistiveLinearEffortX> resistive_linear_effort_x{};

    /// ResistiveLinearEffortY: percent, 0 to 100, bit 7 of the presence vector.
    ///
    /// Brake along the axis to the right, percent of the most that is possible.
    std::optional<ResistiveLinearEffortY> resistive_linear_effort_y{};

    /// ResistiveLinearEffortZ: percent, 0 to 100, bit 8 of the presence vector.
    ///
    /// Brake along the axis that points down, percent of the most that is possible.
    std::optional<ResistiveLinearEffortZ> resistive_linear_effort_z{};

    /// ResistiveRotationalEffortX: percent, 0 to 100, bit 9 of the presence vector.
    ///
    /// Brake against turning about the forward axis, percent of the most that is possible.
    std::optional<ResistiveRotationalEffortX> resistive_rotational_effort_x{};

    /// ResistiveRotationalEffortY: percent, 0 to 100, bit 10 of the presence vector.
    ///
    /// Brake against turning about the axis to the right, percent of the most that is possible.
    std::optional<ResistiveRotationalEffortY> resistive_rotational_effort_y{};

    /// ResistiveRotationalEffortZ: percent, 0 to 100, bit 11 of the presence vector.
    ///
    /// Brake against turning about the axis that points down, percent of the most that is possible.
    std::optional<ResistiveRotationalEffortZ> resistive_rotational_effort_z{};

    /// PropulsiveLinearEffortX in percent.
    std::optional<double> propulsive_linear_effort_x_percent() const { return codec::in_units(this->propulsive_linear_effort_x); }
    codec::Checked set_propulsive_linear_effort_x_percent(double value) { return codec::assign(this->propulsive_linear_effort_x, PropulsiveLinearEffortX::of(value)); }

    /// PropulsiveLinearEffortY in percent.
    std::optional<double> propulsive_linear_effort_y_percent() const { return codec::in_units(this->propulsive_linear_effort_y); }
    codec::Checked set_propulsive_linear_effort_y_percent(double value) { return codec::assign(this->propulsive_linear_effort_y, PropulsiveLinearEffortY::of(value)); }

    /// PropulsiveLinearEffortZ in percent.
    std::optional<double> propulsive_linear_effort_z_percent() const { return codec::in_units(this->propulsive_linear_effort_z); }
    codec::Checked set_propulsive_linear_effort_z_percent(double value) { return codec::assign(this->propulsive_linear_effort_z, PropulsiveLinearEffortZ::of(value)); }

    /// PropulsiveRotationalEffortX in percent.
    std::optional<double> propulsive_rotational_effort_x_percent() const { return codec::in_units(this->propulsive_rotational_effort_x); }
    codec::Checked set_propulsive_rotational_effort_x_percent(double value) { return codec::assign(this->propulsive_rotational_effort_x, PropulsiveRotationalEffortX::of(value)); }

    /// PropulsiveRotationalEffortY in percent.
    std::optional<double> propulsive_rotational_effort_y_percent() const { return codec::in_units(this->propulsive_rotational_effort_y); }
    codec::Checked set_propulsive_rotational_effort_y_percent(double value) { return codec::assign(this->propulsive_rotational_effort_y, PropulsiveRotationalEffortY::of(value)); }

    /// PropulsiveRotationalEffortZ in percent.
    std::optional<double> propulsive_rotational_effort_z_percent() const { return codec::in_units(this->propulsive_rotational_effort_z); }
    codec::Checked set_propulsive_rotational_effort_z_percent(double value) { return codec::assign(this->propulsive_rotational_effort_z, PropulsiveRotationalEffortZ::of(value)); }

    /// ResistiveLinearEffortX in percent.
    std::optional<double> resistive_linear_effort_x_percent() const { return codec::in_units(this->resistive_linear_effort_x); }
    codec::Checked set_resistive_linear_effort_x_percent(double value) { return codec::assign(this->resistive_linear_effort_x, ResistiveLinearEffortX::of(value)); }

    /// ResistiveLinearEffortY in percent.
    std::optional<double> resistive_linear_effort_y_percent() const { return codec::in_units(this->resistive_linear_effort_y); }
    codec::Checked set_resistive_linear_effort_y_percent(double value) { return codec::assign(this->resistive_linear_effort_y, ResistiveLinearEffortY::of(value)); }

    /// ResistiveLinearEffortZ in percent.
    std::optional<double> resistive_linear_effort_z_percent() const { return codec::in_units(this->resistive_linear_effort_z); }
    codec::Checked set_resistive_linear_effort_z_percent(double value) { return codec::assign(this->resistive_linear_effort_z, ResistiveLinearEffortZ::of(value)); }

    /// ResistiveRotationalEffortX in percent.
    std::optional<double> resistive_rotational_effort_x_percent() const { return codec::in_units(this->resistive_rotational_effort_x); }
    codec::Checked set_resistive_rotational_effort_x_percent(double value) { return codec::assign(this->resistive_rotational_effort_x, ResistiveRotationalEffortX::of(value)); }

    /// ResistiveRotationalEffortY in percent.
    std::optional<double> resistive_rotational_effort_y_percent() const { return codec::in_units(this->resistive_rotational_effort_y); }
    codec::Checked set_resistive_rotational_effort_y_percent(double value) { return codec::assign(this->resistive_rotational_effort_y, ResistiveRotationalEffortY::of(value)); }

    /// ResistiveRotationalEffortZ in percent.
    std::optional<double> resistive_rotational_effort_z_percent() const { return codec::in_units(this->resistive_rotational_effort_z); }
    codec::Checked set_resistive_rotational_effort_z_percent(double value) { return codec::assign(this->resistive_rotational_effort_z, ResistiveRotationalEffortZ::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint16_t{}, self.propulsive_linear_effort_x, self.propulsive_linear_effort_y, self.propulsive_linear_effort_z, self.propulsive_rotational_effort_x, self.propulsive_rotational_effort_y, self.propulsive_rotational_effort_z, self.resistive_linear_effort_x, self.resistive_linear_effort_y, self.resistive_linear_effort_z, self.resistive_rotational_effort_x, self.resistive_rotational_effort_y, self.resistive_rotational_effort_z)
            && visitor("PropulsiveLinearEffortX", self.propulsive_linear_effort_x)
            && visitor("PropulsiveLinearEffortY", self.propulsive_linear_effort_y)
            && visitor("PropulsiveLinearEffortZ", self.propulsive_linear_effort_z)
            && visitor("PropulsiveRotationalEffortX", self.propulsive_rotational_effort_x)
            && visitor("PropulsiveRotationalEffortY", self.propulsive_rotational_effort_y)
            && visitor("PropulsiveRotationalEffortZ", self.propulsive_rotational_effort_z)
            && visitor("ResistiveLinearEffortX", self.resistive_linear_effort_x)
            && visitor("ResistiveLinearEffortY", self.resistive_linear_effort_y)
            && visitor("ResistiveLinearEffortZ", self.resistive_linear_effort_z)
            && visitor("ResistiveRotationalEffortX", self.resistive_rotational_effort_x)
            && visitor("ResistiveRotationalEffortY", self.resistive_rotational_effort_y)
            && visitor("ResistiveRotationalEffortZ", self.resistive_rotational_effort_z);
    }
};

/// QueryVelocityState (2404h).
///
/// Asks for velocity and turn rates. Deprecated since 1.1 in favour of Query Velocity State Ext.
///
/// Declared by urn:jaus:jss:mobility:VelocityStateSensor 1.1.
struct QueryVelocityState {
    static constexpr std::uint16_t kCode = 0x2404;
    static constexpr const char* kName = "QueryVelocityState";
    static constexpr bool kIsCommand = false;
    static constexpr std::array<const char*, 1> kServices{"urn:jaus:jss:mobility:VelocityStateSensor 1.1"};

    /// PresenceVector.
    ///
    /// Wanted fields of Report Velocity State; bit 0 is the first that is optional.
    std::uint16_t presence_vector{};

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor("PresenceVector", self.presence_vector);
    }
};

/// QueryWrenchEffort (2405h).
///
/// Asks for the effort that was commanded.
///
/// Declared by urn:jaus:jss:mobility:PrimitiveDriver 1.1.
struct QueryWrenchEffort {
    static constexpr std::uint16_t kCode = 0x2405;
    static constexpr const char* kName = "QueryWrenchEffort";
    static constexpr bool kIsCommand = false;
    static constexpr std::array<const char*, 1> kServices{"urn:jaus:jss:mobility:PrimitiveDriver 1.1"};

    /// PresenceVector.
    ///
    /// Wanted fields of Report Wrench Effort; bit 0 is the first that is optional.
    std::uint16_t presence_vector{};

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor("PresenceVector", self.presence_vector);
    }
};

/// QueryNavigation (2421h).
///
/// Asks for pose, velocity and acceleration in one report.
///
/// Declared by urn:jaus:jss:mobility:NavigationState 1.1.
struct QueryNavigation {
    static constexpr std::uint16_t kCode = 0x2421;
    static constexpr const char* kName = "QueryNavigation";
    static constexpr bool kIsCommand = false;
    static constexpr std::array<const char*, 1> kServices{"urn:jaus:jss:mobility:NavigationState 1.1"};

    /// GlobalPosePresenceVector.
    ///
    /// Wanted fields of the global pose; bit 0 is the first.
    std::uint16_t global_pose_presence_vector{};

    /// LocalPosePresenceVector.
    ///
    /// Wanted fields of the local pose; bit 0 is the first.
    std::uint16_t local_pose_presence_vector{};

    /// VelocityStatePresenceVector.
    ///
    /// Wanted fields of the velocity; bit 0 is the first.
    std::uint16_t velocity_state_presence_vector{};

    /// AccelerationStatePresenceVector.
    ///
    /// Wanted fields of the acceleration; bit 0 is the first.
    std::uint16_t acceleration_state_presence_vector{};

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor("GlobalPosePresenceVector", self.global_pose_presence_vector)
            && visitor("LocalPosePresenceVector", self.local_pose_presence_vector)
            && visitor("VelocityStatePresenceVector", self.velocity_state_presence_vector)
            && visitor("AccelerationStatePresenceVector", self.acceleration_state_presence_vector);
    }
};

/// QueryVelocityStateExt (24A4h).
///
/// Asks for velocity and turn rates in a chosen frame, with speeds and POSIX time.
///
/// Declared by urn:jaus:jss:mobility:VelocityStateSensor 1.1.
struct QueryVelocityStateExt {
    static constexpr std::uint16_t kCode = 0x24A4;
    static constexpr const char* kName = "QueryVelocityStateExt";
    static constexpr bool kIsCommand = false;
    static constexpr std::array<const char*, 1> kServices{"urn:jaus:jss:mobility:VelocityStateSensor 1.1"};

    /// VelocityVarPresenceVector.
    ///
    /// Wanted velocity components; bit 0 is the first.
    std::uint8_t velocity_var_presence_vector{};

    /// ReportVelocityStateExtRecPresenceVector.
    ///
    /// Wanted fields of the record that follows the velocity components; bit 0 is the first.
    std::uint16_t report_velocity_state_ext_rec_presence_vector{};

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor("VelocityVarPresenceVector", self.velocity_var_presence_vector)
            && visitor("ReportVelocityStateExtRecPresenceVector", self.report_velocity_state_ext_rec_presence_vector);
    }
};

namespace ReportVelocityState_types {

/// Velocity_X in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityX : codec::Scaled<VelocityX, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_X", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// Velocity_Y in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityY : codec::Scaled<VelocityY, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_Y", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// Velocity_Z in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityZ : codec::Scaled<VelocityZ, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_Z", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// Velocity_RMS in meter per second: 0 to 100, carried in 4 octets.
struct VelocityRms : codec::Scaled<VelocityRms, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_RMS", 0.0, 100.0, "meter per second", codec::Rounding::nearest};
};

/// RollRate in radian per second: -32.768 to 32.767, carried in 2 octets.
struct RollRate : codec::Scaled<RollRate, std::uint16_t> {
    static constexpr codec::Range kRange{"RollRate", -32.768, 32.767, "radian per second", codec::Rounding::nearest};
};

/// PitchRate in radian per second: -32.768 to 32.767, carried in 2 octets.
struct PitchRate : codec::Scaled<PitchRate, std::uint16_t> {
    static constexpr codec::Range kRange{"PitchRate", -32.768, 32.767, "radian per second", codec::Rounding::nearest};
};

/// YawRate in radian per second: -32.768 to 32.767, carried in 2 octets.
struct YawRate : codec::Scaled<YawRate, std::uint16_t> {
    static constexpr codec::Range kRange{"YawRate", -32.768, 32.767, "radian per second", codec::Rounding::nearest};
};

/// Rate_RMS in radian per second: 0 to 3.141592653589793, carried in 2 octets.
struct RateRms : codec::Scaled<RateRms, std::uint16_t> {
    static constexpr codec::Range kRange{"Rate_RMS", 0.0, 3.141592653589793, "radian per second", codec::Rounding::nearest};
};

/// TimeStamp: several numbers in one integer of 4 octets. Other bits are preserved.
///
/// UTC time of day with the day of the month.
struct TimeStamp : codec::Bits<TimeStamp, std::uint32_t> {
    static constexpr std::array<codec::Part, 5> kParts{{{"Milliseconds", 0, 9, 0u, 999u}, {"Seconds", 10, 15, 0u, 59u}, {"Minutes", 16, 21, 0u, 59u}, {"Hour", 22, 26, 0u, 23u}, {"Day", 27, 31, 1u, 31u}}};

    /// Milliseconds: bits 0 to 9, 0 to 999.
    std::uint16_t milliseconds() const { return get_bits<std::uint16_t>(kParts[0]); }
    codec::Checked set_milliseconds(std::uint16_t value) { return set_bits(kParts[0], static_cast<std::uint64_t>(value)); }

    /// Seconds: bits 10 to 15, 0 to 59.
    std::uint8_t seconds() const { return get_bits<std::uint8_t>(kParts[1]); }
    codec::Checked set_seconds(std::uint8_t value) { return set_bits(kParts[1], static_cast<std::uint64_t>(value)); }

    /// Minutes: bits 16 to 21, 0 to 59.
    std::uint8_t minutes() const { return get_bits<std::uint8_t>(kParts[2]); }
    codec::Checked set_minutes(std::uint8_t value) { return set_bits(kParts[2], static_cast<std::uint64_t>(value)); }

    /// Hour: bits 22 to 26, 0 to 23.
    std::uint8_t hour() const { return get_bits<std::uint8_t>(kParts[3]); }
    codec::Checked set_hour(std::uint8_t value) { return set_bits(kParts[3], static_cast<std::uint64_t>(value)); }

    /// Day: bits 27 to 31, 1 to 31.
    ///
    /// Day of the month.
    std::uint8_t day() const { return get_bits<std::uint8_t>(kParts[4]); }
    codec::Checked set_day(std::uint8_t value) { return set_bits(kParts[4], static_cast<std::uint64_t>(value)); }
};

} // namespace ReportVelocityState_types

/// ReportVelocityState (4404h).
///
/// Tells velocity and turn rates. Deprecated since 1.1 in favour of Report Velocity State Ext.
///
/// Declared by urn:jaus:jss:mobility:VelocityStateSensor 1.1.
struct ReportVelocityState {
    static constexpr std::uint16_t kCode = 0x4404;
    static constexpr const char* kName = "ReportVelocityState";
    static constexpr bool kIsCommand = false;
    static constexpr std::array<const char*, 1> kServices{"urn:jaus:jss:mobility:VelocityStateSensor 1.1"};

    using VelocityX = ReportVelocityState_types::VelocityX;
    using VelocityY = ReportVelocityState_types::VelocityY;
    using VelocityZ = ReportVelocityState_types::VelocityZ;
    using VelocityRms = ReportVelocityState_types::VelocityRms;
    using RollRate = ReportVelocityState_types::RollRate;
    using PitchRate = ReportVelocityState_types::PitchRate;
    using YawRate = ReportVelocityState_types::YawRate;
    using RateRms = ReportVelocityState_types::RateRms;
    using TimeStamp = ReportVelocityState_types::TimeStamp;

    /// Velocity_X: meter per second, -327.68 to 327.67, bit 0 of the presence vector.
    ///
    /// Forward, or along the X axis of the chosen frame.
    std::optional<VelocityX> velocity_x{};

    /// Velocity_Y: meter per second, -327.68 to 327.67, bit 1 of the presence vector.
    ///
    /// To the right, or along the Y axis of the chosen frame.
    std::optional<VelocityY> velocity_y{};

    /// Velocity_Z: meter per second, -327.68 to 327.67, bit 2 of the presence vector.
    ///
    /// Downward, or along the Z axis of the chosen frame.
    std::optional<VelocityZ> velocity_z{};

    /// Velocity_RMS: meter per second, 0 to 100, bit 3 of the presence vector.
    ///
    /// Standard error of the velocity.
    std::optional<VelocityRms> velocity_rms{};

    /// RollRate: radian per second, -32.768 to 32.767, bit 4 of the presence vector.
    ///
    /// Turn rate about the forward axis.
    std::optional<RollRate> roll_rate{};

    /// PitchRate: radian per second, -32.768 to 32.767, bit 5 of the presence vector.
    ///
    /// Turn rate about the axis to the right.
    std::optional<PitchRate> pitch_rate{};

    /// YawRate: radian per second, -32.768 to 32.767, bit 6 of the presence vector.
    ///
    /// Turn rate about the axis that points down.
    std::optional<YawRate> yaw_rate{};

    /// Rate_RMS: radian per second, 0 to 3.141592653589793, bit 7 of the presence vector.
    ///
    /// Standard error of the turn rates.
    std::optional<RateRms> rate_rms{};

    /// TimeStamp: bit 8 of the presence vector.
    ///
    /// UTC time of day with the day of the month.
    std::optional<TimeStamp> time_stamp{};

    /// Velocity_X in meter per second.
    std::optional<double> velocity_x_m_per_s() const { return codec::in_units(this->velocity_x); }
    codec::Checked set_velocity_x_m_per_s(double value) { return codec::assign(this->velocity_x, VelocityX::of(value)); }

    /// Velocity_Y in meter per second.
    std::optional<double> velocity_y_m_per_s() const { return codec::in_units(this->velocity_y); }
    codec::Checked set_velocity_y_m_per_s(double value) { return codec::assign(this->velocity_y, VelocityY::of(value)); }

    /// Velocity_Z in meter per second.
    std::optional<double> velocity_z_m_per_s() const { return codec::in_units(this->velocity_z); }
    codec::Checked set_velocity_z_m_per_s(double value) { return codec::assign(this->velocity_z, VelocityZ::of(value)); }

    /// Velocity_RMS in meter per second.
    std::optional<double> velocity_rms_m_per_s() const { return codec::in_units(this->velocity_rms); }
    codec::Checked set_velocity_rms_m_per_s(double value) { return codec::assign(this->velocity_rms, VelocityRms::of(value)); }

    /// RollRate in radian per second.
    std::optional<double> roll_rate_rad_per_s() const { return codec::in_units(this->roll_rate); }
    codec::Checked set_roll_rate_rad_per_s(double value) { return codec::assign(this->roll_rate, RollRate::of(value)); }

    /// PitchRate in radian per second.
    std::optional<double> pitch_rate_rad_per_s() const { return codec::in_units(this->pitch_rate); }
    codec::Checked set_pitch_rate_rad_per_s(double value) { return codec::assign(this->pitch_rate, PitchRate::of(value)); }

    /// YawRate in radian per second.
    std::optional<double> yaw_rate_rad_per_s() const { return codec::in_units(this->yaw_rate); }
    codec::Checked set_yaw_rate_rad_per_s(double value) { return codec::assign(this->yaw_rate, YawRate::of(value)); }

    /// Rate_RMS in radian per second.
    std::optional<double> rate_rms_rad_per_s() const { return codec::in_units(this->rate_rms); }
    codec::Checked set_rate_rms_rad_per_s(double value) { return codec::assign(this->rate_rms, RateRms::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint16_t{}, self.velocity_x, self.velocity_y, self.velocity_z, self.velocity_rms, self.roll_rate, self.pitch_rate, self.yaw_rate, self.rate_rms, self.time_stamp)
            && visitor("Velocity_X", self.velocity_x)
            && visitor("Velocity_Y", self.velocity_y)
            && visitor("Velocity_Z", self.velocity_z)
            && visitor("Velocity_RMS", self.velocity_rms)
            && visitor("RollRate", self.roll_rate)
            && visitor("PitchRate", self.pitch_rate)
            && visitor("YawRate", self.yaw_rate)
            && visitor("Rate_RMS", self.rate_rms)
            && visitor("TimeStamp", self.time_stamp);
    }
};

namespace ReportWrenchEffort_types {

/// PropulsiveLinearEffortX in percent: -100 to 100, carried in 2 octets.
struct PropulsiveLinearEffortX : codec::Scaled<PropulsiveLinearEffortX, std::uint16_t> {
    static constexpr codec::Range kRange{"PropulsiveLinearEffortX", -100.0, 100.0, "percent", codec::Rounding::nearest};
};

/// PropulsiveLinearEffortY in percent: -100 to 100, carried in 2 octets.
struct PropulsiveLinearEffortY : codec::Scaled<PropulsiveLinearEffortY, std::uint16_t> {
    static constexpr codec::Range kRange{"PropulsiveLinearEffortY", -100.0, 100.0, "percent", codec::Rounding::nearest};
};

/// PropulsiveLinearEffortZ in percent: -100 to 100, carried in 2 octets.
struct PropulsiveLinearEffortZ : codec::Scaled<PropulsiveLinearEffortZ, std::uint16_t> {
    static constexpr codec::Range kRange{"PropulsiveLinearEffortZ", -100.0, 100.0, "percent", codec::Rounding::nearest};
};

/// PropulsiveRotationalEffortX in percent: -100 to 100, carried in 2 octets.
struct PropulsiveRotationalEffortX : codec::Scaled<PropulsiveRotationalEffortX, std::uint16_t> {
    static constexpr codec::Range kRange{"PropulsiveRotationalEffortX", -100.0, 100.0, "percent", codec::Rounding::nearest};
};

/// PropulsiveRotationalEffortY in percent: -100 to 100, carried in 2 octets.
struct PropulsiveRotationalEffortY : codec::Scaled<PropulsiveRotationalEffortY, std::uint16_t> {
    static constexpr codec::Range kRange{"PropulsiveRotationalEffortY", -100.0, 100.0, "percent", codec::Rounding::nearest};
};

/// PropulsiveRotationalEffortZ in percent: -100 to 100, carried in 2 octets.
struct PropulsiveRotationalEffortZ : codec::Scaled<PropulsiveRotationalEffortZ, std::uint16_t> {
    static constexpr codec::Range kRange{"PropulsiveRotationalEffortZ", -100.0, 100.0, "percent", codec::Rounding::nearest};
};

/// ResistiveLinearEffortX in percent: 0 to 100, carried in 1 octets.
struct ResistiveLinearEffortX : codec::Scaled<ResistiveLinearEffortX, std::uint8_t> {
    static constexpr codec::Range kRange{"ResistiveLinearEffortX", 0.0, 100.0, "percent", codec::Rounding::nearest};
};

/// ResistiveLinearEffortY in percent: 0 to 100, carried in 1 octets.
struct ResistiveLinearEffortY : codec::Scaled<ResistiveLinearEffortY, std::uint8_t> {
    static constexpr codec::Range kRange{"ResistiveLinearEffortY", 0.0, 100.0, "percent", codec::Rounding::nearest};
};

/// ResistiveLinearEffortZ in percent: 0 to 100, carried in 1 octets.
struct ResistiveLinearEffortZ : codec::Scaled<ResistiveLinearEffortZ, std::uint8_t> {
    static constexpr codec::Range kRange{"ResistiveLinearEffortZ", 0.0, 100.0, "percent", codec::Rounding::nearest};
};

/// ResistiveRotationalEffortX in percent: 0 to 100, carried in 1 octets.
struct ResistiveRotationalEffortX : codec::Scaled<ResistiveRotationalEffortX, std::uint8_t> {
    static constexpr codec::Range kRange{"ResistiveRotationalEffortX", 0.0, 100.0, "percent", codec::Rounding::nearest};
};

/// ResistiveRotationalEffortY in percent: 0 to 100, carried in 1 octets.
struct ResistiveRotationalEffortY : codec::Scaled<ResistiveRotationalEffortY, std::uint8_t> {
    static constexpr codec::Range kRange{"ResistiveRotationalEffortY", 0.0, 100.0, "percent", codec::Rounding::nearest};
};

/// ResistiveRotationalEffortZ in percent: 0 to 100, carried in 1 octets.
struct ResistiveRotationalEffortZ : codec::Scaled<ResistiveRotationalEffortZ, std::uint8_t> {
    static constexpr codec::Range kRange{"ResistiveRotationalEffortZ", 0.0, 100.0, "percent", codec::Rounding::nearest};
};

} // namespace ReportWrenchEffort_types

/// ReportWrenchEffort (4405h).
///
/// Tells the effort that was commanded.
///
/// Declared by urn:jaus:jss:mobility:PrimitiveDriver 1.1.
struct ReportWrenchEffort {
    static constexpr std::uint16_t kCode = 0x4405;
    static constexpr const char* kName = "ReportWrenchEffort";
    static constexpr bool kIsCommand = false;
    static constexpr std::array<const char*, 1> kServices{"urn:jaus:jss:mobility:PrimitiveDriver 1.1"};

    using PropulsiveLinearEffortX = ReportWrenchEffort_types::PropulsiveLinearEffortX;
    using PropulsiveLinearEffortY = ReportWrenchEffort_types::PropulsiveLinearEffortY;
    using PropulsiveLinearEffortZ = ReportWrenchEffort_types::PropulsiveLinearEffortZ;
    using PropulsiveRotationalEffortX = ReportWrenchEffort_types::PropulsiveRotationalEffortX;
    using PropulsiveRotationalEffortY = ReportWrenchEffort_types::PropulsiveRotationalEffortY;
    using PropulsiveRotationalEffortZ = ReportWrenchEffort_types::PropulsiveRotationalEffortZ;
    using ResistiveLinearEffortX = ReportWrenchEffort_types::ResistiveLinearEffortX;
    using ResistiveLinearEffortY = ReportWrenchEffort_types::ResistiveLinearEffortY;
    using ResistiveLinearEffortZ = ReportWrenchEffort_types::ResistiveLinearEffortZ;
    using ResistiveRotationalEffortX = ReportWrenchEffort_types::ResistiveRotationalEffortX;
    using ResistiveRotationalEffortY = ReportWrenchEffort_types::ResistiveRotationalEffortY;
    using ResistiveRotationalEffortZ = ReportWrenchEffort_types::ResistiveRotationalEffortZ;

    /// PropulsiveLinearEffortX: percent, -100 to 100, bit 0 of the presence vector.
    ///
    /// Push along the forward axis, percent of the most that is possible.
    std::optional<PropulsiveLinearEffortX> propulsive_linear_effort_x{};

    /// PropulsiveLinearEffortY: percent, -100 to 100, bit 1 of the presence vector.
    ///
    /// Push along the axis to the right, percent of the most that is possible.
    std::optional<PropulsiveLinearEffortY> propulsive_linear_effort_y{};

    /// PropulsiveLinearEffortZ: percent, -100 to 100, bit 2 of the presence vector.
    ///
    /// Push along the axis that points down, percent of the most that is possible.
    std::optional<PropulsiveLinearEffortZ> propulsive_linear_effort_z{};

    /// PropulsiveRotationalEffortX: percent, -100 to 100, bit 3 of the presence vector.
    ///
    /// Turn about the forward axis, percent of the most that is possible.
    std::optional<PropulsiveRotationalEffortX> propulsive_rotational_effort_x{};

    /// PropulsiveRotationalEffortY: percent, -100 to 100, bit 4 of the presence vector.
    ///
    /// Turn about the axis to the right, percent of the most that is possible.
    std::optional<PropulsiveRotationalEffortY> propulsive_rotational_effort_y{};

    /// PropulsiveRotationalEffortZ: percent, -100 to 100, bit 5 of the presence vector.
    ///
    /// Turn about the axis that points down, percent of the most that is possible.
    std::optional<PropulsiveRotationalEffortZ> propulsive_rotational_effort_z{};

    /// ResistiveLinearEffortX: percent, 0 to 100, bit 6 of the presence vector.
    ///
    /// Brake along the forward axis, percent of the most that is possible.
    std::optional<ResistiveLinearEffortX> resistive_linear_effort_x{};

    /// ResistiveLinearEffortY: percent, 0 to 100, bit 7 of the presence vector.
    ///
    /// Brake along the axis to the right, percent of the most that is possible.
    std::optional<ResistiveLinearEffortY> resistive_linear_effort_y{};

    /// ResistiveLinearEffortZ: percent, 0 to 100, bit 8 of the presence vector.
    ///
    /// Brake along the axis that points down, percent of the most that is possible.
    std::optional<ResistiveLinearEffortZ> resistive_linear_effort_z{};

    /// ResistiveRotationalEffortX: percent, 0 to 100, bit 9 of the presence vector.
    ///
    /// Brake against turning about the forward axis, percent of the most that is possible.
    std::optional<ResistiveRotationalEffortX> resistive_rotational_effort_x{};

    /// ResistiveRotationalEffortY: percent, 0 to 100, bit 10 of the presence vector.
    ///
    /// Brake against turning about the axis to the right, percent of the most that is possible.
    std::optional<ResistiveRotationalEffortY> resistive_rotational_effort_y{};

    /// ResistiveRotationalEffortZ: percent, 0 to 100, bit 11 of the presence vector.
    ///
    /// Brake against turning about the axis that points down, percent of the most that is possible.
    std::optional<ResistiveRotationalEffortZ> resistive_rotational_effort_z{};

    /// PropulsiveLinearEffortX in percent.
    std::optional<double> propulsive_linear_effort_x_percent() const { return codec::in_units(this->propulsive_linear_effort_x); }
    codec::Checked set_propulsive_linear_effort_x_percent(double value) { return codec::assign(this->propulsive_linear_effort_x, PropulsiveLinearEffortX::of(value)); }

    /// PropulsiveLinearEffortY in percent.
    std::optional<double> propulsive_linear_effort_y_percent() const { return codec::in_units(this->propulsive_linear_effort_y); }
    codec::Checked set_propulsive_linear_effort_y_percent(double value) { return codec::assign(this->propulsive_linear_effort_y, PropulsiveLinearEffortY::of(value)); }

    /// PropulsiveLinearEffortZ in percent.
    std::optional<double> propulsive_linear_effort_z_percent() const { return codec::in_units(this->propulsive_linear_effort_z); }
    codec::Checked set_propulsive_linear_effort_z_percent(double value) { return codec::assign(this->propulsive_linear_effort_z, PropulsiveLinearEffortZ::of(value)); }

    /// PropulsiveRotationalEffortX in percent.
    std::optional<double> propulsive_rotational_effort_x_percent() const { return codec::in_units(this->propulsive_rotational_effort_x); }
    codec::Checked set_propulsive_rotational_effort_x_percent(double value) { return codec::assign(this->propulsive_rotational_effort_x, PropulsiveRotationalEffortX::of(value)); }

    /// PropulsiveRotationalEffortY in percent.
    std::optional<double> propulsive_rotational_effort_y_percent() const { return codec::in_units(this->propulsive_rotational_effort_y); }
    codec::Checked set_propulsive_rotational_effort_y_percent(double value) { return codec::assign(this->propulsive_rotational_effort_y, PropulsiveRotationalEffortY::of(value)); }

    /// PropulsiveRotationalEffortZ in percent.
    std::optional<double> propulsive_rotational_effort_z_percent() const { return codec::in_units(this->propulsive_rotational_effort_z); }
    codec::Checked set_propulsive_rotational_effort_z_percent(double value) { return codec::assign(this->propulsive_rotational_effort_z, PropulsiveRotationalEffortZ::of(value)); }

    /// ResistiveLinearEffortX in percent.
    std::optional<double> resistive_linear_effort_x_percent() const { return codec::in_units(this->resistive_linear_effort_x); }
    codec::Checked set_resistive_linear_effort_x_percent(double value) { return codec::assign(this->resistive_linear_effort_x, ResistiveLinearEffortX::of(value)); }

    /// ResistiveLinearEffortY in percent.
    std::optional<double> resistive_linear_effort_y_percent() const { return codec::in_units(this->resistive_linear_effort_y); }
    codec::Checked set_resistive_linear_effort_y_percent(double value) { return codec::assign(this->resistive_linear_effort_y, ResistiveLinearEffortY::of(value)); }

    /// ResistiveLinearEffortZ in percent.
    std::optional<double> resistive_linear_effort_z_percent() const { return codec::in_units(this->resistive_linear_effort_z); }
    codec::Checked set_resistive_linear_effort_z_percent(double value) { return codec::assign(this->resistive_linear_effort_z, ResistiveLinearEffortZ::of(value)); }

    /// ResistiveRotationalEffortX in percent.
    std::optional<double> resistive_rotational_effort_x_percent() const { return codec::in_units(this->resistive_rotational_effort_x); }
    codec::Checked set_resistive_rotational_effort_x_percent(double value) { return codec::assign(this->resistive_rotational_effort_x, ResistiveRotationalEffortX::of(value)); }

    /// ResistiveRotationalEffortY in percent.
    std::optional<double> resistive_rotational_effort_y_percent() const { return codec::in_units(this->resistive_rotational_effort_y); }
    codec::Checked set_resistive_rotational_effort_y_percent(double value) { return codec::assign(this->resistive_rotational_effort_y, ResistiveRotationalEffortY::of(value)); }

    /// ResistiveRotationalEffortZ in percent.
    std::optional<double> resistive_rotational_effort_z_percent() const { return codec::in_units(this->resistive_rotational_effort_z); }
    codec::Checked set_resistive_rotational_effort_z_percent(double value) { return codec::assign(this->resistive_rotational_effort_z, ResistiveRotationalEffortZ::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint16_t{}, self.propulsive_linear_effort_x, self.propulsive_linear_effort_y, self.propulsive_linear_effort_z, self.propulsive_rotational_effort_x, self.propulsive_rotational_effort_y, self.propulsive_rotational_effort_z, self.resistive_linear_effort_x, self.resistive_linear_effort_y, self.resistive_linear_effort_z, self.resistive_rotational_effort_x, self.resistive_rotational_effort_y, self.resistive_rotational_effort_z)
            && visitor("PropulsiveLinearEffortX", self.propulsive_linear_effort_x)
            && visitor("PropulsiveLinearEffortY", self.propulsive_linear_effort_y)
            && visitor("PropulsiveLinearEffortZ", self.propulsive_linear_effort_z)
            && visitor("PropulsiveRotationalEffortX", self.propulsive_rotational_effort_x)
            && visitor("PropulsiveRotationalEffortY", self.propulsive_rotational_effort_y)
            && visitor("PropulsiveRotationalEffortZ", self.propulsive_rotational_effort_z)
            && visitor("ResistiveLinearEffortX", self.resistive_linear_effort_x)
            && visitor("ResistiveLinearEffortY", self.resistive_linear_effort_y)
            && visitor("ResistiveLinearEffortZ", self.resistive_linear_effort_z)
            && visitor("ResistiveRotationalEffortX", self.resistive_rotational_effort_x)
            && visitor("ResistiveRotationalEffortY", self.resistive_rotational_effort_y)
            && visitor("ResistiveRotationalEffortZ", self.resistive_rotational_effort_z);
    }
};

namespace ReportNavigation_types {

/// SyncTimeRec.
struct SyncTimeRec {

    /// TimeSeconds: second.
    ///
    /// UTC as seconds since 1970-01-01.
    std::uint32_t time_seconds{};

    /// TimeNanoSeconds.
    ///
    /// Fraction of the second, in nanoseconds.
    std::uint32_t time_nano_seconds{};

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor("TimeSeconds", self.time_seconds)
            && visitor("TimeNanoSeconds", self.time_nano_seconds);
    }
};

/// Latitude in degree: -90 to 90, carried in 4 octets.
struct Latitude : codec::Scaled<Latitude, std::uint32_t> {
    static constexpr codec::Range kRange{"Latitude", -90.0, 90.0, "degree", codec::Rounding::nearest};
};

/// Longitude in degree: -180 to 180, carried in 4 octets.
struct Longitude : codec::Scaled<Longitude, std::uint32_t> {
    static constexpr codec::Range kRange{"Longitude", -180.0, 180.0, "degree", codec::Rounding::nearest};
};

/// AltitudeAGL in meter: -50000 to 50000, carried in 4 octets.
struct AltitudeAgl : codec::Scaled<AltitudeAgl, std::uint32_t> {
    static constexpr codec::Range kRange{"AltitudeAGL", -50000.0, 50000.0, "meter", codec::Rounding::nearest};
};

/// AltitudeMSL in meter: -50000 to 50000, carried in 4 octets.
struct AltitudeMsl : codec::Scaled<AltitudeMsl, std::uint32_t> {
    static constexpr codec::Range kRange{"AltitudeMSL", -50000.0, 50000.0, "meter", codec::Rounding::nearest};
};

/// AltitudeASF in meter: -50000 to 50000, carried in 4 octets.
struct AltitudeAsf : codec::Scaled<AltitudeAsf, std::uint32_t> {
    static constexpr codec::Range kRange{"AltitudeASF", -50000.0, 50000.0, "meter", codec::Rounding::nearest};
};

/// Depth in meter: -50000 to 50000, carried in 4 octets.
struct Depth : codec::Scaled<Depth, std::uint32_t> {
    static constexpr codec::Range kRange{"Depth", -50000.0, 50000.0, "meter", codec::Rounding::nearest};
};

/// XYPositionRMS in meter: 0 to 100, carried in 4 octets.
struct XyPositionRms : codec::Scaled<XyPositionRms, std::uint32_t> {
    static constexpr codec::Range kRange{"XYPositionRMS", 0.0, 100.0, "meter", codec::Rounding::nearest};
};

/// ZPositionRMS in meter: 0 to 100, carried in 4 octets.
struct ZPositionRms : codec::Scaled<ZPositionRms, std::uint32_t> {
    static constexpr codec::Range kRange{"ZPositionRMS", 0.0, 100.0, "meter", codec::Rounding::nearest};
};

/// Roll in radian: -3.141592653589793 to 3.141592653589793, carried in 2 octets.
struct Roll : codec::Scaled<Roll, std::uint16_t> {
    static constexpr codec::Range kRange{"Roll", -3.141592653589793, 3.141592653589793, "radian", codec::Rounding::nearest};
};

/// Pitch in radian: -3.141592653589793 to 3.141592653589793, carried in 2 octets.
struct Pitch : codec::Scaled<Pitch, std::uint16_t> {
    static constexpr codec::Range kRange{"Pitch", -3.141592653589793, 3.141592653589793, "radian", codec::Rounding::nearest};
};

/// Heading in radian: -3.141592653589793 to 3.141592653589793, carried in 2 octets.
struct Heading : codec::Scaled<Heading, std::uint16_t> {
    static constexpr codec::Range kRange{"Heading", -3.141592653589793, 3.141592653589793, "radian", codec::Rounding::nearest};
};

/// Attitude_RMS in radian: 0 to 3.141592653589793, carried in 2 octets.
struct AttitudeRms : codec::Scaled<AttitudeRms, std::uint16_t> {
    static constexpr codec::Range kRange{"Attitude_RMS", 0.0, 3.141592653589793, "radian", codec::Rounding::nearest};
};

/// Course in radian: -3.141592653589793 to 3.141592653589793, carried in 2 octets.
struct Course : codec::Scaled<Course, std::uint16_t> {
    static constexpr codec::Range kRange{"Course", -3.141592653589793, 3.141592653589793, "radian", codec::Rounding::nearest};
};

/// ReportGlobalPoseExtRec.
struct ReportGlobalPoseExtRec {

    /// Latitude: degree, -90 to 90, bit 0 of the presence vector.
    ///
    /// WGS 84, north positive.
    std::optional<Latitude> latitude{};

    /// Longitude: degree, -180 to 180, bit 1 of the presence vector.
    ///
    /// WGS 84, east positive.
    std::optional<Longitude> longitude{};

    /// AltitudeAGL: meter, -50000 to 50000, bit 2 of the presence vector.
    ///
    /// Height above the ground.
    std::optional<AltitudeAgl> altitude_agl{};

    /// AltitudeMSL: meter, -50000 to 50000, bit 3 of the presence vector.
    ///
    /// Height above mean sea level.
    std::optional<AltitudeMsl> altitude_msl{};

    /// AltitudeASF: meter, -50000 to 50000, bit 4 of the presence vector.
    ///
    /// Height above the sea floor.
    std::optional<AltitudeAsf> altitude_asf{};

    /// Depth: meter, -50000 to 50000, bit 5 of the presence vector.
    ///
    /// Depth below the water surface.
    std::optional<Depth> depth{};

    /// XYPositionRMS: meter, 0 to 100, bit 6 of the presence vector.
    ///
    /// Standard error in the horizontal plane.
    std::optional<XyPositionRms> xy_position_rms{};

    /// ZPositionRMS: meter, 0 to 100, bit 7 of the presence vector.
    ///
    /// Standard error of height or depth.
    std::optional<ZPositionRms> z_position_rms{};

    /// Roll: radian, -3.141592653589793 to 3.141592653589793, bit 8 of the presence vector.
    ///
    /// Rotation about the forward axis.
    std::optional<Roll> roll{};

    /// Pitch: radian, -3.141592653589793 to 3.141592653589793, bit 9 of the presence vector.
    ///
    /// Rotation about the axis to the right.
    std::optional<Pitch> pitch{};

    /// Heading: radian, -3.141592653589793 to 3.141592653589793, bit 10 of the presence vector.
    ///
    /// Where the nose points: 0 is north, or the local X axis, clockwise positive.
    std::optional<Heading> heading{};

    /// Attitude_RMS: radian, 0 to 3.141592653589793, bit 11 of the presence vector.
    ///
    /// Standard error of the attitude.
    std::optional<AttitudeRms> attitude_rms{};

    /// Course: radian, -3.141592653589793 to 3.141592653589793, bit 12 of the presence vector.
    ///
    /// Where the platform moves: 0 is north, or the local X axis, clockwise positive.
    std::optional<Course> course{};

    /// TimeSeconds: second, bit 13 of the presence vector.
    ///
    /// UTC as seconds since 1970-01-01.
    std::optional<std::uint32_t> time_seconds{};

    /// TimeNanoSeconds: bit 14 of the presence vector.
    ///
    /// Fraction of the second, in nanoseconds.
    std::optional<std::uint32_t> time_nano_seconds{};

    /// Latitude in degree.
    std::optional<double> latitude_deg() const { return codec::in_units(this->latitude); }
    codec::Checked set_latitude_deg(double value) { return codec::assign(this->latitude, Latitude::of(value)); }

    /// Longitude in degree.
    std::optional<double> longitude_deg() const { return codec::in_units(this->longitude); }
    codec::Checked set_longitude_deg(double value) { return codec::assign(this->longitude, Longitude::of(value)); }

    /// AltitudeAGL in meter.
    std::optional<double> altitude_agl_m() const { return codec::in_units(this->altitude_agl); }
    codec::Checked set_altitude_agl_m(double value) { return codec::assign(this->altitude_agl, AltitudeAgl::of(value)); }

    /// AltitudeMSL in meter.
    std::optional<double> altitude_msl_m() const { return codec::in_units(this->altitude_msl); }
    codec::Checked set_altitude_msl_m(double value) { return codec::assign(this->altitude_msl, AltitudeMsl::of(value)); }

    /// AltitudeASF in meter.
    std::optional<double> altitude_asf_m() const { return codec::in_units(this->altitude_asf); }
    codec::Checked set_altitude_asf_m(double value) { return codec::assign(this->altitude_asf, AltitudeAsf::of(value)); }

    /// Depth in meter.
    std::optional<double> depth_m() const { return codec::in_units(this->depth); }
    codec::Checked set_depth_m(double value) { return codec::assign(this->depth, Depth::of(value)); }

    /// XYPositionRMS in meter.
    std::optional<double> xy_position_rms_m() const { return codec::in_units(this->xy_position_rms); }
    codec::Checked set_xy_position_rms_m(double value) { return codec::assign(this->xy_position_rms, XyPositionRms::of(value)); }

    /// ZPositionRMS in meter.
    std::optional<double> z_position_rms_m() const { return codec::in_units(this->z_position_rms); }
    codec::Checked set_z_position_rms_m(double value) { return codec::assign(this->z_position_rms, ZPositionRms::of(value)); }

    /// Roll in radian.
    std::optional<double> roll_rad() const { return codec::in_units(this->roll); }
    codec::Checked set_roll_rad(double value) { return codec::assign(this->roll, Roll::of(value)); }

    /// Pitch in radian.
    std::optional<double> pitch_rad() const { return codec::in_units(this->pitch); }
    codec::Checked set_pitch_rad(double value) { return codec::assign(this->pitch, Pitch::of(value)); }

    /// Heading in radian.
    std::optional<double> heading_rad() const { return codec::in_units(this->heading); }
    codec::Checked set_heading_rad(double value) { return codec::assign(this->heading, Heading::of(value)); }

    /// Attitude_RMS in radian.
    std::optional<double> attitude_rms_rad() const { return codec::in_units(this->attitude_rms); }
    codec::Checked set_attitude_rms_rad(double value) { return codec::assign(this->attitude_rms, AttitudeRms::of(value)); }

    /// Course in radian.
    std::optional<double> course_rad() const { return codec::in_units(this->course); }
    codec::Checked set_course_rad(double value) { return codec::assign(this->course, Course::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint16_t{}, self.latitude, self.longitude, self.altitude_agl, self.altitude_msl, self.altitude_asf, self.depth, self.xy_position_rms, self.z_position_rms, self.roll, self.pitch, self.heading, self.attitude_rms, self.course, self.time_seconds, self.time_nano_seconds)
            && visitor("Latitude", self.latitude)
            && visitor("Longitude", self.longitude)
            && visitor("AltitudeAGL", self.altitude_agl)
            && visitor("AltitudeMSL", self.altitude_msl)
            && visitor("AltitudeASF", self.altitude_asf)
            && visitor("Depth", self.depth)
            && visitor("XYPositionRMS", self.xy_position_rms)
            && visitor("ZPositionRMS", self.z_position_rms)
            && visitor("Roll", self.roll)
            && visitor("Pitch", self.pitch)
            && visitor("Heading", self.heading)
            && visitor("Attitude_RMS", self.attitude_rms)
            && visitor("Course", self.course)
            && visitor("TimeSeconds", self.time_seconds)
            && visitor("TimeNanoSeconds", self.time_nano_seconds);
    }
};

/// X in meter: -20000000 to 20000000, carried in 4 octets.
struct X : codec::Scaled<X, std::uint32_t> {
    static constexpr codec::Range kRange{"X", -20000000.0, 20000000.0, "meter", codec::Rounding::nearest};
};

/// Y in meter: -20000000 to 20000000, carried in 4 octets.
struct Y : codec::Scaled<Y, std::uint32_t> {
    static constexpr codec::Range kRange{"Y", -20000000.0, 20000000.0, "meter", codec::Rounding::nearest};
};

/// ZLocal in meter: -50000 to 50000, carried in 4 octets.
struct ZLocal : codec::Scaled<ZLocal, std::uint32_t> {
    static constexpr codec::Range kRange{"ZLocal", -50000.0, 50000.0, "meter", codec::Rounding::nearest};
};

/// ReportLocalPoseExtRec.
struct ReportLocalPoseExtRec {

    /// X: meter, -20000000 to 20000000, bit 0 of the presence vector.
    ///
    /// Along the local X axis.
    std::optional<X> x{};

    /// Y: meter, -20000000 to 20000000, bit 1 of the presence vector.
    ///
    /// Along the local Y axis.
    std::optional<Y> y{};

    /// AltitudeAGL: meter, -50000 to 50000, bit 2 of the presence vector.
    ///
    /// Height above the ground.
    std::optional<AltitudeAgl> altitude_agl{};

    /// AltitudeMSL: meter, -50000 to 50000, bit 3 of the presence vector.
    ///
    /// Height above mean sea level.
    std::optional<AltitudeMsl> altitude_msl{};

    /// AltitudeASF: meter, -50000 to 50000, bit 4 of the presence vector.
    ///
    /// Height above the sea floor.
    std::optional<AltitudeAsf> altitude_asf{};

    /// Depth: meter, -50000 to 50000, bit 5 of the presence vector.
    ///
    /// Depth below the water surface.
    std::optional<Depth> depth{};

    /// ZLocal: meter, -50000 to 50000, bit 6 of the presence vector.
    ///
    /// Along the local Z axis, down positive.
    std::optional<ZLocal> z_local{};

    /// XYPositionRMS: meter, 0 to 100, bit 7 of the presence vector.
    ///
    /// Standard error in the horizontal plane.
    std::optional<XyPositionRms> xy_position_rms{};

    /// ZPositionRMS: meter, 0 to 100, bit 8 of the presence vector.
    ///
    /// Standard error of height or depth.
    std::optional<ZPositionRms> z_position_rms{};

    /// Roll: radian, -3.141592653589793 to 3.141592653589793, bit 9 of the presence vector.
    ///
    /// Rotation about the forward axis.
    std::optional<Roll> roll{};

    /// Pitch: radian, -3.141592653589793 to 3.141592653589793, bit 10 of the presence vector.
    ///
    /// Rotation about the axis to the right.
    std::optional<Pitch> pitch{};

    /// Heading: radian, -3.141592653589793 to 3.141592653589793, bit 11 of the presence vector.
    ///
    /// Where the nose points: 0 is north, or the local X axis, clockwise positive.
    std::optional<Heading> heading{};

    /// Attitude_RMS: radian, 0 to 3.141592653589793, bit 12 of the presence vector.
    ///
    /// Standard error of the attitude.
    std::optional<AttitudeRms> attitude_rms{};

    /// Course: radian, -3.141592653589793 to 3.141592653589793, bit 13 of the presence vector.
    ///
    /// Where the platform moves: 0 is north, or the local X axis, clockwise positive.
    std::optional<Course> course{};

    /// TimeSeconds: second, bit 14 of the presence vector.
    ///
    /// UTC as seconds since 1970-01-01.
    std::optional<std::uint32_t> time_seconds{};

    /// TimeNanoSeconds: bit 15 of the presence vector.
    ///
    /// Fraction of the second, in nanoseconds.
    std::optional<std::uint32_t> time_nano_seconds{};

    /// X in meter.
    std::optional<double> x_m() const { return codec::in_units(this->x); }
    codec::Checked set_x_m(double value) { return codec::assign(this->x, X::of(value)); }

    /// Y in meter.
    std::optional<double> y_m() const { return codec::in_units(this->y); }
    codec::Checked set_y_m(double value) { return codec::assign(this->y, Y::of(value)); }

    /// AltitudeAGL in meter.
    std::optional<double> altitude_agl_m() const { return codec::in_units(this->altitude_agl); }
    codec::Checked set_altitude_agl_m(double value) { return codec::assign(this->altitude_agl, AltitudeAgl::of(value)); }

    /// AltitudeMSL in meter.
    std::optional<double> altitude_msl_m() const { return codec::in_units(this->altitude_msl); }
    codec::Checked set_altitude_msl_m(double value) { return codec::assign(this->altitude_msl, AltitudeMsl::of(value)); }

    /// AltitudeASF in meter.
    std::optional<double> altitude_asf_m() const { return codec::in_units(this->altitude_asf); }
    codec::Checked set_altitude_asf_m(double value) { return codec::assign(this->altitude_asf, AltitudeAsf::of(value)); }

    /// Depth in meter.
    std::optional<double> depth_m() const { return codec::in_units(this->depth); }
    codec::Checked set_depth_m(double value) { return codec::assign(this->depth, Depth::of(value)); }

    /// ZLocal in meter.
    std::optional<double> z_local_m() const { return codec::in_units(this->z_local); }
    codec::Checked set_z_local_m(double value) { return codec::assign(this->z_local, ZLocal::of(value)); }

    /// XYPositionRMS in meter.
    std::optional<double> xy_position_rms_m() const { return codec::in_units(this->xy_position_rms); }
    codec::Checked set_xy_position_rms_m(double value) { return codec::assign(this->xy_position_rms, XyPositionRms::of(value)); }

    /// ZPositionRMS in meter.
    std::optional<double> z_position_rms_m() const { return codec::in_units(this->z_position_rms); }
    codec::Checked set_z_position_rms_m(double value) { return codec::assign(this->z_position_rms, ZPositionRms::of(value)); }

    /// Roll in radian.
    std::optional<double> roll_rad() const { return codec::in_units(this->roll); }
    codec::Checked set_roll_rad(double value) { return codec::assign(this->roll, Roll::of(value)); }

    /// Pitch in radian.
    std::optional<double> pitch_rad() const { return codec::in_units(this->pitch); }
    codec::Checked set_pitch_rad(double value) { return codec::assign(this->pitch, Pitch::of(value)); }

    /// Heading in radian.
    std::optional<double> heading_rad() const { return codec::in_units(this->heading); }
    codec::Checked set_heading_rad(double value) { return codec::assign(this->heading, Heading::of(value)); }

    /// Attitude_RMS in radian.
    std::optional<double> attitude_rms_rad() const { return codec::in_units(this->attitude_rms); }
    codec::Checked set_attitude_rms_rad(double value) { return codec::assign(this->attitude_rms, AttitudeRms::of(value)); }

    /// Course in radian.
    std::optional<double> course_rad() const { return codec::in_units(this->course); }
    codec::Checked set_course_rad(double value) { return codec::assign(this->course, Course::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint16_t{}, self.x, self.y, self.altitude_agl, self.altitude_msl, self.altitude_asf, self.depth, self.z_local, self.xy_position_rms, self.z_position_rms, self.roll, self.pitch, self.heading, self.attitude_rms, self.course, self.time_seconds, self.time_nano_seconds)
            && visitor("X", self.x)
            && visitor("Y", self.y)
            && visitor("AltitudeAGL", self.altitude_agl)
            && visitor("AltitudeMSL", self.altitude_msl)
            && visitor("AltitudeASF", self.altitude_asf)
            && visitor("Depth", self.depth)
            && visitor("ZLocal", self.z_local)
            && visitor("XYPositionRMS", self.xy_position_rms)
            && visitor("ZPositionRMS", self.z_position_rms)
            && visitor("Roll", self.roll)
            && visitor("Pitch", self.pitch)
            && visitor("Heading", self.heading)
            && visitor("Attitude_RMS", self.attitude_rms)
            && visitor("Course", self.course)
            && visitor("TimeSeconds", self.time_seconds)
            && visitor("TimeNanoSeconds", self.time_nano_seconds);
    }
};

/// Velocity_X in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityX : codec::Scaled<VelocityX, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_X", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// Velocity_Y in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityY : codec::Scaled<VelocityY, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_Y", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// Velocity_Z in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityZ : codec::Scaled<VelocityZ, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_Z", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// VelocityVehicleXYZRec.
///
/// In the frame of the vehicle.
struct VelocityVehicleXyzRec {

    /// Velocity_X: meter per second, -327.68 to 327.67, bit 0 of the presence vector.
    ///
    /// Forward, or along the X axis of the chosen frame.
    std::optional<VelocityX> velocity_x{};

    /// Velocity_Y: meter per second, -327.68 to 327.67, bit 1 of the presence vector.
    ///
    /// To the right, or along the Y axis of the chosen frame.
    std::optional<VelocityY> velocity_y{};

    /// Velocity_Z: meter per second, -327.68 to 327.67, bit 2 of the presence vector.
    ///
    /// Downward, or along the Z axis of the chosen frame.
    std::optional<VelocityZ> velocity_z{};

    /// Velocity_X in meter per second.
    std::optional<double> velocity_x_m_per_s() const { return codec::in_units(this->velocity_x); }
    codec::Checked set_velocity_x_m_per_s(double value) { return codec::assign(this->velocity_x, VelocityX::of(value)); }

    /// Velocity_Y in meter per second.
    std::optional<double> velocity_y_m_per_s() const { return codec::in_units(this->velocity_y); }
    codec::Checked set_velocity_y_m_per_s(double value) { return codec::assign(this->velocity_y, VelocityY::of(value)); }

    /// Velocity_Z in meter per second.
    std::optional<double> velocity_z_m_per_s() const { return codec::in_units(this->velocity_z); }
    codec::Checked set_velocity_z_m_per_s(double value) { return codec::assign(this->velocity_z, VelocityZ::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint8_t{}, self.velocity_x, self.velocity_y, self.velocity_z)
            && visitor("Velocity_X", self.velocity_x)
            && visitor("Velocity_Y", self.velocity_y)
            && visitor("Velocity_Z", self.velocity_z);
    }
};

/// VelocityLocalXYZRec.
///
/// In the local frame.
struct VelocityLocalXyzRec {

    /// Velocity_X: meter per second, -327.68 to 327.67, bit 0 of the presence vector.
    ///
    /// Forward, or along the X axis of the chosen frame.
    std::optional<VelocityX> velocity_x{};

    /// Velocity_Y: meter per second, -327.68 to 327.67, bit 1 of the presence vector.
    ///
    /// To the right, or along the Y axis of the chosen frame.
    std::optional<VelocityY> velocity_y{};

    /// Velocity_Z: meter per second, -327.68 to 327.67, bit 2 of the presence vector.
    ///
    /// Downward, or along the Z axis of the chosen frame.
    std::optional<VelocityZ> velocity_z{};

    /// Velocity_X in meter per second.
    std::optional<double> velocity_x_m_per_s() const { return codec::in_units(this->velocity_x); }
    codec::Checked set_velocity_x_m_per_s(double value) { return codec::assign(this->velocity_x, VelocityX::of(value)); }

    /// Velocity_Y in meter per second.
    std::optional<double> velocity_y_m_per_s() const { return codec::in_units(this->velocity_y); }
    codec::Checked set_velocity_y_m_per_s(double value) { return codec::assign(this->velocity_y, VelocityY::of(value)); }

    /// Velocity_Z in meter per second.
    std::optional<double> velocity_z_m_per_s() const { return codec::in_units(this->velocity_z); }
    codec::Checked set_velocity_z_m_per_s(double value) { return codec::assign(this->velocity_z, VelocityZ::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint8_t{}, self.velocity_x, self.velocity_y, self.velocity_z)
            && visitor("Velocity_X", self.velocity_x)
            && visitor("Velocity_Y", self.velocity_y)
            && visitor("Velocity_Z", self.velocity_z);
    }
};

/// Velocity_N in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityN : codec::Scaled<VelocityN, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_N", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// Velocity_E in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityE : codec::Scaled<VelocityE, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_E", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// Velocity_D in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityD : codec::Scaled<VelocityD, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_D", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// VelocityNEDRec.
///
/// North, east and down.
struct VelocityNedRec {

    /// Velocity_N: meter per second, -327.68 to 327.67, bit 0 of the presence vector.
    ///
    /// Northward.
    std::optional<VelocityN> velocity_n{};

    /// Velocity_E: meter per second, -327.68 to 327.67, bit 1 of the presence vector.
    ///
    /// Eastward.
    std::optional<VelocityE> velocity_e{};

    /// Velocity_D: meter per second, -327.68 to 327.67, bit 2 of the presence vector.
    ///
    /// Downward.
    std::optional<VelocityD> velocity_d{};

    /// Velocity_N in meter per second.
    std::optional<double> velocity_n_m_per_s() const { return codec::in_units(this->velocity_n); }
    codec::Checked set_velocity_n_m_per_s(double value) { return codec::assign(this->velocity_n, VelocityN::of(value)); }

    /// Velocity_E in meter per second.
    std::optional<double> velocity_e_m_per_s() const { return codec::in_units(this->velocity_e); }
    codec::Checked set_velocity_e_m_per_s(double value) { return codec::assign(this->velocity_e, VelocityE::of(value)); }

    /// Velocity_D in meter per second.
    std::optional<double> velocity_d_m_per_s() const { return codec::in_units(this->velocity_d); }
    codec::Checked set_velocity_d_m_per_s(double value) { return codec::assign(this->velocity_d, VelocityD::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint8_t{}, self.velocity_n, self.velocity_e, self.velocity_d)
            && visitor("Velocity_N", self.velocity_n)
            && visitor("Velocity_E", self.velocity_e)
            && visitor("Velocity_D", self.velocity_d);
    }
};

/// VelocityVar: one of its alternatives.
struct VelocityVar {
    enum : std::size_t { velocity_vehicle_xyz_rec, velocity_local_xyz_rec, velocity_ned_rec };
    std::variant<VelocityVehicleXyzRec, VelocityLocalXyzRec, VelocityNedRec> chosen{};

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.variant(std::uint8_t{}, self.chosen, codec::Alternative<codec::Value>{"VelocityVehicleXYZRec"}, codec::Alternative<codec::Value>{"VelocityLocalXYZRec"}, codec::Alternative<codec::Value>{"VelocityNEDRec"});
    }
};

/// Velocity_RMS in meter per second: 0 to 100, carried in 4 octets.
struct VelocityRms : codec::Scaled<VelocityRms, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_RMS", 0.0, 100.0, "meter per second", codec::Rounding::nearest};
};

/// RollRate in radian per second: -32.768 to 32.767, carried in 4 octets.
struct RollRate : codec::Scaled<RollRate, std::uint32_t> {
    static constexpr codec::Range kRange{"RollRate", -32.768, 32.767, "radian per second", codec::Rounding::nearest};
};

/// PitchRate in radian per second: -32.768 to 32.767, carried in 4 octets.
struct PitchRate : codec::Scaled<PitchRate, std::uint32_t> {
    static constexpr codec::Range kRange{"PitchRate", -32.768, 32.767, "radian per second", codec::Rounding::nearest};
};

/// YawRate in radian per second: -32.768 to 32.767, carried in 4 octets.
struct YawRate : codec::Scaled<YawRate, std::uint32_t> {
    static constexpr codec::Range kRange{"YawRate", -32.768, 32.767, "radian per second", codec::Rounding::nearest};
};

/// Rate_RMS in radian per second: 0 to 100, carried in 2 octets.
struct RateRms : codec::Scaled<RateRms, std::uint16_t> {
    static constexpr codec::Range kRange{"Rate_RMS", 0.0, 100.0, "radian per second", codec::Rounding::nearest};
};

/// SpeedOverGround in meter per second: -327.68 to 327.67, carried in 2 octets.
struct SpeedOverGround : codec::Scaled<SpeedOverGround, std::uint16_t> {
    static constexpr codec::Range kRange{"SpeedOverGround", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// SpeedRelativeToMedium in meter per second: -327.68 to 327.67, carried in 2 octets.
struct SpeedRelativeToMedium : codec::Scaled<SpeedRelativeToMedium, std::uint16_t> {
    static constexpr codec::Range kRange{"SpeedRelativeToMedium", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// RotationsPerMinute in rotations per minute: -1000 to 1000, carried in 2 octets.
struct RotationsPerMinute : codec::Scaled<RotationsPerMinute, std::uint16_t> {
    static constexpr codec::Range kRange{"RotationsPerMinute", -1000.0, 1000.0, "rotations per minute", codec::Rounding::nearest};
};

/// IndicatedSpeed in meter per second: -327.68 to 327.67, carried in 2 octets.
struct IndicatedSpeed : codec::Scaled<IndicatedSpeed, std::uint16_t> {
    static constexpr codec::Range kRange{"IndicatedSpeed", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// ReportVelocityStateExtRec.
struct ReportVelocityStateExtRec {

    /// Velocity_RMS: meter per second, 0 to 100, bit 0 of the presence vector.
    ///
    /// Standard error of the velocity.
    std::optional<VelocityRms> velocity_rms{};

    /// RollRate: radian per second, -32.768 to 32.767, bit 1 of the presence vector.
    ///
    /// Turn rate about the forward axis.
    std::optional<RollRate> roll_rate{};

    /// PitchRate: radian per second, -32.768 to 32.767, bit 2 of the presence vector.
    ///
    /// Turn rate about the axis to the right.
    std::optional<PitchRate> pitch_rate{};

    /// YawRate: radian per second, -32.768 to 32.767, bit 3 of the presence vector.
    ///
    /// Turn rate about the axis that points down.
    std::optional<YawRate> yaw_rate{};

    /// Rate_RMS: radian per second, 0 to 100, bit 4 of the presence vector.
    ///
    /// Standard error of the turn rates.
    std::optional<RateRms> rate_rms{};

    /// SpeedOverGround: meter per second, -327.68 to 327.67, bit 5 of the presence vector.
    ///
    /// Speed against the ground.
    std::optional<SpeedOverGround> speed_over_ground{};

    /// SpeedRelativeToMedium: meter per second, -327.68 to 327.67, bit 6 of the presence vector.
    ///
    /// Speed against the surrounding air or water.
    std::optional<SpeedRelativeToMedium> speed_relative_to_medium{};

    /// RotationsPerMinute: rotations per minute, -1000 to 1000, bit 7 of the presence vector.
    ///
    /// Speed of the propulsion shaft.
    std::optional<RotationsPerMinute> rotations_per_minute{};

    /// IndicatedSpeed: meter per second, -327.68 to 327.67, bit 8 of the presence vector.
    ///
    /// Speed as the instrument on board shows it.
    std::optional<IndicatedSpeed> indicated_speed{};

    /// TimeSeconds: second, bit 9 of the presence vector.
    ///
    /// UTC as seconds since 1970-01-01.
    std::optional<std::uint32_t> time_seconds{};

    /// TimeNanoSeconds: bit 10 of the presence vector.
    ///
    /// Fraction of the second, in nanoseconds.
    std::optional<std::uint32_t> time_nano_seconds{};

    /// Velocity_RMS in meter per second.
    std::optional<double> velocity_rms_m_per_s() const { return codec::in_units(this->velocity_rms); }
    codec::Checked set_velocity_rms_m_per_s(double value) { return codec::assign(this->velocity_rms, VelocityRms::of(value)); }

    /// RollRate in radian per second.
    std::optional<double> roll_rate_rad_per_s() const { return codec::in_units(this->roll_rate); }
    codec::Checked set_roll_rate_rad_per_s(double value) { return codec::assign(this->roll_rate, RollRate::of(value)); }

    /// PitchRate in radian per second.
    std::optional<double> pitch_rate_rad_per_s() const { return codec::in_units(this->pitch_rate); }
    codec::Checked set_pitch_rate_rad_per_s(double value) { return codec::assign(this->pitch_rate, PitchRate::of(value)); }

    /// YawRate in radian per second.
    std::optional<double> yaw_rate_rad_per_s() const { return codec::in_units(this->yaw_rate); }
    codec::Checked set_yaw_rate_rad_per_s(double value) { return codec::assign(this->yaw_rate, YawRate::of(value)); }

    /// Rate_RMS in radian per second.
    std::optional<double> rate_rms_rad_per_s() const { return codec::in_units(this->rate_rms); }
    codec::Checked set_rate_rms_rad_per_s(double value) { return codec::assign(this->rate_rms, RateRms::of(value)); }

    /// SpeedOverGround in meter per second.
    std::optional<double> speed_over_ground_m_per_s() const { return codec::in_units(this->speed_over_ground); }
    codec::Checked set_speed_over_ground_m_per_s(double value) { return codec::assign(this->speed_over_ground, SpeedOverGround::of(value)); }

    /// SpeedRelativeToMedium in meter per second.
    std::optional<double> speed_relative_to_medium_m_per_s() const { return codec::in_units(this->speed_relative_to_medium); }
    codec::Checked set_speed_relative_to_medium_m_per_s(double value) { return codec::assign(this->speed_relative_to_medium, SpeedRelativeToMedium::of(value)); }

    /// RotationsPerMinute in rotations per minute.
    std::optional<double> rotations_per_minute_rotations_per_minute() const { return codec::in_units(this->rotations_per_minute); }
    codec::Checked set_rotations_per_minute_rotations_per_minute(double value) { return codec::assign(this->rotations_per_minute, RotationsPerMinute::of(value)); }

    /// IndicatedSpeed in meter per second.
    std::optional<double> indicated_speed_m_per_s() const { return codec::in_units(this->indicated_speed); }
    codec::Checked set_indicated_speed_m_per_s(double value) { return codec::assign(this->indicated_speed, IndicatedSpeed::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint16_t{}, self.velocity_rms, self.roll_rate, self.pitch_rate, self.yaw_rate, self.rate_rms, self.speed_over_ground, self.speed_relative_to_medium, self.rotations_per_minute, self.indicated_speed, self.time_seconds, self.time_nano_seconds)
            && visitor("Velocity_RMS", self.velocity_rms)
            && visitor("RollRate", self.roll_rate)
            && visitor("PitchRate", self.pitch_rate)
            && visitor("YawRate", self.yaw_rate)
            && visitor("Rate_RMS", self.rate_rms)
            && visitor("SpeedOverGround", self.speed_over_ground)
            && visitor("SpeedRelativeToMedium", self.speed_relative_to_medium)
            && visitor("RotationsPerMinute", self.rotations_per_minute)
            && visitor("IndicatedSpeed", self.indicated_speed)
            && visitor("TimeSeconds", self.time_seconds)
            && visitor("TimeNanoSeconds", self.time_nano_seconds);
    }
};

/// ReportVelocityStateExtSeq.
struct ReportVelocityStateExtSeq {

    /// VelocityVar.
    VelocityVar velocity_var{};

    /// ReportVelocityStateExtRec.
    ReportVelocityStateExtRec report_velocity_state_ext_rec{};

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor("VelocityVar", self.velocity_var)
            && visitor("ReportVelocityStateExtRec", self.report_velocity_state_ext_rec);
    }
};

/// Acceleration_X in meter per second squared: -1310.68 to 1310.68, carried in 4 octets.
struct AccelerationX : codec::Scaled<AccelerationX, std::uint32_t> {
    static constexpr codec::Range kRange{"Acceleration_X", -1310.68, 1310.68, "meter per second squared", codec::Rounding::nearest};
};

/// Acceleration_Y in meter per second squared: -1310.68 to 1310.68, carried in 4 octets.
struct AccelerationY : codec::Scaled<AccelerationY, std::uint32_t> {
    static constexpr codec::Range kRange{"Acceleration_Y", -1310.68, 1310.68, "meter per second squared", codec::Rounding::nearest};
};

/// Acceleration_Z in meter per second squared: -1310.68 to 1310.68, carried in 4 octets.
struct AccelerationZ : codec::Scaled<AccelerationZ, std::uint32_t> {
    static constexpr codec::Range kRange{"Acceleration_Z", -1310.68, 1310.68, "meter per second squared", codec::Rounding::nearest};
};

/// Acceleration_RMS in meter per second squared: 0 to 100, carried in 4 octets.
struct AccelerationRms : codec::Scaled<AccelerationRms, std::uint32_t> {
    static constexpr codec::Range kRange{"Acceleration_RMS", 0.0, 100.0, "meter per second squared", codec::Rounding::nearest};
};

/// RollAcceleration in radian per second squared: -13106.8 to 13106.8, carried in 4 octets.
struct RollAcceleration : codec::Scaled<RollAcceleration, std::uint32_t> {
    static constexpr codec::Range kRange{"RollAcceleration", -13106.8, 13106.8, "radian per second squared", codec::Rounding::nearest};
};

/// PitchAcceleration in radian per second squared: -13106.8 to 13106.8, carried in 4 octets.
struct PitchAcceleration : codec::Scaled<PitchAcceleration, std::uint32_t> {
    static constexpr codec::Range kRange{"PitchAcceleration", -13106.8, 13106.8, "radian per second squared", codec::Rounding::nearest};
};

/// YawAcceleration in radian per second squared: -13106.8 to 13106.8, carried in 4 octets.
struct YawAcceleration : codec::Scaled<YawAcceleration, std::uint32_t> {
    static constexpr codec::Range kRange{"YawAcceleration", -13106.8, 13106.8, "radian per second squared", codec::Rounding::nearest};
};

/// RotationalAcceleration_RMS in radian per second squared: 0 to 1000, carried in 2 octets.
struct RotationalAccelerationRms : codec::Scaled<RotationalAccelerationRms, std::uint16_t> {
    static constexpr codec::Range kRange{"RotationalAcceleration_RMS", 0.0, 1000.0, "radian per second squared", codec::Rounding::nearest};
};

/// ReportAccelerationStateExtRec.
struct ReportAccelerationStateExtRec {

    /// Acceleration_X: meter per second squared, -1310.68 to 1310.68, bit 0 of the presence vector.
    ///
    /// Forward.
    std::optional<AccelerationX> acceleration_x{};

    /// Acceleration_Y: meter per second squared, -1310.68 to 1310.68, bit 1 of the presence vector.
    ///
    /// To the right.
    std::optional<AccelerationY> acceleration_y{};

    /// Acceleration_Z: meter per second squared, -1310.68 to 1310.68, bit 2 of the presence vector.
    ///
    /// Downward.
    std::optional<AccelerationZ> acceleration_z{};

    /// Acceleration_RMS: meter per second squared, 0 to 100, bit 3 of the presence vector.
    ///
    /// Standard error of the linear acceleration.
    std::optional<AccelerationRms> acceleration_rms{};

    /// RollAcceleration: radian per second squared, -13106.8 to 13106.8, bit 4 of the presence
    /// vector.
    ///
    /// Angular acceleration about the forward axis.
    std::optional<RollAcceleration> roll_acceleration{};

    /// PitchAcceleration: radian per second squared, -13106.8 to 13106.8, bit 5 of the presence
    /// vector.
    ///
    /// Angular acceleration about the axis to the right.
    std::optional<PitchAcceleration> pitch_acceleration{};

    /// YawAcceleration: radian per second squared, -13106.8 to 13106.8, bit 6 of the presence
    /// vector.
    ///
    /// Angular acceleration about the axis that points down.
    std::optional<YawAcceleration> yaw_acceleration{};

    /// RotationalAcceleration_RMS: radian per second squared, 0 to 1000, bit 7 of the presence
    /// vector.
    ///
    /// Standard error of the angular acceleration.
    std::optional<RotationalAccelerationRms> rotational_acceleration_rms{};

    /// TimeSeconds: second, bit 8 of the presence vector.
    ///
    /// UTC as seconds since 1970-01-01.
    std::optional<std::uint32_t> time_seconds{};

    /// TimeNanoSeconds: bit 9 of the presence vector.
    ///
    /// Fraction of the second, in nanoseconds.
    std::optional<std::uint32_t> time_nano_seconds{};

    /// Acceleration_X in meter per second squared.
    std::optional<double> acceleration_x_m_per_s2() const { return codec::in_units(this->acceleration_x); }
    codec::Checked set_acceleration_x_m_per_s2(double value) { return codec::assign(this->acceleration_x, AccelerationX::of(value)); }

    /// Acceleration_Y in meter per second squared.
    std::optional<double> acceleration_y_m_per_s2() const { return codec::in_units(this->acceleration_y); }
    codec::Checked set_acceleration_y_m_per_s2(double value) { return codec::assign(this->acceleration_y, AccelerationY::of(value)); }

    /// Acceleration_Z in meter per second squared.
    std::optional<double> acceleration_z_m_per_s2() const { return codec::in_units(this->acceleration_z); }
    codec::Checked set_acceleration_z_m_per_s2(double value) { return codec::assign(this->acceleration_z, AccelerationZ::of(value)); }

    /// Acceleration_RMS in meter per second squared.
    std::optional<double> acceleration_rms_m_per_s2() const { return codec::in_units(this->acceleration_rms); }
    codec::Checked set_acceleration_rms_m_per_s2(double value) { return codec::assign(this->acceleration_rms, AccelerationRms::of(value)); }

    /// RollAcceleration in radian per second squared.
    std::optional<double> roll_acceleration_rad_per_s2() const { return codec::in_units(this->roll_acceleration); }
    codec::Checked set_roll_acceleration_rad_per_s2(double value) { return codec::assign(this->roll_acceleration, RollAcceleration::of(value)); }

    /// PitchAcceleration in radian per second squared.
    std::optional<double> pitch_acceleration_rad_per_s2() const { return codec::in_units(this->pitch_acceleration); }
    codec::Checked set_pitch_acceleration_rad_per_s2(double value) { return codec::assign(this->pitch_acceleration, PitchAcceleration::of(value)); }

    /// YawAcceleration in radian per second squared.
    std::optional<double> yaw_acceleration_rad_per_s2() const { return codec::in_units(this->yaw_acceleration); }
    codec::Checked set_yaw_acceleration_rad_per_s2(double value) { return codec::assign(this->yaw_acceleration, YawAcceleration::of(value)); }

    /// RotationalAcceleration_RMS in radian per second squared.
    std::optional<double> rotational_acceleration_rms_rad_per_s2() const { return codec::in_units(this->rotational_acceleration_rms); }
    codec::Checked set_rotational_acceleration_rms_rad_per_s2(double value) { return codec::assign(this->rotational_acceleration_rms, RotationalAccelerationRms::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint16_t{}, self.acceleration_x, self.acceleration_y, self.acceleration_z, self.acceleration_rms, self.roll_acceleration, self.pitch_acceleration, self.yaw_acceleration, self.rotational_acceleration_rms, self.time_seconds, self.time_nano_seconds)
            && visitor("Acceleration_X", self.acceleration_x)
            && visitor("Acceleration_Y", self.acceleration_y)
            && visitor("Acceleration_Z", self.acceleration_z)
            && visitor("Acceleration_RMS", self.acceleration_rms)
            && visitor("RollAcceleration", self.roll_acceleration)
            && visitor("PitchAcceleration", self.pitch_acceleration)
            && visitor("YawAcceleration", self.yaw_acceleration)
            && visitor("RotationalAcceleration_RMS", self.rotational_acceleration_rms)
            && visitor("TimeSeconds", self.time_seconds)
            && visitor("TimeNanoSeconds", self.time_nano_seconds);
    }
};

} // namespace ReportNavigation_types

/// ReportNavigation (4421h).
///
/// Tells pose, velocity and acceleration in one report.
///
/// Declared by urn:jaus:jss:mobility:NavigationState 1.1.
struct ReportNavigation {
    static constexpr std::uint16_t kCode = 0x4421;
    static constexpr const char* kName = "ReportNavigation";
    static constexpr bool kIsCommand = false;
    static constexpr std::array<const char*, 1> kServices{"urn:jaus:jss:mobility:NavigationState 1.1"};

    using SyncTimeRec = ReportNavigation_types::SyncTimeRec;
    using Latitude = ReportNavigation_types::Latitude;
    using Longitude = ReportNavigation_types::Longitude;
    using AltitudeAgl = ReportNavigation_types::AltitudeAgl;
    using AltitudeMsl = ReportNavigation_types::AltitudeMsl;
    using AltitudeAsf = ReportNavigation_types::AltitudeAsf;
    using Depth = ReportNavigation_types::Depth;
    using XyPositionRms = ReportNavigation_types::XyPositionRms;
    using ZPositionRms = ReportNavigation_types::ZPositionRms;
    using Roll = ReportNavigation_types::Roll;
    using Pitch = ReportNavigation_types::Pitch;
    using Heading = ReportNavigation_types::Heading;
    using AttitudeRms = ReportNavigation_types::AttitudeRms;
    using Course = ReportNavigation_types::Course;
    using ReportGlobalPoseExtRec = ReportNavigation_types::ReportGlobalPoseExtRec;
    using X = ReportNavigation_types::X;
    using Y = ReportNavigation_types::Y;
    using ZLocal = ReportNavigation_types::ZLocal;
    using ReportLocalPoseExtRec = ReportNavigation_types::ReportLocalPoseExtRec;
    using VelocityX = ReportNavigation_types::VelocityX;
    using VelocityY = ReportNavigation_types::VelocityY;
    using VelocityZ = ReportNavigation_types::VelocityZ;
    using VelocityVehicleXyzRec = ReportNavigation_types::VelocityVehicleXyzRec;
    using VelocityLocalXyzRec = ReportNavigation_types::VelocityLocalXyzRec;
    using VelocityN = ReportNavigation_types::VelocityN;
    using VelocityE = ReportNavigation_types::VelocityE;
    using VelocityD = ReportNavigation_types::VelocityD;
    using VelocityNedRec = ReportNavigation_types::VelocityNedRec;
    using VelocityVar = ReportNavigation_types::VelocityVar;
    using VelocityRms = ReportNavigation_types::VelocityRms;
    using RollRate = ReportNavigation_types::RollRate;
    using PitchRate = ReportNavigation_types::PitchRate;
    using YawRate = ReportNavigation_types::YawRate;
    using RateRms = ReportNavigation_types::RateRms;
    using SpeedOverGround = ReportNavigation_types::SpeedOverGround;
    using SpeedRelativeToMedium = ReportNavigation_types::SpeedRelativeToMedium;
    using RotationsPerMinute = ReportNavigation_types::RotationsPerMinute;
    using IndicatedSpeed = ReportNavigation_types::IndicatedSpeed;
    using ReportVelocityStateExtRec = ReportNavigation_types::ReportVelocityStateExtRec;
    using ReportVelocityStateExtSeq = ReportNavigation_types::ReportVelocityStateExtSeq;
    using AccelerationX = ReportNavigation_types::AccelerationX;
    using AccelerationY = ReportNavigation_types::AccelerationY;
    using AccelerationZ = ReportNavigation_types::AccelerationZ;
    using AccelerationRms = ReportNavigation_types::AccelerationRms;
    using RollAcceleration = ReportNavigation_types::RollAcceleration;
    using PitchAcceleration = ReportNavigation_types::PitchAcceleration;
    using YawAcceleration = ReportNavigation_types::YawAcceleration;
    using RotationalAccelerationRms = ReportNavigation_types::RotationalAccelerationRms;
    using ReportAccelerationStateExtRec = ReportNavigation_types::ReportAccelerationStateExtRec;

    /// SyncTimeRec.
    SyncTimeRec sync_time_rec{};

    /// ReportGlobalPoseExtRec.
    ReportGlobalPoseExtRec report_global_pose_ext_rec{};

    /// ReportLocalPoseExtRec.
    ReportLocalPoseExtRec report_local_pose_ext_rec{};

    /// ReportVelocityStateExtSeq.
    ReportVelocityStateExtSeq report_velocity_state_ext_seq{};

    /// ReportAccelerationStateExtRec.
    ReportAccelerationStateExtRec report_acceleration_state_ext_rec{};

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor("SyncTimeRec", self.sync_time_rec)
            && visitor("ReportGlobalPoseExtRec", self.report_global_pose_ext_rec)
            && visitor("ReportLocalPoseExtRec", self.report_local_pose_ext_rec)
            && visitor("ReportVelocityStateExtSeq", self.report_velocity_state_ext_seq)
            && visitor("ReportAccelerationStateExtRec", self.report_acceleration_state_ext_rec);
    }
};

namespace ReportVelocityStateExt_types {

/// Velocity_X in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityX : codec::Scaled<VelocityX, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_X", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// Velocity_Y in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityY : codec::Scaled<VelocityY, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_Y", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// Velocity_Z in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityZ : codec::Scaled<VelocityZ, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_Z", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// VelocityVehicleXYZRec.
///
/// In the frame of the vehicle.
struct VelocityVehicleXyzRec {

    /// Velocity_X: meter per second, -327.68 to 327.67, bit 0 of the presence vector.
    ///
    /// Forward, or along the X axis of the chosen frame.
    std::optional<VelocityX> velocity_x{};

    /// Velocity_Y: meter per second, -327.68 to 327.67, bit 1 of the presence vector.
    ///
    /// To the right, or along the Y axis of the chosen frame.
    std::optional<VelocityY> velocity_y{};

    /// Velocity_Z: meter per second, -327.68 to 327.67, bit 2 of the presence vector.
    ///
    /// Downward, or along the Z axis of the chosen frame.
    std::optional<VelocityZ> velocity_z{};

    /// Velocity_X in meter per second.
    std::optional<double> velocity_x_m_per_s() const { return codec::in_units(this->velocity_x); }
    codec::Checked set_velocity_x_m_per_s(double value) { return codec::assign(this->velocity_x, VelocityX::of(value)); }

    /// Velocity_Y in meter per second.
    std::optional<double> velocity_y_m_per_s() const { return codec::in_units(this->velocity_y); }
    codec::Checked set_velocity_y_m_per_s(double value) { return codec::assign(this->velocity_y, VelocityY::of(value)); }

    /// Velocity_Z in meter per second.
    std::optional<double> velocity_z_m_per_s() const { return codec::in_units(this->velocity_z); }
    codec::Checked set_velocity_z_m_per_s(double value) { return codec::assign(this->velocity_z, VelocityZ::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint8_t{}, self.velocity_x, self.velocity_y, self.velocity_z)
            && visitor("Velocity_X", self.velocity_x)
            && visitor("Velocity_Y", self.velocity_y)
            && visitor("Velocity_Z", self.velocity_z);
    }
};

/// VelocityLocalXYZRec.
///
/// In the local frame.
struct VelocityLocalXyzRec {

    /// Velocity_X: meter per second, -327.68 to 327.67, bit 0 of the presence vector.
    ///
    /// Forward, or along the X axis of the chosen frame.
    std::optional<VelocityX> velocity_x{};

    /// Velocity_Y: meter per second, -327.68 to 327.67, bit 1 of the presence vector.
    ///
    /// To the right, or along the Y axis of the chosen frame.
    std::optional<VelocityY> velocity_y{};

    /// Velocity_Z: meter per second, -327.68 to 327.67, bit 2 of the presence vector.
    ///
    /// Downward, or along the Z axis of the chosen frame.
    std::optional<VelocityZ> velocity_z{};

    /// Velocity_X in meter per second.
    std::optional<double> velocity_x_m_per_s() const { return codec::in_units(this->velocity_x); }
    codec::Checked set_velocity_x_m_per_s(double value) { return codec::assign(this->velocity_x, VelocityX::of(value)); }

    /// Velocity_Y in meter per second.
    std::optional<double> velocity_y_m_per_s() const { return codec::in_units(this->velocity_y); }
    codec::Checked set_velocity_y_m_per_s(double value) { return codec::assign(this->velocity_y, VelocityY::of(value)); }

    /// Velocity_Z in meter per second.
    std::optional<double> velocity_z_m_per_s() const { return codec::in_units(this->velocity_z); }
    codec::Checked set_velocity_z_m_per_s(double value) { return codec::assign(this->velocity_z, VelocityZ::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint8_t{}, self.velocity_x, self.velocity_y, self.velocity_z)
            && visitor("Velocity_X", self.velocity_x)
            && visitor("Velocity_Y", self.velocity_y)
            && visitor("Velocity_Z", self.velocity_z);
    }
};

/// Velocity_N in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityN : codec::Scaled<VelocityN, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_N", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// Velocity_E in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityE : codec::Scaled<VelocityE, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_E", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// Velocity_D in meter per second: -327.68 to 327.67, carried in 4 octets.
struct VelocityD : codec::Scaled<VelocityD, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_D", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// VelocityNEDRec.
///
/// North, east and down.
struct VelocityNedRec {

    /// Velocity_N: meter per second, -327.68 to 327.67, bit 0 of the presence vector.
    ///
    /// Northward.
    std::optional<VelocityN> velocity_n{};

    /// Velocity_E: meter per second, -327.68 to 327.67, bit 1 of the presence vector.
    ///
    /// Eastward.
    std::optional<VelocityE> velocity_e{};

    /// Velocity_D: meter per second, -327.68 to 327.67, bit 2 of the presence vector.
    ///
    /// Downward.
    std::optional<VelocityD> velocity_d{};

    /// Velocity_N in meter per second.
    std::optional<double> velocity_n_m_per_s() const { return codec::in_units(this->velocity_n); }
    codec::Checked set_velocity_n_m_per_s(double value) { return codec::assign(this->velocity_n, VelocityN::of(value)); }

    /// Velocity_E in meter per second.
    std::optional<double> velocity_e_m_per_s() const { return codec::in_units(this->velocity_e); }
    codec::Checked set_velocity_e_m_per_s(double value) { return codec::assign(this->velocity_e, VelocityE::of(value)); }

    /// Velocity_D in meter per second.
    std::optional<double> velocity_d_m_per_s() const { return codec::in_units(this->velocity_d); }
    codec::Checked set_velocity_d_m_per_s(double value) { return codec::assign(this->velocity_d, VelocityD::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint8_t{}, self.velocity_n, self.velocity_e, self.velocity_d)
            && visitor("Velocity_N", self.velocity_n)
            && visitor("Velocity_E", self.velocity_e)
            && visitor("Velocity_D", self.velocity_d);
    }
};

/// VelocityVar: one of its alternatives.
struct VelocityVar {
    enum : std::size_t { velocity_vehicle_xyz_rec, velocity_local_xyz_rec, velocity_ned_rec };
    std::variant<VelocityVehicleXyzRec, VelocityLocalXyzRec, VelocityNedRec> chosen{};

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.variant(std::uint8_t{}, self.chosen, codec::Alternative<codec::Value>{"VelocityVehicleXYZRec"}, codec::Alternative<codec::Value>{"VelocityLocalXYZRec"}, codec::Alternative<codec::Value>{"VelocityNEDRec"});
    }
};

/// Velocity_RMS in meter per second: 0 to 100, carried in 4 octets.
struct VelocityRms : codec::Scaled<VelocityRms, std::uint32_t> {
    static constexpr codec::Range kRange{"Velocity_RMS", 0.0, 100.0, "meter per second", codec::Rounding::nearest};
};

/// RollRate in radian per second: -32.768 to 32.767, carried in 4 octets.
struct RollRate : codec::Scaled<RollRate, std::uint32_t> {
    static constexpr codec::Range kRange{"RollRate", -32.768, 32.767, "radian per second", codec::Rounding::nearest};
};

/// PitchRate in radian per second: -32.768 to 32.767, carried in 4 octets.
struct PitchRate : codec::Scaled<PitchRate, std::uint32_t> {
    static constexpr codec::Range kRange{"PitchRate", -32.768, 32.767, "radian per second", codec::Rounding::nearest};
};

/// YawRate in radian per second: -32.768 to 32.767, carried in 4 octets.
struct YawRate : codec::Scaled<YawRate, std::uint32_t> {
    static constexpr codec::Range kRange{"YawRate", -32.768, 32.767, "radian per second", codec::Rounding::nearest};
};

/// Rate_RMS in radian per second: 0 to 100, carried in 2 octets.
struct RateRms : codec::Scaled<RateRms, std::uint16_t> {
    static constexpr codec::Range kRange{"Rate_RMS", 0.0, 100.0, "radian per second", codec::Rounding::nearest};
};

/// SpeedOverGround in meter per second: -327.68 to 327.67, carried in 2 octets.
struct SpeedOverGround : codec::Scaled<SpeedOverGround, std::uint16_t> {
    static constexpr codec::Range kRange{"SpeedOverGround", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// SpeedRelativeToMedium in meter per second: -327.68 to 327.67, carried in 2 octets.
struct SpeedRelativeToMedium : codec::Scaled<SpeedRelativeToMedium, std::uint16_t> {
    static constexpr codec::Range kRange{"SpeedRelativeToMedium", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// RotationsPerMinute in rotations per minute: -1000 to 1000, carried in 2 octets.
struct RotationsPerMinute : codec::Scaled<RotationsPerMinute, std::uint16_t> {
    static constexpr codec::Range kRange{"RotationsPerMinute", -1000.0, 1000.0, "rotations per minute", codec::Rounding::nearest};
};

/// IndicatedSpeed in meter per second: -327.68 to 327.67, carried in 2 octets.
struct IndicatedSpeed : codec::Scaled<IndicatedSpeed, std::uint16_t> {
    static constexpr codec::Range kRange{"IndicatedSpeed", -327.68, 327.67, "meter per second", codec::Rounding::nearest};
};

/// ReportVelocityStateExtRec.
struct ReportVelocityStateExtRec {

    /// Velocity_RMS: meter per second, 0 to 100, bit 0 of the presence vector.
    ///
    /// Standard error of the velocity.
    std::optional<VelocityRms> velocity_rms{};

    /// RollRate: radian per second, -32.768 to 32.767, bit 1 of the presence vector.
    ///
    /// Turn rate about the forward axis.
    std::optional<RollRate> roll_rate{};

    /// PitchRate: radian per second, -32.768 to 32.767, bit 2 of the presence vector.
    ///
    /// Turn rate about the axis to the right.
    std::optional<PitchRate> pitch_rate{};

    /// YawRate: radian per second, -32.768 to 32.767, bit 3 of the presence vector.
    ///
    /// Turn rate about the axis that points down.
    std::optional<YawRate> yaw_rate{};

    /// Rate_RMS: radian per second, 0 to 100, bit 4 of the presence vector.
    ///
    /// Standard error of the turn rates.
    std::optional<RateRms> rate_rms{};

    /// SpeedOverGround: meter per second, -327.68 to 327.67, bit 5 of the presence vector.
    ///
    /// Speed against the ground.
    std::optional<SpeedOverGround> speed_over_ground{};

    /// SpeedRelativeToMedium: meter per second, -327.68 to 327.67, bit 6 of the presence vector.
    ///
    /// Speed against the surrounding air or water.
    std::optional<SpeedRelativeToMedium> speed_relative_to_medium{};

    /// RotationsPerMinute: rotations per minute, -1000 to 1000, bit 7 of the presence vector.
    ///
    /// Speed of the propulsion shaft.
    std::optional<RotationsPerMinute> rotations_per_minute{};

    /// IndicatedSpeed: meter per second, -327.68 to 327.67, bit 8 of the presence vector.
    ///
    /// Speed as the instrument on board shows it.
    std::optional<IndicatedSpeed> indicated_speed{};

    /// TimeSeconds: second, bit 9 of the presence vector.
    ///
    /// UTC as seconds since 1970-01-01.
    std::optional<std::uint32_t> time_seconds{};

    /// TimeNanoSeconds: bit 10 of the presence vector.
    ///
    /// Fraction of the second, in nanoseconds.
    std::optional<std::uint32_t> time_nano_seconds{};

    /// Velocity_RMS in meter per second.
    std::optional<double> velocity_rms_m_per_s() const { return codec::in_units(this->velocity_rms); }
    codec::Checked set_velocity_rms_m_per_s(double value) { return codec::assign(this->velocity_rms, VelocityRms::of(value)); }

    /// RollRate in radian per second.
    std::optional<double> roll_rate_rad_per_s() const { return codec::in_units(this->roll_rate); }
    codec::Checked set_roll_rate_rad_per_s(double value) { return codec::assign(this->roll_rate, RollRate::of(value)); }

    /// PitchRate in radian per second.
    std::optional<double> pitch_rate_rad_per_s() const { return codec::in_units(this->pitch_rate); }
    codec::Checked set_pitch_rate_rad_per_s(double value) { return codec::assign(this->pitch_rate, PitchRate::of(value)); }

    /// YawRate in radian per second.
    std::optional<double> yaw_rate_rad_per_s() const { return codec::in_units(this->yaw_rate); }
    codec::Checked set_yaw_rate_rad_per_s(double value) { return codec::assign(this->yaw_rate, YawRate::of(value)); }

    /// Rate_RMS in radian per second.
    std::optional<double> rate_rms_rad_per_s() const { return codec::in_units(this->rate_rms); }
    codec::Checked set_rate_rms_rad_per_s(double value) { return codec::assign(this->rate_rms, RateRms::of(value)); }

    /// SpeedOverGround in meter per second.
    std::optional<double> speed_over_ground_m_per_s() const { return codec::in_units(this->speed_over_ground); }
    codec::Checked set_speed_over_ground_m_per_s(double value) { return codec::assign(this->speed_over_ground, SpeedOverGround::of(value)); }

    /// SpeedRelativeToMedium in meter per second.
    std::optional<double> speed_relative_to_medium_m_per_s() const { return codec::in_units(this->speed_relative_to_medium); }
    codec::Checked set_speed_relative_to_medium_m_per_s(double value) { return codec::assign(this->speed_relative_to_medium, SpeedRelativeToMedium::of(value)); }

    /// RotationsPerMinute in rotations per minute.
    std::optional<double> rotations_per_minute_rotations_per_minute() const { return codec::in_units(this->rotations_per_minute); }
    codec::Checked set_rotations_per_minute_rotations_per_minute(double value) { return codec::assign(this->rotations_per_minute, RotationsPerMinute::of(value)); }

    /// IndicatedSpeed in meter per second.
    std::optional<double> indicated_speed_m_per_s() const { return codec::in_units(this->indicated_speed); }
    codec::Checked set_indicated_speed_m_per_s(double value) { return codec::assign(this->indicated_speed, IndicatedSpeed::of(value)); }

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor.presence(std::uint16_t{}, self.velocity_rms, self.roll_rate, self.pitch_rate, self.yaw_rate, self.rate_rms, self.speed_over_ground, self.speed_relative_to_medium, self.rotations_per_minute, self.indicated_speed, self.time_seconds, self.time_nano_seconds)
            && visitor("Velocity_RMS", self.velocity_rms)
            && visitor("RollRate", self.roll_rate)
            && visitor("PitchRate", self.pitch_rate)
            && visitor("YawRate", self.yaw_rate)
            && visitor("Rate_RMS", self.rate_rms)
            && visitor("SpeedOverGround", self.speed_over_ground)
            && visitor("SpeedRelativeToMedium", self.speed_relative_to_medium)
            && visitor("RotationsPerMinute", self.rotations_per_minute)
            && visitor("IndicatedSpeed", self.indicated_speed)
            && visitor("TimeSeconds", self.time_seconds)
            && visitor("TimeNanoSeconds", self.time_nano_seconds);
    }
};

} // namespace ReportVelocityStateExt_types

/// ReportVelocityStateExt (44A4h).
///
/// Tells velocity and turn rates in a chosen frame, with speeds and POSIX time.
///
/// Declared by urn:jaus:jss:mobility:VelocityStateSensor 1.1.
struct ReportVelocityStateExt {
    static constexpr std::uint16_t kCode = 0x44A4;
    static constexpr const char* kName = "ReportVelocityStateExt";
    static constexpr bool kIsCommand = false;
    static constexpr std::array<const char*, 1> kServices{"urn:jaus:jss:mobility:VelocityStateSensor 1.1"};

    using VelocityX = ReportVelocityStateExt_types::VelocityX;
    using VelocityY = ReportVelocityStateExt_types::VelocityY;
    using VelocityZ = ReportVelocityStateExt_types::VelocityZ;
    using VelocityVehicleXyzRec = ReportVelocityStateExt_types::VelocityVehicleXyzRec;
    using VelocityLocalXyzRec = ReportVelocityStateExt_types::VelocityLocalXyzRec;
    using VelocityN = ReportVelocityStateExt_types::VelocityN;
    using VelocityE = ReportVelocityStateExt_types::VelocityE;
    using VelocityD = ReportVelocityStateExt_types::VelocityD;
    using VelocityNedRec = ReportVelocityStateExt_types::VelocityNedRec;
    using VelocityVar = ReportVelocityStateExt_types::VelocityVar;
    using VelocityRms = ReportVelocityStateExt_types::VelocityRms;
    using RollRate = ReportVelocityStateExt_types::RollRate;
    using PitchRate = ReportVelocityStateExt_types::PitchRate;
    using YawRate = ReportVelocityStateExt_types::YawRate;
    using RateRms = ReportVelocityStateExt_types::RateRms;
    using SpeedOverGround = ReportVelocityStateExt_types::SpeedOverGround;
    using SpeedRelativeToMedium = ReportVelocityStateExt_types::SpeedRelativeToMedium;
    using RotationsPerMinute = ReportVelocityStateExt_types::RotationsPerMinute;
    using IndicatedSpeed = ReportVelocityStateExt_types::IndicatedSpeed;
    using ReportVelocityStateExtRec = ReportVelocityStateExt_types::ReportVelocityStateExtRec;

    /// VelocityVar.
    VelocityVar velocity_var{};

    /// ReportVelocityStateExtRec.
    ReportVelocityStateExtRec report_velocity_state_ext_rec{};

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor("VelocityVar", self.velocity_var)
            && visitor("ReportVelocityStateExtRec", self.report_velocity_state_ext_rec);
    }
};

} // namespace v1_1

using SetWrenchEffort = v1_1::SetWrenchEffort;
using QueryVelocityState = v1_1::QueryVelocityState;
using QueryWrenchEffort = v1_1::QueryWrenchEffort;
using QueryNavigation = v1_1::QueryNavigation;
using QueryVelocityStateExt = v1_1::QueryVelocityStateExt;
using ReportVelocityState = v1_1::ReportVelocityState;
using ReportWrenchEffort = v1_1::ReportWrenchEffort;
using ReportNavigation = v1_1::ReportNavigation;
using ReportVelocityStateExt = v1_1::ReportVelocityStateExt;

/// All messages, older versions first.
using messages = codec::Types<
    v1_1::SetWrenchEffort,
    v1_1::QueryVelocityState,
    v1_1::QueryWrenchEffort,
    v1_1::QueryNavigation,
    v1_1::QueryVelocityStateExt,
    v1_1::ReportVelocityState,
    v1_1::ReportWrenchEffort,
    v1_1::ReportNavigation,
    v1_1::ReportVelocityStateExt>;

} // namespace jaus::mobility

#endif
