// The README's component: reports its position to queries and subscriptions, until Ctrl-C.

#include "jaus/mobility.hpp"
#include <jaus.hpp>
#include <unistd.h>

using namespace jaus::mobility;

int main() {
    jaus::Node node(107, 1);
    node.loopback();
    node.start();
    jaus::Component rover(node, 53, JAUS_KIND_VEHICLE, "Rover");
    rover.offer("urn:jaus:jss:mobility:NavigationState", 1, 1).publish(QueryNavigation::kCode);
    rover.start();

    ReportNavigation report;
    if (!report.report_local_pose_ext_rec.set_x_m(2.5)) return 1;
    rover.publish(*jaus::codec::encode(report));
    pause();
}
