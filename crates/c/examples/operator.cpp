// An operator: shows the speed that a sensor reports, and drives for three seconds. It waits for events
// with a loop of its own.
#include "messages.hpp"
#include "place.hpp"

#include <iostream>
#include <poll.h>

namespace {

void show(const jaus::Event &event) {
    switch (event.kind()) {
    case JausEventKind_Report:
        std::cout << messages::first_field(event, -327.68, 327.67, 4).value_or(0) << " m/s, "
                  << event.lost() << " lost" << std::endl;
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
    const auto query = messages::message(messages::query_velocity_state, 1);
    auto speeds = console.subscribe(sensor, query, 10);

    const auto driver = console.find("urn:jaus:jss:mobility:PrimitiveDriver");
    auto control = console.control(driver, 127);
    control.watch_program(std::chrono::milliseconds(1000));
    control.resume();
    pollfd wait{console.descriptor(), POLLIN, 0};
    for (int turn = 0; turn < 30; ++turn) {
        control.send(messages::effort(40));
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
