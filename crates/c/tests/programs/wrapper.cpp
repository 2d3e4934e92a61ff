// The C++ wrapper: objects move, free themselves in any order, and calls that fail throw.
#include "messages.hpp"

#include <cstdlib>
#include <iostream>

namespace {

void require(bool holds, const char *what) {
    if (!holds) {
        std::cerr << "not so: " << what << std::endl;
        std::exit(1);
    }
}

template <typename Call> JausStatus status_of(Call call) {
    try {
        call();
    } catch (const jaus::Error &error) {
        require(error.what()[0] != '\0', "an error has a text");
        return error.status();
    }
    return JausStatus_Ok;
}

jaus::Node loopback(std::uint16_t subsystem) {
    jaus::Node node(subsystem, 1);
    node.loopback().group("off").start();
    return node;
}

void errors_are_thrown() {
    require(status_of([] { jaus::Node(0, 1); }) == JausStatus_InvalidArgument, "subsystem 0");
    jaus::Node node(101, 1);
    require(status_of([&] { node.group("nonsense"); }) == JausStatus_InvalidArgument, "a group");
    jaus::Component early(node, 1, JAUS_KIND_VEHICLE, "Rover");
    require(status_of([&] { early.start(); }) == JausStatus_WrongState, "the node does not run");
    require(status_of([&] { early.publish({0x04, 0x44}); }) == JausStatus_WrongState, "nor does it");
    node.loopback().group("off").start();
    early.start();
    require(early.standing().first == JAUS_STATE_READY, "it runs now");
}

void an_unsafe_driver_does_not_start() {
    jaus::Node node = loopback(101);
    const char *urn = "urn:jaus:jss:mobility:PrimitiveDriver";
    const auto start = [&](bool managed, bool stops, bool declines, bool receives) {
        return status_of([&] {
            jaus::Component driver(node, 33, JAUS_KIND_VEHICLE, "Rover");
            if (managed) {
                driver.management();
            }
            auto service = driver.offer(urn, 1, 1);
            if (receives) {
                service.receive(messages::set_wrench_effort);
            }
            service.command(messages::set_wrench_effort);
            if (stops) {
                service.on_stop([] {});
            }
            if (declines) {
                service.decline(messages::query_wrench_effort);
            }
            driver.start();
        });
    };
    require(start(false, true, true, false) == JausStatus_Unsafe, "no management");
    require(start(true, false, true, false) == JausStatus_Unsafe, "no stop");
    require(start(true, true, false, false) == JausStatus_Unsafe, "a query is not answered");
    require(start(true, true, true, true) == JausStatus_Unsafe, "a command from anyone");
    require(start(true, true, true, false) == JausStatus_Ok, "all is there");
    require(start(true, true, true, false) == JausStatus_Ok, "the number is free again");
}

void a_callback_answers_and_may_not_wait() {
    jaus::Node node = loopback(101);
    jaus::Component client(node, 1, JAUS_KIND_OPERATOR_CONTROL_UNIT, "Client");
    client.start();
    jaus::Component sensor(node, 44, JAUS_KIND_VEHICLE, "Rover");
    JausStatus waited = JausStatus_Ok;
    sensor.offer("urn:jaus:jss:mobility:VelocityStateSensor", 1, 1)
        .answer(messages::query_velocity_state,
                [&](const jaus::Event &query) -> std::optional<jaus::Octets> {
                    waited = status_of([&] { client.find("urn:x"); });
                    require(query.source() == client.address(), "the client asks");
                    return messages::velocity(1.5);
                })
        .decline(messages::query_velocity_state_ext);
    sensor.start();
    jaus::Component moved = std::move(sensor);
    const auto query = messages::message(messages::query_velocity_state, 1);
    require(client.query(moved.address(), query) == messages::velocity(1.5), "the answer");
    require(waited == JausStatus_WrongThread, "a callback may not wait");
    require(client.find("urn:jaus:jss:mobility:VelocityStateSensor") == moved.address(), "found");
    require(client.providers("urn:jaus:jss:mobility:VelocityStateSensor").size() == 1, "listed");
    require(status_of([&] { client.control(moved.address(), 127); }) != JausStatus_Ok, "no control");
    require(status_of([&] { client.find("urn:none", jaus::Milliseconds(10)); }) ==
                JausStatus_NotFound,
            "no such service");
}

void handlers_live_as_long_as_the_library_may_call_them() {
    jaus::Node node = loopback(101);
    const auto made = [&](int &stops) {
        jaus::Component driver(node, 33, JAUS_KIND_VEHICLE, "Rover");
        driver.management();
        driver.offer("urn:jaus:jss:mobility:PrimitiveDriver", 1, 1)
            .command(messages::set_wrench_effort, [](const jaus::Event &) {})
            .decline(messages::query_wrench_effort)
            .on_stop([&stops, text = std::string(100, 'x')] { stops += text.size() == 100; });
        driver.start();
        return driver;
    };
    int first = 0, second = 0;
    jaus::Component driver = made(first);
    driver = jaus::Component(node, 1, JAUS_KIND_VEHICLE, "Rover");
    require(first > 0, "the first driver was stopped at its end");
    driver = made(second);
    jaus::Component other = std::move(driver);
    require(second == 0, "a move is no end");
}

void a_subscription_brings_its_events_and_ends() {
    jaus::Node node = loopback(101);
    jaus::Component sensor(node, 44, JAUS_KIND_VEHICLE, "Rover");
    sensor.offer("urn:jaus:jss:mobility:VelocityStateSensor", 1, 1)
        .publish(messages::query_velocity_state)
        .decline(messages::query_velocity_state_ext);
    sensor.start();
    jaus::Component client(node, 1, JAUS_KIND_OPERATOR_CONTROL_UNIT, "Client");
    client.start();
    require(status_of([&] { sensor.publish(messages::effort(1)); }) == JausStatus_NotFound,
            "no service publishes it");
    sensor.publish(messages::velocity(0.5));
    const auto query = messages::message(messages::query_velocity_state, 1);
    auto speeds = client.subscribe(sensor.address(), query, 0);
    require(client.descriptor() >= 0, "a descriptor");
    sensor.publish(messages::velocity(0.75));
    for (bool is_there = false; !is_there;) {
        const auto event = client.next_event(jaus::Milliseconds(10000));
        require(event.has_value(), "an event in time");
        require(event->subject() == speeds.id(), "of the subscription");
        is_there = event->kind() == JausEventKind_Report &&
                   event->message() == messages::velocity(0.75);
    }
    require(speeds.state().is_up && speeds.state().age >= 0, "it is up");
    speeds = jaus::Subscription();
    require(status_of([&] { client.subscribe(sensor.address(), query, -1); }) ==
                JausStatus_InvalidArgument,
            "a negative rate");
    // Freed by another order than that of C++: the node first.
    require(jaus_node_free(node.get()) == JausStatus_Ok, "the node is freed");
    require(status_of([&] { client.address(); }) == JausStatus_InvalidHandle, "and its components");
}

} // namespace

int main() {
    errors_are_thrown();
    an_unsafe_driver_does_not_start();
    a_callback_answers_and_may_not_wait();
    handlers_live_as_long_as_the_library_may_call_them();
    a_subscription_brings_its_events_and_ends();
    return 0;
}
