// A component of JAUS++'s core and mobility libraries for the interoperability suite: a vehicle, an echo, or a
// client that does one thing. ../../README.md describes its commands.

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <jaus/core/control/querycontrol.h>
#include <jaus/core/control/reportcontrol.h>

#include "component.h"
#include "vehicle.h"

// The commit of the library and the origin of CxUtils, set by the build.
#ifndef PEER_VERSION
#define PEER_VERSION "version not known"
#endif

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

// Rate of the periodic reports, and the least that is accepted.
constexpr double HZ = 10;
constexpr double LEAST_HZ = 1;
// Reports that prove a subscription, and different ones that prove one on change.
constexpr unsigned ENOUGH = 10;
constexpr unsigned CHANGES = 3;
// Authority codes of the two clients.
constexpr JAUS::Byte WEAKER = 100;
constexpr JAUS::Byte STRONGER = 200;
// Effort in percent, and the least speed that counts as motion in m/s.
constexpr double EFFORT = 60;
constexpr double MOTION = 0.1;
// Interval of the commands and of most checks.
constexpr auto BEAT = 100ms;
// Interval of the messages of `keep-echo`.
constexpr auto ECHO_BEAT = 200ms;
// Time without an answer after which a possibly lost message is sent again.
constexpr auto AGAIN = 3s;
// Timeout of one query, in ms.
constexpr unsigned WAIT = 1000;

// Counts the velocity reports of a producer.
class Reports : public JAUS::Events::Callback {
public:
    explicit Reports(const JAUS::Address& from) : from_(from) {}

    void ProcessEvent(JAUS::Events::Type, JAUS::Byte, JAUS::Byte, const JAUS::Message* message) override
    {
        const auto* report = dynamic_cast<const JAUS::ReportVelocityState*>(message);
        if (!report || report->GetSourceID() != from_)
            return;
        if (count == 0 || report->GetVelocityX() != velocity)
            ++changes;
        velocity = report->GetVelocityX();
        ++count;
    }

    std::atomic<unsigned> count{0};
    std::atomic<unsigned> changes{0};
    std::atomic<double> velocity{0};

private:
    const JAUS::Address from_;
};

class LossOfControl : public JAUS::AccessControl::Callback {
public:
    void ProcessLossOfControl(const JAUS::Address& component) override
    {
        if (component == of)
            is_lost = true;
    }

    JAUS::Address of;
    std::atomic<bool> is_lost{false};
};

[[noreturn]] void echo(const JAUS::Address& id)
{
    JAUS::Component component;
    Listener listener([&](const TestMessage& message) {
        TestMessage back(message);
        back.SwapSourceAndDestination();
        back.SetSourceID(id);
        const bool is_sent = component.Send(&back);
        say(std::to_string(back.body.size() + JAUS::USHORT_SIZE) + (is_sent ? " octets" : " octets, not sent back"));
    });
    component.TransportService()->RegisterCallback(TEST_CODE, &listener);
    start(component, id, JAUS::Subsystem::OtherSubsystem);
    say("listening");
    for (;;)
        std::this_thread::sleep_for(1h);
}

// ---- the acting side

// A client of one other component.
class Client {
public:
    Client(const JAUS::Address& id, const JAUS::Address& other, Clock::time_point deadline)
        : id_(id), other_(other), deadline_(deadline)
    {
        component.AccessControlService()->SetAuthorityCode(WEAKER);
        // What a component without such a sensor cannot read by itself.
        component.TransportService()->AddMessageTemplate(new JAUS::ReportVelocityState());
    }

    bool has_time() const { return Clock::now() < deadline_; }

    // Looks again and again until it is so.
    void wait_until(const std::function<bool()>& is_so, const std::string& otherwise)
    {
        while (!is_so()) {
            require(has_time(), otherwise);
            std::this_thread::sleep_for(BEAT);
        }
    }

    // Starts the component, which must have all its callbacks by now.
    void begin() { start(component, id_, JAUS::Subsystem::OCU); }

    // Starts it, and waits until the library's discovery has the services of the other component.
    void find()
    {
        begin();
        wait_until([&] { return !services().empty(); }, other_.ToString() + " was not found");
    }

    void discover()
    {
        find();
        say(other_.ToString());
        for (const auto& service : services())
            say(service.mName);
    }

    double velocity()
    {
        JAUS::QueryVelocityState query(other_, id_);
        query.SetPresenceVector(JAUS::ReportVelocityState::PresenceVector::VelocityX);
        JAUS::ReportVelocityState report;
        wait_until([&] { return component.Send(&query, &report, WAIT); }, "the velocity was not reported");
        require(report.IsFieldPresent(JAUS::ReportVelocityState::PresenceVector::VelocityX),
                "a report without the velocity");
        return report.GetVelocityX();
    }

