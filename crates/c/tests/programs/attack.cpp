// Calls as a careless or hostile program makes them: callbacks that free what they belong to, frees on
// several threads at once, texts, lengths and rates that make no sense. Nothing crashes, and no callback
// runs after what it belongs to is freed.
#include "messages.hpp"

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <future>
#include <iostream>
#include <limits>
#include <thread>

namespace {

void require(bool holds, const char *what) {
    if (!holds) {
        std::cerr << "not so: " << what << " (" << jaus_last_error() << ")" << std::endl;
        std::exit(1);
    }
}

bool is_one_of(JausStatus status, std::initializer_list<JausStatus> expected) {
    return std::find(expected.begin(), expected.end(), status) != expected.end();
}

jaus::Node loopback() {
    jaus::Node node(101, 1);
    node.loopback().group("off").start();
    return node;
}

JausComponent created(const jaus::Node &node, std::uint8_t number) {
    JausComponent component{};
    jaus::check(
        jaus_component_create(node.get(), number, JAUS_KIND_VEHICLE, "Rover", &component));
    return component;
}

jaus::Component sensor_on(jaus::Node &node) {
    jaus::Component sensor(node, 44, JAUS_KIND_VEHICLE, "Rover");
    sensor.offer("urn:jaus:jss:mobility:VelocityStateSensor", 1, 1)
        .publish(messages::QueryVelocityState::kCode)
        .decline(messages::QueryVelocityStateExt::kCode);
    sensor.start();
    sensor.publish(messages::velocity(0.5));
    return sensor;
}

jaus::Component driver_on(jaus::Node &node) {
    jaus::Component driver(node, 33, JAUS_KIND_VEHICLE, "Rover");
    driver.management();
    driver.offer("urn:jaus:jss:mobility:PrimitiveDriver", 1, 1)
        .command(messages::SetWrenchEffort::kCode, [](const jaus::Event &) {})
        .decline(messages::QueryWrenchEffort::kCode)
        .on_stop([] {});
    driver.start();
    return driver;
}

// What a callback gets: it belongs to an object that is freed at some time.
struct Watch {
    std::atomic<bool> is_freed{false};
    std::atomic<int> calls{0};
    std::atomic<int> late{0};

    static void call(void *user, const JausEvent *) {
        auto &watch = *static_cast<Watch *>(user);
        ++watch.calls;
        if (watch.is_freed) {
            ++watch.late;
        }
    }
};

void a_callback_cannot_free_its_component_or_node() {
    jaus::Node node = loopback();
    jaus::Component client(node, 1, JAUS_KIND_OPERATOR_CONTROL_UNIT, "Client");
    client.start();
    jaus::Component sensor(node, 44, JAUS_KIND_VEHICLE, "Rover");
    JausStatus of_component = JausStatus_Ok, of_node = JausStatus_Ok, of_start = JausStatus_Ok;
    const JausComponent itself = sensor.get();
    sensor.offer("urn:jaus:jss:mobility:VelocityStateSensor", 1, 1)
        .answer(messages::QueryVelocityState::kCode,
                [&](const jaus::Event &) -> std::optional<jaus::Octets> {
                    of_component = jaus_component_free(itself);
                    of_node = jaus_node_free(node.get());
                    of_start = jaus_component_start(itself);
                    return messages::velocity(1);
                })
        .decline(messages::QueryVelocityStateExt::kCode);
    sensor.start();
    const auto answer = client.query(sensor.address(), messages::velocity_query());
    require(answer == messages::velocity(1), "the callback answers all the same");
    require(of_component == JausStatus_WrongThread, "a component in its callback");
    require(of_node == JausStatus_WrongThread, "a node in a callback");
    require(of_start == JausStatus_WrongThread, "a start in a callback");
}

struct Freed {
    std::promise<JausControl> control;
    std::promise<JausStatus> status;
    bool is_done = false;

