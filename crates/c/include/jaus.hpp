// C++17 over the C interface of jaus (jaus.h): objects that free themselves, errors as exceptions,
// callbacks as functions. Header only. SPDX-License-Identifier: MIT OR Apache-2.0
//
// Messages are octets, from their message code. Callbacks run on the library's thread, must return
// within 500 ms, and must not throw: an exception that leaves a callback ends the program. So does a
// callback that destroys its component or node. It may destroy its subscription or control.
#ifndef JAUS_HPP
#define JAUS_HPP

#include "jaus.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace jaus {

/// A message, from its message code.
using Octets = std::vector<std::uint8_t>;
using Milliseconds = std::chrono::milliseconds;

/// A call that failed; what() is the reason in words.
class Error : public std::runtime_error {
public:
    Error(JausStatus status, const char *text) : std::runtime_error(text), status_(status) {}

    JausStatus status() const noexcept { return status_; }

private:
    JausStatus status_;
};

/// Throws if a call of the C interface has failed.
inline void check(JausStatus status) {
    if (status != JausStatus_Ok) {
        throw Error(status, jaus_last_error());
    }
}

/// Writes the library's log to standard error: 1 errors, 2 also warnings, 3 also the course of events, 4
/// also details.
inline void log_to_stderr(std::uint8_t level) { check(jaus_log_to_stderr(level)); }

/// The address of a component, such as 101.1.33.
struct Address : JausAddress {
    Address() : JausAddress{0, 0, 0} {}
    Address(JausAddress address) : JausAddress(address) {}
    Address(std::uint16_t of_subsystem, std::uint8_t of_node, std::uint8_t of_component)
        : JausAddress{of_subsystem, of_node, of_component} {}

    std::string text() const {
        return std::to_string(subsystem) + '.' + std::to_string(node) + '.' +
               std::to_string(component);
    }
};

inline bool operator==(const Address &one, const Address &other) noexcept {
    return one.subsystem == other.subsystem && one.node == other.node &&
           one.component == other.component;
}

inline bool operator!=(const Address &one, const Address &other) noexcept {
    return !(one == other);
}

/// An event, for the time of a callback or until the next event is fetched.
class Event {
public:
    explicit Event(const JausEvent &event) noexcept : event_(&event) {}

    JausEventKind kind() const noexcept { return event_->kind; }
    Address source() const { return event_->source; }
    /// The id of the subscription or of the control.
    std::uint64_t subject() const noexcept { return event_->subject; }
    /// A state, JAUS_STATE_...
    std::uint8_t value() const noexcept { return event_->value; }
    const std::uint8_t *data() const noexcept { return event_->data; }
    std::size_t size() const noexcept { return event_->length; }
    /// A copy of the message.
    Octets message() const { return size() == 0 ? Octets() : Octets(data(), data() + size()); }
    /// The reason of an outage or a loss.
    const char *text() const noexcept { return event_->text; }
    /// Seconds since the report arrived.
    double age() const noexcept { return event_->age; }
    double rate() const noexcept { return event_->rate; }
    /// Reports lost in transit so far.
    std::uint64_t lost() const noexcept { return event_->lost; }

private:
    const JausEvent *event_;
};

using EventHandler = std::function<void(const Event &)>;
using AnswerHandler = std::function<std::optional<Octets>(const Event &)>;
using StopHandler = std::function<void()>;

namespace detail {

inline void call_event(void *user, const JausEvent *event) noexcept {
    (*static_cast<EventHandler *>(user))(Event(*event));
}

inline void call_answer(void *user, const JausEvent *query, JausAnswer *answer) noexcept {
    const std::optional<Octets> report = (*static_cast<AnswerHandler *>(user))(Event(*query));
    if (report) {
        // A report without a code is none: the query stays without an answer.
        static_cast<void>(jaus_answer_set(answer, report->data(), report->size()));
    }
}

inline void call_stop(void *user) noexcept { (*static_cast<StopHandler *>(user))(); }

/// Functions that live as long as the library may call them.
class Kept {
public:
    template <typename Handler> Handler *keep(Handler handler) {
        auto kept = std::make_shared<Handler>(std::move(handler));
        handlers_.push_back(kept);
        return kept.get();
    }

private:
    std::vector<std::shared_ptr<void>> handlers_;
};

/// A handle that is freed once, and the functions that the library may call until then.
template <typename Handle, JausStatus (*Free)(Handle), typename Handlers = std::nullptr_t>
class Owned {
public:
    Owned() noexcept = default;
    explicit Owned(Handle handle, Handlers handlers = Handlers()) noexcept
        : handlers_(std::move(handlers)), handle_(handle) {}
    Owned(Owned &&other) noexcept
        : handlers_(std::move(other.handlers_)), handle_(std::exchange(other.handle_, Handle{})) {}
    Owned &operator=(Owned &&other) noexcept {
        if (this != &other) {
            reset();
            handlers_ = std::move(other.handlers_);
            handle_ = std::exchange(other.handle_, Handle{});
        }
        return *this;
    }
    Owned(const Owned &) = delete;
    Owned &operator=(const Owned &) = delete;
    ~Owned() { reset(); }