    bool subscribe(bool is_periodic)
    {
        JAUS::QueryVelocityState query(other_, id_);
        query.SetPresenceVector(JAUS::ReportVelocityState::PresenceVector::VelocityX);
        JAUS::Events& events = *component.EventsService();
        return is_periodic ? events.RequestPeriodicEvent(other_, &query, HZ, LEAST_HZ, WAIT)
                           : events.RequestEveryChangeEvent(other_, &query, WAIT);
    }

    void unsubscribe() { component.EventsService()->CancelSubscription(other_, JAUS::REPORT_VELOCITY_STATE, WAIT); }

    void take_control()
    {
        wait_until([&] { return component.AccessControlService()->RequestComponentControl(other_, false, WAIT); },
                   "control was not granted");
        wait_until([&] { return component.ManagementService()->Resume(other_, WAIT); }, "it does not become ready");
    }

    // Sends an effort until something has happened.
    void push_until(const std::function<bool()>& has_happened, const std::string& otherwise)
    {
        wait_until(
            [&] {
                push(EFFORT);
                return has_happened();
            },
            otherwise);
    }

    void stop()
    {
        push(0);
        component.ManagementService()->Standby(other_, WAIT);
        component.AccessControlService()->ReleaseComponentControl(other_, WAIT);
    }

    // The component in control of the other one.
    JAUS::Address controller()
    {
        JAUS::QueryControl query(other_, id_);
        JAUS::ReportControl report;
        wait_until([&] { return component.Send(&query, &report, WAIT); }, "the controller was not reported");
        return report.GetControllingComponent();
    }

    JAUS::Component component;

private:
    std::set<JAUS::Service::ID> services() const
    {
        const JAUS::Subsystem::Ptr subsystem = component.DiscoveryService()->GetSubsystem(other_);
        const JAUS::Subsystem::Component* found = subsystem ? subsystem->GetComponent(other_) : nullptr;
        return found ? found->mServices : std::set<JAUS::Service::ID>();
    }

    void push(double percent)
    {
        JAUS::SetWrenchEffort command(other_, id_);
        command.SetPropulsiveLinearEffortX(percent);
        component.Send(&command);
    }

    const JAUS::Address id_;
    const JAUS::Address other_;
    const Clock::time_point deadline_;
};

[[noreturn]] void subscribe_periodic(Client& client, const JAUS::Address& other)
{
    Reports reports(other);
    client.component.EventsService()->RegisterCallback(&reports);
    client.find();
    client.wait_until([&] { return client.subscribe(true); }, "the event was not confirmed");
    client.wait_until([&] { return reports.count >= ENOUGH; }, "too few reports");
    client.unsubscribe();
    leave(0);
}

[[noreturn]] void subscribe_on_change(Client& client, const JAUS::Address& other)
{
    Reports reports(other);
    client.component.EventsService()->RegisterCallback(&reports);
    client.find();
    client.wait_until([&] { return client.subscribe(false); }, "the event was not confirmed");
    client.take_control();
    client.push_until([&] { return reports.changes >= CHANGES; }, "too few reports");
    client.stop();
    client.unsubscribe();
    leave(0);
}

// Takes control, and loses it to a component with more authority, which releases it.
[[noreturn]] void control(Client& client, const JAUS::Address& id, const JAUS::Address& other,
                          Clock::time_point deadline)
{
    LossOfControl loss;
    loss.of = other;
    client.component.AccessControlService()->RegisterCallback(&loss);
    const JAUS::Address colleague_id(id.mSubsystem, id.mNode, id.mComponent + 1);
    Client colleague(colleague_id, other, deadline);
    colleague.component.AccessControlService()->SetAuthorityCode(STRONGER);
    client.find();
    colleague.find();
    client.take_control();
    require(client.controller() == id, "another component is reported to be in control");
    colleague.take_control();
    client.wait_until([&] { return loss.is_lost.load(); }, "the loss of control was not reported");
    require(client.controller() == colleague_id, "the stronger component is not reported to be in control");
    colleague.stop();
    client.wait_until([&] { return client.controller().mSubsystem == 0; }, "control was not released");
    leave(0);
}

[[noreturn]] void drive(Client& client)
{
    client.find();
    client.take_control();
    client.push_until([&] { return client.velocity() > MOTION; }, "it does not move");
    client.stop();
    leave(0);
}

