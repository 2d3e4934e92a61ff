// A primitive driver: it obeys the client in control while it is ready. The operator's example drives it.
#include "messages.hpp"
#include "place.hpp"

#include <atomic>
#include <iostream>
#include <thread>

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
        .command(messages::set_wrench_effort,
                 [&](const jaus::Event &command) {
                     motor.set(messages::first_field(command, -100, 100, 2).value_or(0));
                 })
        .decline(messages::query_wrench_effort)
        .on_stop([&] { motor.set(0); });
    driver.start();
    // ANCHOR_END: driver
    std::cout << driver.address().text() << " is up" << std::endl;
    motor.run();
} catch (const jaus::Error &error) {
    std::cerr << error.what() << std::endl;
    return 1;
}
