// The README's speed sensor: reports its speed to queries and subscriptions, until Ctrl-C.

#include "jaus/mobility.hpp"
#include <jaus.hpp>
#include <unistd.h>

using namespace jaus::mobility;

int main() {
    jaus::Node node(107, 1);
    node.loopback();
    node.start();
    jaus::Component rover(node, 44, JAUS_KIND_VEHICLE, "Rover");
    rover.offer("urn:jaus:jss:mobility:VelocityStateSensor", 1, 0)
        .publish(QueryVelocityState::kCode);
    rover.start();

    ReportVelocityState report;
    if (!report.set_velocity_x_m_per_s(1.5)) return 1;
    rover.publish(*jaus::codec::encode(report));
    pause();
}