[[noreturn]] void keep(Client& client, const JAUS::Address& other)
{
    Reports reports(other);
    client.component.EventsService()->RegisterCallback(&reports);
    client.find();
    auto last = Clock::now() - AGAIN;
    unsigned count = 0;
    for (;;) {
        if (reports.count != count) {
            count = reports.count;
            last = Clock::now();
            say("report: " + std::to_string(reports.velocity) + " m/s");
        } else if (Clock::now() - last >= AGAIN) {
            // The library takes a subscription for alive that the producer has lost with a restart.
            last = Clock::now();
            client.unsubscribe();
            client.subscribe(true);
        }
        std::this_thread::sleep_for(BEAT);
    }
}

// Sends test messages to a component, and waits for them to come back.
class Sender {
public:
    Sender(Client& client, const JAUS::Address& id, const JAUS::Address& other)
        : client_(client), id_(id), other_(other), listener_([this](const TestMessage& message) { hear(message); })
    {
        client.component.TransportService()->RegisterCallback(TEST_CODE, &listener_);
        // An echo need not have services: its address is known once it has sent anything.
        client.begin();
    }

    // False if nothing of this size comes back in time.
    bool there_and_back(std::size_t size)
    {
        const TestMessage message = test(size, other_, id_);
        {
            std::lock_guard<std::mutex> lock(mutex_);
            wanted_ = message.body;
            has_returned_ = has_changed_ = false;
        }
        client_.component.Send(&message);
        for (const auto end = Clock::now() + AGAIN; Clock::now() < end; std::this_thread::sleep_for(1ms)) {
            std::lock_guard<std::mutex> lock(mutex_);
            require(!has_changed_, "what came back is not the same");
            if (has_returned_)
                return true;
        }
        return false;
    }

private:
    void hear(const TestMessage& message)
    {
        std::lock_guard<std::mutex> lock(mutex_);
        if (message.GetSourceID() != other_ || message.body.size() != wanted_.size())
            return;
        has_returned_ = message.body == wanted_;
        has_changed_ = !has_returned_;
    }

    Client& client_;
    const JAUS::Address id_;
    const JAUS::Address other_;
    std::mutex mutex_;
    Octets wanted_;
    bool has_returned_ = false;
    bool has_changed_ = false;
    Listener listener_;
};

[[noreturn]] void large(Client& client, const JAUS::Address& id, const JAUS::Address& other, std::size_t size)
{
    Sender sender(client, id, other);
    for (const std::size_t each : {GREETING, size}) {
        while (!sender.there_and_back(each)) {
            require(client.has_time(), std::to_string(each) + " octets did not come back");
            say("nothing came back yet");
        }
    }
    say(std::to_string(size) + " octets there and back");
    leave(0);
}

[[noreturn]] void keep_echo(Client& client, const JAUS::Address& id, const JAUS::Address& other)
{
    Sender sender(client, id, other);
    for (;;) {
        say(sender.there_and_back(GREETING) ? "report: it came back" : "nothing came back");
        std::this_thread::sleep_for(ECHO_BEAT);
    }
}

[[noreturn]] void act(const std::string& act, const std::vector<std::string>& words)
{
    const JAUS::Address id = address(words.at(1)), other = address(words.at(2));
    const auto time = words.size() > 3 ? std::chrono::seconds(std::stoul(words[3])) : std::chrono::seconds(24h);
    const auto deadline = Clock::now() + time;
    Client client(id, other, deadline);
    if (act == "discover") {
        client.discover();
    } else if (act == "query") {
        client.find();
        say(std::to_string(client.velocity()) + " m/s");
    } else if (act == "subscribe-periodic") {
        subscribe_periodic(client, other);
    } else if (act == "subscribe-on-change") {
        subscribe_on_change(client, other);
    } else if (act == "control") {
        control(client, id, other, deadline);
    } else if (act == "drive") {
        drive(client);
    } else if (act == "keep") {
        keep(client, other);
    } else if (act == "keep-echo") {
        keep_echo(client, id, other);
    } else if (act == "large") {
        large(client, id, other, std::stoul(words.at(4)));
    } else {
        throw std::runtime_error("there is no act " + act);
    }
    leave(0);
}

void run(const std::vector<std::string>& words)
{
    require(!words.empty(), "version | vehicle ID | echo ID | ACT ID OTHER [SECONDS [SIZE]]");
    if (words[0] == "version")
        say(PEER_VERSION);
    else if (words[0] == "vehicle")
        vehicle(address(words.at(1)));
    else if (words[0] == "echo")
        echo(address(words.at(1)));
    else
        act(words[0], words);
}

} // namespace

int main(int count, char** words)
{
    try {
        run(std::vector<std::string>(words + 1, words + count));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "jauspp-peer: %s\n", error.what());
        leave(1);
    }
    leave(0);
}
