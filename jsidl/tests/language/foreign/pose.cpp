#include <cstdio>

#include "jaus/mobility.hpp"

using namespace jaus;
using mobility::ReportGlobalPose;

int main() {
    ReportGlobalPose pose;
    if (const auto set = pose.set_latitude_deg(53.1); !set) {
        std::puts(set.error().text().c_str());
    }
    ReportGlobalPose::TimeStamp stamp;
    if (stamp.set_day(31) && stamp.set_hour(12)) pose.time_stamp = stamp;

    const auto octets = codec::encode(pose);
    if (!octets) return 1;

    if (codec::code_of(*octets) == ReportGlobalPose::kCode) {
        const auto received = codec::decode<ReportGlobalPose>(*octets);
        if (!received) return 1;
        std::printf("%.6f %d %d\n", *received->latitude_deg(), received->time_stamp->day(),
            received->altitude_m().has_value());
    }

    if (const auto set = pose.set_latitude_deg(91); !set) std::puts(set.error().text().c_str());

    const codec::Span beginning(octets->data(), 6);
    const auto received = codec::decode<ReportGlobalPose>(beginning);
    if (!received) std::puts(received.error().text().c_str());
}
