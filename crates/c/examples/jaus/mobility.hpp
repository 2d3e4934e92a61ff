// The messages of urn:jaus:jss:mobility, written by `jaus jsidl cpp`.

#ifndef JAUS_MESSAGES_MOBILITY_HPP
#define JAUS_MESSAGES_MOBILITY_HPP

#include "codec.hpp"

namespace jaus::mobility {

namespace v1_0 {

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
/// Declared by urn:jaus:jss:mobility:PrimitiveDriver 1.0, urn:jaus:jss:mobility:PrimitiveDriver
/// 1.1.
struct SetWrenchEffort {
    static constexpr std::uint16_t kCode = 0x0405;
    static constexpr const char* kName = "SetWrenchEffort";
    static constexpr bool kIsCommand = true;
    static constexpr std::array<const char*, 2> kServices{"urn:jaus:jss:mobility:PrimitiveDriver 1.0", "urn:jaus:jss:mobility:PrimitiveDriver 1.1"};

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
/// Declared by urn:jaus:jss:mobility:VelocityStateSensor 1.0,
/// urn:jaus:jss:mobility:VelocityStateSensor 1.1.
struct QueryVelocityState {
    static constexpr std::uint16_t kCode = 0x2404;
    static constexpr const char* kName = "QueryVelocityState";
    static constexpr bool kIsCommand = false;
    static constexpr std::array<const char*, 2> kServices{"urn:jaus:jss:mobility:VelocityStateSensor 1.0", "urn:jaus:jss:mobility:VelocityStateSensor 1.1"};

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
/// Declared by urn:jaus:jss:mobility:PrimitiveDriver 1.0, urn:jaus:jss:mobility:PrimitiveDriver
/// 1.1.
struct QueryWrenchEffort {
    static constexpr std::uint16_t kCode = 0x2405;
    static constexpr const char* kName = "QueryWrenchEffort";
    static constexpr bool kIsCommand = false;
    static constexpr std::array<const char*, 2> kServices{"urn:jaus:jss:mobility:PrimitiveDriver 1.0", "urn:jaus:jss:mobility:PrimitiveDriver 1.1"};

    /// PresenceVector.
    ///
    /// Wanted fields of Report Wrench Effort; bit 0 is the first that is optional.
    std::uint16_t presence_vector{};

    template <class Visitor, class Self>
    static bool visit(Visitor& visitor, Self& self) {
        return visitor("PresenceVector", self.presence_vector);
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
/// Declared by urn:jaus:jss:mobility:VelocityStateSensor 1.0,
/// urn:jaus:jss:mobility:VelocityStateSensor 1.1.
struct ReportVelocityState {
    static constexpr std::uint16_t kCode = 0x4404;
    static constexpr const char* kName = "ReportVelocityState";
    static constexpr bool kIsCommand = false;
    static constexpr std::array<const char*, 2> kServices{"urn:jaus:jss:mobility:VelocityStateSensor 1.0", "urn:jaus:jss:mobility:VelocityStateSensor 1.1"};

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
/// Declared by urn:jaus:jss:mobility:PrimitiveDriver 1.0, urn:jaus:jss:mobility:PrimitiveDriver
/// 1.1.
struct ReportWrenchEffort {
    static constexpr std::uint16_t kCode = 0x4405;
    static constexpr const char* kName = "ReportWrenchEffort";
    static constexpr bool kIsCommand = false;
    static constexpr std::array<const char*, 2> kServices{"urn:jaus:jss:mobility:PrimitiveDriver 1.0", "urn:jaus:jss:mobility:PrimitiveDriver 1.1"};

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

} // namespace v1_0

namespace v1_1 {

using SetWrenchEffort = v1_0::SetWrenchEffort;

using QueryVelocityState = v1_0::QueryVelocityState;

using QueryWrenchEffort = v1_0::QueryWrenchEffort;

using ReportVelocityState = v1_0::ReportVelocityState;

using ReportWrenchEffort = v1_0::ReportWrenchEffort;

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

using SetWrenchEffort = v1_0::SetWrenchEffort;
using QueryVelocityState = v1_0::QueryVelocityState;
using QueryWrenchEffort = v1_0::QueryWrenchEffort;
using ReportVelocityState = v1_0::ReportVelocityState;
using ReportWrenchEffort = v1_0::ReportWrenchEffort;
using QueryVelocityStateExt = v1_1::QueryVelocityStateExt;
using ReportVelocityStateExt = v1_1::ReportVelocityStateExt;

/// All messages, older versions first.
using messages = codec::Types<
    v1_0::SetWrenchEffort,
    v1_0::QueryVelocityState,
    v1_0::QueryWrenchEffort,
    v1_0::ReportVelocityState,
    v1_0::ReportWrenchEffort,
    v1_1::QueryVelocityStateExt,
    v1_1::ReportVelocityStateExt>;

} // namespace jaus::mobility

#endif
