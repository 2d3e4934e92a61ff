// The C++ wrapper: objects move, free themselves in any order, and calls that fail throw.
#include "messages.hpp"

#include <cstdlib>
#include <future>
#include <iostream>
#include <thread>

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
                service.receive(messages::SetWrenchEffort::kCode);
            }
            service.command(messages::SetWrenchEffort::kCode);
            if (stops) {
                service.on_stop([] {});
            }
            if (declines) {
                service.decline(messages::QueryWrenchEffort::kCode);
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
        .answer(messages::QueryVelocityState::kCode,
                [&](const jaus::Event &query) -> std::optional<jaus::Octets> {
                    waited = status_of([&] { client.find("urn:x"); });
                    require(query.source() == client.address(), "the client asks");
                    return messages::velocity(1.5);
                })
        .decline(messages::QueryVelocityStateExt::kCode);
    sensor.start();
    jaus::Component moved = std::move(sensor);
    const auto query = messages::velocity_query();
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
            .command(messages::SetWrenchEffort::kCode, [](const jaus::Event &) {})
            .decline(messages::QueryWrenchEffort::kCode)
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
        .publish(messages::QueryVelocityState::kCode)
        .decline(messages::QueryVelocityStateExt::kCode);
    sensor.start();
    jaus::Component client(node, 1, JAUS_KIND_OPERATOR_CONTROL_UNIT, "Client");
    client.start();
    require(status_of([&] { sensor.publish(messages::effort(1)); }) == JausStatus_NotFound,
            "no service publishes it");
    sensor.publish(messages::velocity(0.5));
    const auto query = messages::velocity_query();
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

void a_callback_may_destroy_its_subscription_and_is_whole_until_it_returns() {
    jaus::Node node = loopback(101);
    jaus::Component sensor(node, 44, JAUS_KIND_VEHICLE, "Rover");
    sensor.offer("urn:jaus:jss:mobility:VelocityStateSensor", 1, 1)
        .publish(messages::QueryVelocityState::kCode)
        .decline(messages::QueryVelocityStateExt::kCode);
    sensor.start();
    sensor.publish(messages::velocity(0.5));
    jaus::Component client(node, 1, JAUS_KIND_OPERATOR_CONTROL_UNIT, "Client");
    client.start();
    jaus::Subscription speeds;
    std::promise<void> is_there;
    std::promise<std::size_t> ended;
    const auto end = [&, text = std::string(100, 'x')](const jaus::Event &event) {
        if (event.kind() == JausEventKind_Report) {
            // The first report may come before the subscription is in its place.
            is_there.get_future().wait();
            speeds = jaus::Subscription();
            ended.set_value(text.size());
        }
    };
    speeds = client.subscribe(sensor.address(), messages::velocity_query(), 0, end);
    is_there.set_value();
    require(ended.get_future().get() == 100, "what the callback holds is whole");
    require(speeds.id() == 0, "the subscription is gone");
}

void functions_that_are_missing_are_errors_or_make_events() {
    jaus::Node node = loopback(101);
    jaus::Component component(node, 44, JAUS_KIND_VEHICLE, "Rover");
    auto service = component.offer("urn:example:Lamp", 1, 0);
    require(status_of([&] { service.answer(0x2404, nullptr); }) == JausStatus_NullPointer, "answer");
    require(status_of([&] { service.on_stop(nullptr); }) == JausStatus_NullPointer, "stop");
    component.on_discovery(nullptr).on_standing(nullptr).start();
    jaus::Component other(node, 45, JAUS_KIND_VEHICLE, "Rover");
    other.start();
    require(component.next_event(jaus::Milliseconds(10000)).has_value(), "an event in time");
}

void a_pressed_stop_is_an_emergency_until_it_is_released() {
    jaus::Node node = loopback(101);
    jaus::Component driver(node, 33, JAUS_KIND_VEHICLE, "Rover");
    driver.management().start();
    const auto reaches = [&](std::uint8_t state) {
        for (int tries = 0; tries < 1000 && driver.standing().first != state; ++tries) {
            std::this_thread::sleep_for(jaus::Milliseconds(10));
        }
        return driver.standing().first == state;
    };
    const auto before = driver.standing().first;
    driver.set_condition(JAUS_CONDITION_STOPPED);
    require(reaches(JAUS_STATE_EMERGENCY), "stopped");
    driver.set_condition(JAUS_CONDITION_STOP_RELEASED);
    require(reaches(before), "released");
}

void time_limits_that_are_too_long_are_the_longest() {
    using jaus::detail::milliseconds;
    require(milliseconds<std::uint32_t>(std::chrono::hours(1200)) == UINT32_MAX, "too long");
    require(milliseconds<std::uint32_t>(jaus::Milliseconds(-1)) == 0, "negative");
    require(milliseconds<std::int32_t>(std::chrono::hours(600)) == INT32_MAX, "too long");
    require(milliseconds<std::int32_t>(jaus::Milliseconds(-1)) == -1, "for ever");
}

} // namespace

int main() {
    a_callback_may_destroy_its_subscription_and_is_whole_until_it_returns();
    functions_that_are_missing_are_errors_or_make_events();
    time_limits_that_are_too_long_are_the_longest();
    errors_are_thrown();
    a_pressed_stop_is_an_emergency_until_it_is_released();
    an_unsafe_driver_does_not_start();
    a_callback_answers_and_may_not_wait();
    handlers_live_as_long_as_the_library_may_call_them();
    a_subscription_brings_its_events_and_ends();
    return 0;
}
