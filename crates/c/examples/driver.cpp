// A primitive driver: it obeys the client in control while it is ready. The operator's example drives it.
#include "jaus/mobility.hpp"
#include "place.hpp"

#include <atomic>
#include <iostream>
#include <thread>

using namespace jaus::mobility;

// A motor that gets its effort every 50 ms. A real one stops by itself 200 ms after the last command, for
// the case that this program dies.
class Motor {
public:
    void set(double effort) { effort_ = effort; }

    void run() {
        double last = -1;
        for (;;) {
            const double effort = effort_;
            if (effort != 0 || last != 0) {
                std::cout << "motor " << effort << std::endl;
            }
            last = effort;
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
        }
    }

private:
    std::atomic<double> effort_{0};
};

int main(int count, char **arguments) try {
    jaus::Node node = place(count, arguments, 102);
    Motor motor;
    // ANCHOR: driver
    jaus::Component driver(node, 33, JAUS_KIND_VEHICLE, "Rover");
    driver.management();
    driver.on_standing([](const jaus::Event &standing) {
        std::cout << "state " << int(standing.value()) << std::endl;
    });
    driver.offer("urn:jaus:jss:mobility:PrimitiveDriver", 1, 1)
        .command(SetWrenchEffort::kCode,
                 [&](const jaus::Event &event) {
                     const auto command =
                         jaus::codec::decode<SetWrenchEffort>({event.data(), event.size()});
                     // A command that cannot be read stops the motor.
                     motor.set(
                         command ? command->propulsive_linear_effort_x_percent().value_or(0) : 0);
                 })
        .decline(QueryWrenchEffort::kCode)
        .on_stop([&] { motor.set(0); });
    driver.start();
    // ANCHOR_END: driver
    std::cout << driver.address().text() << " is up" << std::endl;
    motor.run();
} catch (const jaus::Error &error) {
    std::cerr << error.what() << std::endl;
    return 1;
}
