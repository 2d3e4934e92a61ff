// The messages of the tests, as octets.
#ifndef TEST_MESSAGES_HPP
#define TEST_MESSAGES_HPP

#include "jaus/mobility.hpp"

#include <jaus.hpp>

namespace messages {

using namespace jaus::mobility;

/// Query Velocity State for the forward velocity.
inline jaus::Octets velocity_query() {
    QueryVelocityState query;
    query.presence_vector = 1;
    return *jaus::codec::encode(query);
}

/// Report Velocity State with the forward velocity in m/s.
inline jaus::Octets velocity(double forward) {
    ReportVelocityState report;
    report.velocity_x = *ReportVelocityState::VelocityX::of(forward);
    return *jaus::codec::encode(report);
}

/// Set Wrench Effort with the forward effort in percent.
inline jaus::Octets effort(double forward) {
    SetWrenchEffort command;
    command.propulsive_linear_effort_x = *SetWrenchEffort::PropulsiveLinearEffortX::of(forward);
    return *jaus::codec::encode(command);
}

} // namespace messages

#endif
