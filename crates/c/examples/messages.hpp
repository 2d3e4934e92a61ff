// The messages of the examples, encoded by hand: their code, a presence vector, and one field, little-endian.
#ifndef EXAMPLE_MESSAGES_HPP
#define EXAMPLE_MESSAGES_HPP

#include <jaus.hpp>

#include <cmath>

namespace messages {

constexpr std::uint16_t query_velocity_state = 0x2404;
constexpr std::uint16_t query_velocity_state_ext = 0x24A4;
constexpr std::uint16_t report_velocity_state = 0x4404;
constexpr std::uint16_t query_wrench_effort = 0x2405;
constexpr std::uint16_t set_wrench_effort = 0x0405;

inline void put(jaus::Octets &octets, std::uint64_t value, int width) {
    for (int octet = 0; octet < width; ++octet) {
        octets.push_back(static_cast<std::uint8_t>(value >> (8 * octet)));
    }
}

/// A real number in a range, as an integer of so many octets.
inline std::uint64_t scaled(double value, double from, double to, int width) {
    const double steps = std::pow(2.0, 8 * width) - 1.0;
    return static_cast<std::uint64_t>(std::llround((value - from) / (to - from) * steps));
}

/// The first field of a message, if it is there. The second octet pair is the presence vector.
inline std::optional<double> first_field(const jaus::Event &event, double from, double to,
                                         std::size_t width) {
    if (event.size() < 4 + width || (event.data()[2] & 1) == 0) {
        return std::nullopt;
    }
    double value = 0;
    for (std::size_t octet = width; octet > 0; --octet) {
        value = value * 256 + event.data()[4 + octet - 1];
    }
    return from + value / (std::pow(256.0, static_cast<double>(width)) - 1.0) * (to - from);
}

inline jaus::Octets message(std::uint16_t code, std::uint16_t presence) {
    jaus::Octets octets;
    put(octets, code, 2);
    put(octets, presence, 2);
    return octets;
}

/// Report Velocity State with the forward velocity in m/s.
inline jaus::Octets velocity(double forward) {
    jaus::Octets octets = message(report_velocity_state, 1);
    put(octets, scaled(forward, -327.68, 327.67, 4), 4);
    return octets;
}

/// Set Wrench Effort with the forward effort in percent.
inline jaus::Octets effort(double forward) {
    jaus::Octets octets = message(set_wrench_effort, 1);
    put(octets, scaled(forward, -100, 100, 2), 2);
    return octets;
}

} // namespace messages

#endif