    static void call(void *user, const JausEvent *) {
        auto &freed = *static_cast<Freed *>(user);
        if (!freed.is_done) {
            freed.is_done = true;
            freed.status.set_value(jaus_control_free(freed.control.get_future().get()));
        }
    }
};

void a_callback_can_free_its_control() {
    jaus::Node node = loopback();
    jaus::Component driver = driver_on(node);
    jaus::Component client(node, 1, JAUS_KIND_OPERATOR_CONTROL_UNIT, "Client");
    client.start();
    Freed freed;
    JausControl control{};
    jaus::check(jaus_component_control(client.get(), driver.address(), 127, Freed::call, &freed,
                                       &control));
    freed.control.set_value(control);
    require(freed.status.get_future().get() == JausStatus_Ok, "control in its callback");
    require(jaus_control_free(control) == JausStatus_InvalidHandle, "it is free");
    // The peer has no client in control any more.
    client.control(driver.address(), 1).release();
}

void a_free_component_calls_no_callback_of_a_subscription_that_is_being_made() {
    jaus::Node node = loopback();
    jaus::Component sensor = sensor_on(node);
    std::atomic<bool> is_done{false};
    std::thread publisher([&] {
        for (double speed = 0; !is_done; speed = speed < 9 ? speed + 0.1 : 0) {
            sensor.publish(messages::velocity(speed));
            std::this_thread::yield();
        }
    });
    const auto query = messages::velocity_query();
    const JausAddress peer = sensor.address();
    for (int turn = 0; turn < 60; ++turn) {
        Watch watch;
        const JausComponent client = created(node, 1);
        jaus::check(jaus_component_start(client));
        std::thread subscriber([&] {
            JausSubscription subscription{};
            const auto status =
                jaus_component_subscribe(client, peer, query.data(), query.size(), 0, 0, 0,
                                         Watch::call, &watch, &subscription);
            require(is_one_of(status, {JausStatus_Ok, JausStatus_Stopped, JausStatus_InvalidHandle,
                                       JausStatus_NotSent, JausStatus_Refused}),
                    "a subscription of a component that is freed");
        });
        std::this_thread::sleep_for(std::chrono::microseconds(turn * 50));
        require(jaus_component_free(client) == JausStatus_Ok, "the component is freed");
        watch.is_freed = true;
        subscriber.join();
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        require(watch.late == 0, "no callback of a free component");
    }
    is_done = true;
    publisher.join();
}

void a_component_is_freed_while_its_subscriptions_are() {
    jaus::Node node = loopback();
    jaus::Component sensor = sensor_on(node);
    for (int turn = 0; turn < 10; ++turn) {
        std::vector<Watch> watches(16);
        const JausComponent client = created(node, 1);
        jaus::check(jaus_component_start(client));
        std::vector<JausSubscription> subscriptions;
        for (auto &watch : watches) {
            // A component subscribes once to each query.
            messages::QueryVelocityState wanted;
            wanted.presence_vector = static_cast<std::uint16_t>(subscriptions.size() + 1);
            const auto query = *jaus::codec::encode(wanted);
            JausSubscription made{};
            jaus::check(jaus_component_subscribe(client, sensor.address(), query.data(),
                                                 query.size(), 0, 0, 0, Watch::call, &watch,
                                                 &made));
            subscriptions.push_back(made);
        }
        std::thread freeing([&] {
            for (const auto subscription : subscriptions) {
                require(is_one_of(jaus_subscription_free(subscription),
                                  {JausStatus_Ok, JausStatus_InvalidHandle}),
                        "a subscription is freed once");
            }
        });
        require(jaus_component_free(client) == JausStatus_Ok, "the component is freed");
        freeing.join();
        for (auto &watch : watches) {
            watch.is_freed = true;
        }
        sensor.publish(messages::velocity(turn));
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        for (const auto &watch : watches) {
            require(watch.late == 0, "no callback after the end");
        }
    }
}

void a_node_is_freed_while_its_components_are() {
    for (int turn = 0; turn < 60; ++turn) {
        JausNode node{};
        jaus::check(jaus_node_create(101, 1, &node));
        std::vector<JausComponent> components;
        for (std::uint8_t number = 1; number <= 40; ++number) {
            JausComponent component{};
            jaus::check(
                jaus_component_create(node, number, JAUS_KIND_VEHICLE, "Rover", &component));
            components.push_back(component);
        }
        std::atomic<int> freed{0};
        const auto free_all = [&] {
            for (const auto component : components) {
                const auto status = jaus_component_free(component);
                freed += status == JausStatus_Ok;
                require(is_one_of(status, {JausStatus_Ok, JausStatus_InvalidHandle}),
                        "a component is freed once");
            }
        };
        std::thread one(free_all), other(free_all);
        require(jaus_node_free(node) == JausStatus_Ok, "the node is freed");
        one.join();
        other.join();
        require(freed <= 40, "no component twice");
        for (const auto component : components) {
            require(jaus_component_free(component) == JausStatus_InvalidHandle, "none is left");
        }
    }
}

void texts_that_make_no_sense_are_errors() {
    jaus::Node node(101, 1);
    node.loopback().group("off");
    const std::string long_text(1 << 20, 'x');
    JausAddress address{};
    JausService service{};
    JausComponent made{};
    JausNode other{};
    for (const char *text : {"\xFF", "\xC0\x80", "\xED\xA0\x80", "urn:\xF5\x80\x80\x80"}) {
        const JausComponent component = created(node, 1);
        const JausStatus statuses[] = {
            jaus_node_use_interface(node.get(), text),
            jaus_node_use_group(node.get(), text),
            jaus_node_add_peer(node.get(), text),
            jaus_node_serve_host(node.get(), text),
            jaus_node_of_host(text, &other),
            jaus_component_create(node.get(), 1, JAUS_KIND_VEHICLE, text, &made),
            jaus_component_offer(component, text, 1, 0, &service),
            jaus_component_find(component, text, 1, &address),
        };
        for (const auto status : statuses) {
            require(status == JausStatus_InvalidText, "a text that is not UTF-8");
        }
        jaus_component_free(component);
    }
    require(jaus_node_use_group(node.get(), long_text.c_str()) == JausStatus_InvalidArgument,
            "a long group");
    require(jaus_node_add_peer(node.get(), long_text.c_str()) == JausStatus_InvalidArgument,
            "a long peer");
    node.start();
    for (const std::string &text : {std::string(), long_text, std::string("a\nb\x01")}) {
        JausComponent named{};
        jaus::check(
            jaus_component_create(node.get(), 7, JAUS_KIND_VEHICLE, text.c_str(), &named));
        if (jaus_component_offer(named, text.c_str(), 255, 255, &service) == JausStatus_Ok) {
            jaus_service_decline(service, 0);
        }
        const auto started = jaus_component_start(named);
        require(is_one_of(started,
                          {JausStatus_Ok, JausStatus_NotStarted, JausStatus_Unsafe}),
                "a component with an odd name and service");
        if (started == JausStatus_Ok) {
            require(jaus_component_find(named, text.c_str(), 1, &address) == JausStatus_NotFound,
                    "nobody else offers it");
        }
        require(jaus_component_free(named) == JausStatus_Ok, "it is freed");
    }
}

void lengths_and_numbers_that_make_no_sense_are_errors() {
    jaus::Node node = loopback();
    jaus::Component sensor = sensor_on(node);
    jaus::Component client(node, 1, JAUS_KIND_OPERATOR_CONTROL_UNIT, "Client");
    client.start();
    const auto query = messages::velocity_query();
    const JausAddress peer = sensor.address();
    JausSubscription subscription{};
    JausMessage answer{};
    JausControl control{};
    for (const std::size_t length :
         {std::size_t(0), std::size_t(1), (std::size_t(16) << 20) + 1, SIZE_MAX / 2, SIZE_MAX}) {
        const JausStatus statuses[] = {
            jaus_component_publish(sensor.get(), query.data(), length),
            jaus_component_query(client.get(), peer, query.data(), length, 0, 1, &answer),
            jaus_component_send(client.get(), peer, 1, query.data(), length),
            jaus_component_deliver(client.get(), peer, 1, query.data(), length),
            jaus_component_subscribe(client.get(), peer, query.data(), length, 0, 1, 0, nullptr,
                                     nullptr, &subscription),
            jaus_answer_set(nullptr, query.data(), length),
        };
        for (const auto status : statuses) {
            require(is_one_of(status, {JausStatus_InvalidArgument, JausStatus_NullPointer}),
                    "a length");
        }
    }
    const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
    for (const double rate : {nan, -infinity, -1.0, infinity, 1e300, 5e-324}) {
        const auto status =
            jaus_component_subscribe(client.get(), peer, query.data(), query.size(), 0, rate, 0,
                                     nullptr, nullptr, &subscription);
        if (!(rate > 0)) {
            require(status == JausStatus_InvalidArgument, "a rate that is no number above 0");
        }
        if (status == JausStatus_Ok) {
            require(jaus_subscription_free(subscription) == JausStatus_Ok, "it is freed");
        }
    }
    require(jaus_component_subscribe(client.get(), peer, query.data(), query.size(), 0, 1, nan,
                                     nullptr, nullptr, &subscription) ==
                JausStatus_InvalidArgument,
            "a least rate that is no number");
    const JausAddress all = {65535, 255, 255}, none = {0, 0, 0};
    for (const auto address : {all, none}) {
        require(jaus_component_control(client.get(), address, 1, nullptr, nullptr, &control) ==
                    JausStatus_InvalidArgument,
                "control of all or of none");
    }
    require(jaus_component_send(client.get(), peer, 4, query.data(), query.size()) ==
                JausStatus_InvalidArgument,
            "a priority");
    require(jaus_component_set_condition(client.get(), 5) == JausStatus_InvalidArgument,
            "a condition");
}

} // namespace

int main() {
    a_callback_cannot_free_its_component_or_node();
    a_callback_can_free_its_control();
    a_free_component_calls_no_callback_of_a_subscription_that_is_being_made();
    a_component_is_freed_while_its_subscriptions_are();
    a_node_is_freed_while_its_components_are();
    texts_that_make_no_sense_are_errors();
    lengths_and_numbers_that_make_no_sense_are_errors();
    return 0;
}