    Handle get() const noexcept { return handle_; }
    const Handlers &handlers() const noexcept { return handlers_; }

    void reset() noexcept {
        const Handle handle = std::exchange(handle_, Handle{});
        // Otherwise it fails only if the owner was freed before, and this with it.
        if (handle.id != 0 && Free(handle) == JausStatus_WrongThread) {
            // A callback destroys its component or node, whose functions the library would still call.
            std::terminate();
        }
    }

private:
    Handlers handlers_{};
    Handle handle_{};
};

/// The function of a subscription or of control. A call shares it, because the function may destroy the
/// object that owns it.
using Handler = std::unique_ptr<std::shared_ptr<EventHandler>>;

inline void call_shared(void *user, const JausEvent *event) noexcept {
    const auto handler = *static_cast<const std::shared_ptr<EventHandler> *>(user);
    (*handler)(Event(*event));
}

/// The callback for a handler, if there is one.
inline JausEventCallback callback_of(const Handler &handler) {
    return handler ? call_shared : nullptr;
}

inline Handler keep(EventHandler handler) {
    if (!handler) {
        return nullptr;
    }
    auto shared = std::make_shared<EventHandler>(std::move(handler));
    return std::make_unique<std::shared_ptr<EventHandler>>(std::move(shared));
}

/// A time limit of the C interface: the nearest that a type can hold.
template <typename Number> Number milliseconds(Milliseconds time) {
    using Limits = std::numeric_limits<Number>;
    const auto count = static_cast<std::int64_t>(time.count());
    return static_cast<Number>(
        std::clamp<std::int64_t>(count, Limits::min(), Limits::max()));
}

} // namespace detail

/// A node. Freeing it frees its components, so destroy components first.
class Node {
public:
    Node(std::uint16_t subsystem, std::uint8_t number) {
        JausNode node{};
        check(jaus_node_create(subsystem, number, &node));
        node_ = Owned(node);
    }

    /// The node of this host, which another process runs. It needs no start.
    static Node of_host(const std::string &address = "default") {
        JausNode node{};
        check(jaus_node_of_host(address.c_str(), &node));
        return Node(node);
    }

    Node &loopback() { return then(jaus_node_use_loopback(get())); }
    Node &interface(const std::string &name) {
        return then(jaus_node_use_interface(get(), name.c_str()));
    }
    Node &port(std::uint16_t port) { return then(jaus_node_use_port(get(), port)); }
    Node &group(const std::string &group) {
        return then(jaus_node_use_group(get(), group.c_str()));
    }
    Node &peer(const std::string &peer) { return then(jaus_node_add_peer(get(), peer.c_str())); }
    Node &serve_host(const std::string &address = "default") {
        return then(jaus_node_serve_host(get(), address.c_str()));
    }
    Node &start() { return then(jaus_node_start(get())); }

    JausNode get() const noexcept { return node_.get(); }

private:
    using Owned = detail::Owned<JausNode, jaus_node_free>;

    explicit Node(JausNode node) : node_(node) {}

    Node &then(JausStatus status) {
        check(status);
        return *this;
    }

    Owned node_;
};

/// A service of a component that has not started. Without a handler, messages are events of the
/// component, which next_event() fetches.
class Service {
public:
    Service(JausService service, std::shared_ptr<detail::Kept> kept)
        : service_(service), kept_(std::move(kept)) {}

