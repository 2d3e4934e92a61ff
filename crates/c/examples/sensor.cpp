// A velocity sensor. The operator's example subscribes to it.
#include "jaus/mobility.hpp"
#include "place.hpp"

#include <iostream>
#include <thread>

using namespace jaus::mobility;

int main(int count, char **arguments) try {
    jaus::Node node = place(count, arguments, 101);
    // ANCHOR: sensor
    jaus::Component sensor(node, 44, JAUS_KIND_VEHICLE, "Rover");
    sensor.offer("urn:jaus:jss:mobility:VelocityStateSensor", 1, 1)
        .publish(QueryVelocityState::kCode)
        .decline(QueryVelocityStateExt::kCode);
    sensor.start();
    std::cout << sensor.address().text() << " is up" << std::endl;
    for (double speed = 0;; speed = speed < 2 ? speed + 0.1 : 0) {
        ReportVelocityState report;
        if (const auto set = report.set_velocity_x_m_per_s(speed); !set) {
            std::cerr << set.error().text() << std::endl;
        }
        sensor.publish(*jaus::codec::encode(report));
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    // ANCHOR_END: sensor
} catch (const jaus::Error &error) {
    std::cerr << error.what() << std::endl;
    return 1;
}
