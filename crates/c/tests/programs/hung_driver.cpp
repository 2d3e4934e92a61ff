// A driver that hangs at an effort above 50 %: in its callback, or in its own loop until it reads a line.
#include "messages.hpp"
#include "place.hpp"

#include <iostream>
#include <thread>

namespace {

bool is_fast(const jaus::Event &event) {
    const auto command =
        jaus::codec::decode<messages::SetWrenchEffort>({event.data(), event.size()});
    return command && command->propulsive_linear_effort_x_percent().value_or(0) > 50;
}

[[noreturn]] void hang() {
    std::cout << "hung" << std::endl;
    for (;;) {
        std::this_thread::sleep_for(std::chrono::hours(1));
    }
}

} // namespace

int main(int count, char **arguments) {
    jaus::Node node = place(count, arguments, 102);
    const bool in_callback = std::string(arguments[3]) == "callback";
    jaus::Component driver(node, 33, JAUS_KIND_VEHICLE, "Rover");
    driver.management();
    jaus::EventHandler handler = [](const jaus::Event &command) {
        if (is_fast(command)) {
            hang();
        }
    };
    driver.offer("urn:jaus:jss:mobility:PrimitiveDriver", 1, 1)
        .command(messages::SetWrenchEffort::kCode, in_callback ? handler : nullptr,
                 JAUS_VALIDITY_UNTIL_DONE)
        .decline(messages::QueryWrenchEffort::kCode)
        .on_stop([] { std::cout << "stop" << std::endl; });
    driver.start();
    for (;;) {
        const auto event = driver.next_event(jaus::Milliseconds(100));
        if (event && event->kind() == JausEventKind_Message && is_fast(*event)) {
            std::cout << "hung" << std::endl;
            std::string line;
            std::getline(std::cin, line);
            std::cout << "goes on" << std::endl;
        }
    }
}