    Service &answer(std::uint16_t query, AnswerHandler handler) {
        const auto callback = handler ? detail::call_answer : nullptr;
        auto *kept = kept_->keep(std::move(handler));
        return then(jaus_service_answer(service_, query, callback, kept));
    }
    Service &publish(std::uint16_t query) { return then(jaus_service_publish(service_, query)); }
    Service &decline(std::uint16_t query) { return then(jaus_service_decline(service_, query)); }
    Service &receive(std::uint16_t code, EventHandler handler = nullptr) {
        const auto [callback, user] = callback_of(std::move(handler));
        return then(jaus_service_receive(service_, code, callback, user));
    }
    Service &configure(std::uint16_t code, EventHandler handler = nullptr) {
        const auto [callback, user] = callback_of(std::move(handler));
        return then(jaus_service_configure(service_, code, callback, user));
    }
    Service &command(std::uint16_t code, EventHandler handler = nullptr,
                     std::uint8_t validity = JAUS_VALIDITY_BY_CODE) {
        const auto [callback, user] = callback_of(std::move(handler));
        return then(jaus_service_command(service_, code, validity, callback, user));
    }
    /// Stops everything that commands have started. Must not wait for anything that another handler
    /// holds: it also runs beside a handler that hangs.
    Service &on_stop(StopHandler handler) {
        const auto callback = handler ? detail::call_stop : nullptr;
        auto *kept = kept_->keep(std::move(handler));
        return then(jaus_service_on_stop(service_, callback, kept));
    }

private:
    Service &then(JausStatus status) {
        check(status);
        return *this;
    }

    std::pair<JausEventCallback, void *> callback_of(EventHandler handler) {
        if (!handler) {
            return {nullptr, nullptr};
        }
        return {detail::call_event, kept_->keep(std::move(handler))};
    }

    JausService service_;
    std::shared_ptr<detail::Kept> kept_;
};

/// A subscription, which ends when it is destroyed.
class Subscription {
public:
    JausSubscriptionState state() const {
        JausSubscriptionState state{};
        check(jaus_subscription_state(subscription_.get(), &state));
        return state;
    }
    std::uint64_t id() const noexcept { return subscription_.get().id; }

private:
    friend class Component;
    using Owned = detail::Owned<JausSubscription, jaus_subscription_free, detail::Handler>;

    Owned subscription_;
};

/// Control of a peer, which is released when it is destroyed.
class Control {
public:
    void resume() { check(jaus_control_resume(control_.get())); }
    void standby() { check(jaus_control_standby(control_.get())); }
    void send(const Octets &command, std::uint8_t priority = JAUS_PRIORITY_STANDARD) {
        check(jaus_control_send(control_.get(), priority, command.data(), command.size()));
    }
    void deliver(const Octets &command, std::uint8_t priority = JAUS_PRIORITY_STANDARD) {
        check(jaus_control_deliver(control_.get(), priority, command.data(), command.size()));
    }
    /// Throws if commands cannot be sent.
    void check_ready() { check(jaus_control_check(control_.get())); }
    /// Releases control when this object is not used for so long.
    void watch_program(Milliseconds limit) {
        const auto within = detail::milliseconds<std::uint32_t>(limit);
        check(jaus_control_watch_program(control_.get(), within));
    }
    void release() noexcept { control_.reset(); }
    std::uint64_t id() const noexcept { return control_.get().id; }

private:
    friend class Component;
    using Owned = detail::Owned<JausControl, jaus_control_free, detail::Handler>;

    Owned control_;
};

/// A component. Describe it, then start() it; it ends when it is destroyed.
class Component {
public:
    Component(Node &node, std::uint8_t number, std::uint16_t kind, const std::string &name) {
        auto kept = std::make_shared<detail::Kept>();
        JausComponent component{};
        check(jaus_component_create(node.get(), number, kind, name.c_str(), &component));
        component_ = Owned(component, std::move(kept));
    }

    Component &access_control(std::uint8_t authority = 1, std::uint8_t timeout_s = 4) {
        return then(jaus_component_use_access_control(get(), authority, timeout_s));
    }
    Component &management(std::uint8_t authority = 1, std::uint8_t timeout_s = 4,
                          bool initializes = false) {
        return then(jaus_component_use_management(get(), authority, timeout_s, initializes));
    }
    Service offer(const std::string &urn, std::uint8_t major, std::uint8_t minor) {
        JausService service{};
        check(jaus_component_offer(get(), urn.c_str(), major, minor, &service));
        return Service(service, component_.handlers());
    }
    Component &on_standing(EventHandler handler) {
        const auto callback = handler ? detail::call_event : nullptr;
        auto *handled = kept().keep(std::move(handler));
        return then(jaus_component_on_standing(get(), callback, handled));
    }
    Component &on_discovery(EventHandler handler) {
        const auto callback = handler ? detail::call_event : nullptr;
        auto *handled = kept().keep(std::move(handler));
        return then(jaus_component_on_discovery(get(), callback, handled));
    }
    Component &start() { return then(jaus_component_start(get())); }

