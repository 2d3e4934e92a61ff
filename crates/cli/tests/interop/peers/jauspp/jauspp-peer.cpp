// A component of JAUS++'s core and mobility libraries for the interoperability suite: a vehicle, an echo, or a
// client that does one thing. ../../README.md describes its commands.

#include <atomic>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include <unistd.h>

#include <jaus/core/component.h>
#include <jaus/core/control/querycontrol.h>
#include <jaus/core/control/reportcontrol.h>
#include <jaus/mobility/drivers/primitivedriver.h>
#include <jaus/mobility/sensors/globalposesensor.h>
#include <jaus/mobility/sensors/localposesensor.h>
#include <jaus/mobility/sensors/velocitystatesensor.h>

#include "../test-message.h"

// The commit of the library and the origin of CxUtils, set by the build.
#ifndef PEER_VERSION
#define PEER_VERSION "version not known"
#endif

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

// Update rate of the vehicle's sensors.
constexpr double VEHICLE_HZ = 25;
// Speed at full effort in m/s, and the change of speed in m/s².
constexpr double FASTEST = 2;
constexpr double ACCELERATION = 1.5;
// Turn rate at full effort, in rad/s.
constexpr double TURN = 0.5;
// Where the vehicle starts, in radians.
constexpr double LATITUDE = 0.6;
constexpr double LONGITUDE = -1.4;
constexpr double EARTH_RADIUS = 6371008.8;

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

void say(const std::string& line)
{
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
}

// Ends the process without the library's shutdown, which may fail after all is done.
[[noreturn]] void leave(int status)
{
    std::fflush(stdout);
    _exit(status);
}

void require(bool is_so, const std::string& otherwise)
{
    if (!is_so)
        throw std::runtime_error(otherwise);
}

JAUS::Address address(const std::string& text)
{
    unsigned subsystem, node, component;
    char rest;
    require(std::sscanf(text.c_str(), "%u.%u.%u%c", &subsystem, &node, &component, &rest) == 3,
            text + " is not an id; write it as in 77.1.1");
    return JAUS::Address(subsystem, node, component);
}

// A test message of any size.
class TestMessage : public JAUS::Message {
public:
    TestMessage(const JAUS::Address& to = {}, const JAUS::Address& from = {}) : Message(TEST_CODE, to, from) {}

    bool IsCommand() const override { return false; }
    Message* Clone() const override { return new TestMessage(*this); }
    JAUS::UInt GetPresenceVector() const override { return 0; }
    JAUS::UInt GetPresenceVectorSize() const override { return 0; }
    JAUS::UInt GetPresenceVectorMask() const override { return 0; }
    JAUS::UShort GetMessageCodeOfResponse() const override { return 0; }
    std::string GetMessageName() const override { return "Test"; }
    void ClearMessageBody() override { body.clear(); }
    bool IsLargeDataSet(unsigned longest) const override { return body.size() + JAUS::USHORT_SIZE > longest; }

    int WriteMessageBody(JAUS::Packet& packet) const override { return packet.Write(body.data(), body.size()); }

    int ReadMessageBody(const JAUS::Packet& packet) override
    {
        // The body of a single message ends before its sequence number; that of a merged one has none, and the
        // header before it has the size of an empty message.
        const unsigned char* octets = packet.Ptr();
        const bool is_single = (octets[1] | octets[2] << 8) == static_cast<int>(packet.Length());
        const unsigned end = packet.Length() - (is_single ? JAUS::USHORT_SIZE : 0);
        require(end >= packet.GetReadPos(), "a test message shorter than its header");
        body.resize(end - packet.GetReadPos());
        packet.Read(body.data(), body.size());
        return body.size();
    }

    // What follows the code.
    Octets body;
};

// A test message of this many octets, its code included.
TestMessage test(std::size_t size, const JAUS::Address& to, const JAUS::Address& from)
{
    TestMessage message(to, from);
    const Octets octets = test_message(size);
    message.body.assign(octets.begin() + JAUS::USHORT_SIZE, octets.end());
    return message;
}

// Gives every message of a kind to a function, in the thread that receives it.
class Listener : public JAUS::Transport::Callback {
public:
    explicit Listener(std::function<void(const TestMessage&)> hear) : hear_(std::move(hear)) {}

    void ProcessMessage(const JAUS::Message* message) override
    {
        if (const auto* test = dynamic_cast<const TestMessage*>(message))
            hear_(*test);
    }

private:
    std::function<void(const TestMessage&)> hear_;
};

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

