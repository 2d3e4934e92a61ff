// A velocity sensor. The operator's example subscribes to it.
#include "messages.hpp"
#include "place.hpp"

#include <iostream>
#include <thread>

int main(int count, char **arguments) try {
    jaus::Node node = place(count, arguments, 101);
    // ANCHOR: sensor
    jaus::Component sensor(node, 44, JAUS_KIND_VEHICLE, "Rover");
    sensor.offer("urn:jaus:jss:mobility:VelocityStateSensor", 1, 1)
        .publish(messages::query_velocity_state)
        .decline(messages::query_velocity_state_ext);
    sensor.start();
    std::cout << sensor.address().text() << " is up" << std::endl;
    for (double speed = 0;; speed = speed < 2 ? speed + 0.1 : 0) {
        sensor.publish(messages::velocity(speed));
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    // ANCHOR_END: sensor
} catch (const jaus::Error &error) {
    std::cerr << error.what() << std::endl;
    return 1;
}
