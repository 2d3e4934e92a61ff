// An operator: shows the speed that a sensor reports, and drives for three seconds. It waits for events
// with a loop of its own.
#include "jaus/mobility.hpp"
#include "place.hpp"

#include <iostream>
#include <poll.h>

using namespace jaus::mobility;

namespace {

void show_report(const jaus::Event &event) {
    const auto report = jaus::codec::decode<ReportVelocityState>({event.data(), event.size()});
    if (!report) {
        std::cout << report.error().text() << std::endl;
    } else if (const auto speed = report->velocity_x_m_per_s()) {
        std::cout << *speed << " m/s, " << event.lost() << " lost" << std::endl;
    }
}

void show(const jaus::Event &event) {
    switch (event.kind()) {
    case JausEventKind_Report:
        show_report(event);
        break;
    case JausEventKind_SubscriptionDown:
        std::cout << "no speed: " << event.text() << std::endl;
        break;
    case JausEventKind_ControlLost:
        std::cout << "control is lost: " << event.text() << std::endl;
        break;
    default:
        break;
    }
}

} // namespace

int main(int count, char **arguments) try {
    jaus::Node node = place(count, arguments, 42);
    // ANCHOR: operator
    jaus::Component console(node, 1, JAUS_KIND_OPERATOR_CONTROL_UNIT, "Operator");
    console.start();
    const auto sensor = console.find("urn:jaus:jss:mobility:VelocityStateSensor");
    QueryVelocityState query;
    query.presence_vector = 1; // Bit 0 of the report: Velocity_X.
    auto speeds = console.subscribe(sensor, *jaus::codec::encode(query), 10);

    const auto driver = console.find("urn:jaus:jss:mobility:PrimitiveDriver");
    auto control = console.control(driver, 127);
    control.watch_program(std::chrono::milliseconds(1000));
    control.resume();
    SetWrenchEffort effort;
    if (const auto set = effort.set_propulsive_linear_effort_x_percent(40); !set) {
        std::cerr << set.error().text() << std::endl;
    }
    const auto command = *jaus::codec::encode(effort);
    pollfd wait{console.descriptor(), POLLIN, 0};
    for (int turn = 0; turn < 30; ++turn) {
        control.send(command);
        poll(&wait, 1, 100);
        while (const auto event = console.next_event()) {
            show(*event);
        }
    }
    control.standby();
    // ANCHOR_END: operator
    std::cout << "done" << std::endl;
    return 0;
} catch (const jaus::Error &error) {
    std::cerr << error.what() << std::endl;
    return 1;
}