void start(JAUS::Component& component, const JAUS::Address& id, JAUS::Subsystem::Type type)
{
    JAUS::Discovery& discovery = *component.DiscoveryService();
    discovery.SetSubsystemIdentification(type, type == JAUS::Subsystem::Vehicle ? "Simulation" : "Operator");
    discovery.SetNodeIdentification("Host");
    discovery.SetComponentIdentification("Interoperability");
    component.TransportService()->AddMessageTemplate(new TestMessage());
    require(component.Initialize(id), id.ToString() + " could not be initialized");
}

// ---- the answering sides

// Keeps the last effort of its controller.
class Driver : public JAUS::PrimitiveDriver {
public:
    bool SetWrenchEffort(const JAUS::SetWrenchEffort* command) override
    {
        const auto share = [](double percent) { return std::max(-100.0, std::min(percent, 100.0)) / 100; };
        if (command->IsFieldPresent(JAUS::SetWrenchEffort::PresenceVector::PropulsiveLinearEffortX))
            push = share(command->GetPropulsiveLinearEffortX());
        if (command->IsFieldPresent(JAUS::SetWrenchEffort::PresenceVector::PropulsiveRotationalEffortZ))
            turn = share(command->GetPropulsiveRotationalEffortZ());
        return true;
    }

    bool Reset() override
    {
        push = turn = 0;
        return PrimitiveDriver::Reset();
    }

    // Shares of full effort.
    std::atomic<double> push{0};
    std::atomic<double> turn{0};
};

struct Motion {
    double velocity = 0;
    double turn_rate = 0;
    double heading = 0;
    double north = 0;
    double east = 0;

    void move(double push, double turn, double seconds)
    {
        const double change = ACCELERATION * seconds;
        velocity += std::max(-change, std::min(push * FASTEST - velocity, change));
        turn_rate = turn * TURN;
        heading = std::remainder(heading + turn_rate * seconds, 2 * CxUtils::CX_PI);
        north += velocity * std::cos(heading) * seconds;
        east += velocity * std::sin(heading) * seconds;
    }
};

[[noreturn]] void vehicle(const JAUS::Address& id)
{
    // The component owns its services.
    JAUS::Component component;
    auto* global = new JAUS::GlobalPoseSensor();
    auto* local = new JAUS::LocalPoseSensor();
    auto* velocity = new JAUS::VelocityStateSensor();
    auto* driver = new Driver();
    global->SetSensorUpdateRate(VEHICLE_HZ);
    local->SetSensorUpdateRate(VEHICLE_HZ);
    velocity->SetSensorUpdateRate(VEHICLE_HZ);
    for (JAUS::Service* service : {static_cast<JAUS::Service*>(global), static_cast<JAUS::Service*>(local),
                                   static_cast<JAUS::Service*>(velocity), static_cast<JAUS::Service*>(driver)})
        require(component.AddService(service), "a service could not be added");
    start(component, id, JAUS::Subsystem::Vehicle);
    component.ManagementService()->SetStatus(JAUS::Management::Status::Standby);
    say("listening");

    Motion motion;
    for (;;) {
        const bool is_ready = component.ManagementService()->GetStatus() == JAUS::Management::Status::Ready;
        motion.move(is_ready ? driver->push.load() : 0, is_ready ? driver->turn.load() : 0, 1 / VEHICLE_HZ);
        const JAUS::Time now(true);
        JAUS::GlobalPose global_pose;
        global_pose.SetLatitude(CxUtils::CxToDegrees(LATITUDE + motion.north / EARTH_RADIUS));
        global_pose.SetLongitude(
            CxUtils::CxToDegrees(LONGITUDE + motion.east / (EARTH_RADIUS * std::cos(LATITUDE))));
        global_pose.SetAltitude(0);
        global_pose.SetYaw(motion.heading);
        global_pose.SetTimeStamp(now);
        JAUS::LocalPose local_pose;
        local_pose.SetX(motion.north);
        local_pose.SetY(motion.east);
        local_pose.SetZ(0);
        local_pose.SetYaw(motion.heading);
        local_pose.SetTimeStamp(now);
        JAUS::VelocityState state;
        state.SetVelocityX(motion.velocity);
        state.SetYawRate(motion.turn_rate);
        state.SetTimeStamp(now);
        global->SetGlobalPose(global_pose);
        local->SetLocalPose(local_pose);
        velocity->SetVelocityState(state);
        std::this_thread::sleep_for(std::chrono::duration<double>(1 / VEHICLE_HZ));
    }
}

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
[[noreturn]] void control(Client& client, const JAUS::Address& id, const JAUS::Address& other, Clock::time_point deadline)
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
