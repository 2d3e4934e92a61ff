// An operator that takes control, has its program watched, and hangs.
#include "place.hpp"

#include <iostream>
#include <thread>

int main(int count, char **arguments) {
    jaus::Node node = place(count, arguments, 43);
    jaus::Component console(node, 1, JAUS_KIND_OPERATOR_CONTROL_UNIT, "Operator");
    console.start();
    const auto driver = console.find("urn:jaus:jss:mobility:PrimitiveDriver");
    const auto lost = [](const jaus::Event &event) {
        if (event.kind() == JausEventKind_ControlLost) {
            std::cout << "control is lost: " << event.text() << std::endl;
        }
    };
    auto control = console.control(driver, 127, lost);
    control.watch_program(jaus::Milliseconds(300));
    control.resume();
    std::cout << "controls" << std::endl;
    for (;;) {
        std::this_thread::sleep_for(std::chrono::hours(1));
    }
}