    Address address() const {
        JausAddress address{};
        check(jaus_component_address(get(), &address));
        return address;
    }
    /// The state of the component, JAUS_STATE_..., and the client in control (0.0.0: nobody).
    std::pair<std::uint8_t, Address> standing() const {
        std::uint8_t state = 0;
        JausAddress controller{};
        check(jaus_component_standing(get(), &state, &controller));
        return {state, controller};
    }
    void set_condition(std::uint8_t condition) {
        check(jaus_component_set_condition(get(), condition));
    }
    void publish(const Octets &report) {
        check(jaus_component_publish(get(), report.data(), report.size()));
    }
    void changed(std::uint16_t query) { check(jaus_component_changed(get(), query)); }

    /// Readable while events wait.
    int descriptor() const {
        int descriptor = -1;
        check(jaus_component_descriptor(get(), &descriptor));
        return descriptor;
    }
    /// The next event, if there is one in time. It is valid until the next call. One thread at a time.
    std::optional<Event> next_event(Milliseconds timeout = Milliseconds(0)) {
        const JausEvent *event = nullptr;
        const auto limit = detail::milliseconds<std::int32_t>(timeout);
        check(jaus_component_next_event(get(), limit, &event));
        return event == nullptr ? std::nullopt : std::optional<Event>(Event(*event));
    }

    Address find(const std::string &urn, Milliseconds timeout = Milliseconds(10000)) const {
        JausAddress found{};
        const auto limit = detail::milliseconds<std::uint32_t>(timeout);
        check(jaus_component_find(get(), urn.c_str(), limit, &found));
        return found;
    }
    std::vector<Address> providers(const std::string &urn) const {
        std::vector<JausAddress> found;
        std::size_t count = 16;
        // More may become known between two calls.
        while (count > found.size()) {
            found.resize(count);
            check(jaus_component_providers(get(), urn.c_str(), found.data(), found.size(), &count));
        }
        found.resize(count);
        return std::vector<Address>(found.begin(), found.end());
    }
    /// The report that answers a query; its code is by the standard's numbers unless it is given.
    Octets query(Address peer, const Octets &query, Milliseconds timeout = Milliseconds(1500),
                 std::uint16_t report = 0) const {
        JausMessage answer{};
        check(jaus_component_query(get(), peer, query.data(), query.size(), report,
                                   detail::milliseconds<std::uint32_t>(timeout), &answer));
        const std::unique_ptr<JausMessage, void (*)(JausMessage *)> owned(&answer,
                                                                         jaus_message_free);
        return Octets(answer.data, answer.data + answer.length);
    }
    void send(Address destination, const Octets &message,
              std::uint8_t priority = JAUS_PRIORITY_STANDARD) {
        check(jaus_component_send(get(), destination, priority, message.data(), message.size()));
    }
    void deliver(Address destination, const Octets &message,
                 std::uint8_t priority = JAUS_PRIORITY_STANDARD) {
        check(jaus_component_deliver(get(), destination, priority, message.data(),
                                     message.size()));
    }
    void set_emergency(Address peer) { check(jaus_component_set_emergency(get(), peer)); }
    void clear_emergency(Address peer) { check(jaus_component_clear_emergency(get(), peer)); }

    /// Subscribes to the answers to a query, at a rate in hertz, or on every change (0). Without a
    /// handler, its events are those of the component.
    Subscription subscribe(Address peer, const Octets &query, double rate,
                           EventHandler handler = nullptr, double least = 0,
                           std::uint16_t report = 0) {
        auto kept = detail::keep(std::move(handler));
        JausSubscription created{};
        check(jaus_component_subscribe(get(), peer, query.data(), query.size(), report, rate, least,
                                       detail::callback_of(kept), kept.get(), &created));
        Subscription subscription;
        subscription.subscription_ = Subscription::Owned(created, std::move(kept));
        return subscription;
    }

    /// Requests control of a peer, and waits until it is granted. Without a handler, its events are
    /// those of the component.
    Control control(Address peer, std::uint8_t authority, EventHandler handler = nullptr) {
        auto kept = detail::keep(std::move(handler));
        JausControl created{};
        check(jaus_component_control(get(), peer, authority, detail::callback_of(kept), kept.get(),
                                     &created));
        Control control;
        control.control_ = Control::Owned(created, std::move(kept));
        return control;
    }

    JausComponent get() const noexcept { return component_.get(); }

private:
    using Owned =
        detail::Owned<JausComponent, jaus_component_free, std::shared_ptr<detail::Kept>>;

    Component &then(JausStatus status) {
        check(status);
        return *this;
    }

    detail::Kept &kept() { return *component_.handlers(); }

    Owned component_;
};

} // namespace jaus

#endif
