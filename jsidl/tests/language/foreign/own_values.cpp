// Values that an application sets.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "jaus/core.hpp"
#include "jaus/mobility.hpp"

using namespace jaus;

namespace {

void check(bool holds, int line) {
    if (holds) return;
    std::fprintf(stderr, "line %d does not hold\n", line);
    std::exit(1);
}

#define CHECK(...) check((__VA_ARGS__), __LINE__)

void scaled_integers() {
    // A scaled integer is set and read in its unit, and keeps its integer.
    mobility::ReportGlobalPose pose;
    CHECK(pose.set_latitude_deg(53.1) && pose.set_longitude_deg(-1.5) && pose.set_altitude_m(12));
    const auto octets = codec::encode(pose);
    CHECK(static_cast<bool>(octets));
    const auto again = codec::decode<mobility::ReportGlobalPose>(*octets);
    CHECK(again && std::fabs(*again->latitude_deg() - 53.1) < 1e-7);
    CHECK(again->latitude->raw() == pose.latitude->raw());
    CHECK(!again->yaw && !again->yaw_rad());
    CHECK(*codec::encode(*again) == *octets);

    // A number out of range is an error and changes nothing.
    const auto set = pose.set_longitude_deg(180.5);
    CHECK(!set && set.error().text() == "Longitude: 180.5 is not in -180 to 180 degree");
    CHECK(!pose.set_longitude_deg(std::numeric_limits<double>::quiet_NaN()));
    CHECK(*pose.longitude_deg() == *again->longitude_deg());
    CHECK(!mobility::ReportGlobalPose::Latitude::of(90.0001));
}

void bit_fields() {
    mobility::ReportGlobalPose::TimeStamp stamp;
    CHECK(stamp.set_day(31) && stamp.set_hour(23) && stamp.set_milliseconds(999));
    CHECK(stamp.day() == 31 && stamp.hour() == 23 && stamp.seconds() == 0);
    CHECK(stamp.milliseconds() == 999);
    const auto set = stamp.set_day(0);
    CHECK(!set && set.error().text() == "Day: 0 is not in 1 to 31");
    CHECK(stamp.day() == 31);
}

void named_values() {
    // Values without a name are preserved.
    const std::array<std::uint8_t, 3> octets{0x00, 0x2B, 0x63};
    CHECK(codec::code_of(octets) == core::QueryIdentification::kCode);
    const auto query = codec::decode<core::QueryIdentification>(octets);
    CHECK(query && static_cast<int>(query->query_type) == 0x63);
    const auto again = codec::encode(*query);
    CHECK(again && std::equal(again->begin(), again->end(), octets.begin(), octets.end()));
}

void counts() {
    core::ReportIdentification report;
    report.identification = std::string(300, 'x');
    const auto encoded = codec::encode(report);
    CHECK(!encoded && encoded.error().problem == codec::Problem::count);
    CHECK(encoded.error().text()
        == "ReportIdentification: Identification: count 300 is outside 0 to 255");
}

void malformed_input() {
    const codec::Octets nothing;
    CHECK(!codec::code_of(nothing));
    CHECK(!codec::decode<core::QueryIdentification>(nothing));
    const codec::Octets beginning{0x00, 0x2B};
    const auto query = codec::decode<core::QueryIdentification>(beginning);
    CHECK(!query && query.error().offset == 2 && query.error().path == "QueryType");
    CHECK(query.error().problem == codec::Problem::too_short);
    CHECK(query.error().text()
        == "QueryIdentification: QueryType: octets needed: 1, left: 0 at octet 2");
}

} // namespace

int main() {
    scaled_integers();
    bit_fields();
    named_values();
    counts();
    malformed_input();
    std::puts("done");
}
