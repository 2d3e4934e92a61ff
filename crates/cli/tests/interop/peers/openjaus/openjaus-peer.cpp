// OpenJAUS 3.3 for the interoperability suite: its node manager and the components of its vehicle simulator in a
// network of their own, with jaus-ra-gateway between that and the cable; and a client over its component library.
// ../../README.md describes the commands.

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>

#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <openJaus.h>

// The parts of the simulator. Its own headers are for C only.
extern "C" {
int vehicleSimStartup(void);
OjCmpt gposCreate(void);
OjCmpt pdCreate(void);
OjCmpt vssCreate(void);
OjCmpt wdCreate(void);
}

// The commit of the library, set by the build.
#ifndef PEER_VERSION
#define PEER_VERSION "version not known"
#endif

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

// The network between OpenJAUS and the gateway.
const std::string OUTER_LINK = "ra0";
const std::string INNER_LINK = "oj0";
const std::string OUTER_ADDRESS = "10.214.1.1";
const std::string INNER_ADDRESS = "10.214.1.2";
// The abstract socket of the host at which the node manager tells what it lists.
const char DOOR[] = "\0openjaus-peer";
constexpr const char* SUBSYSTEM = "20";
// Type of the client: one that no service belongs to.
constexpr int CLIENT_TYPE = 40;
constexpr double CLIENT_HZ = 20;
constexpr int AUTHORITY = 127;
// Service connections: rate, timeout in seconds, queue.
constexpr double CONNECTION_HZ = 10;
constexpr double CONNECTION_TIMEOUT = 5;
constexpr int CONNECTION_QUEUE = 1;
constexpr unsigned EVERY_FIELD = 0xFF;
// Reports that prove a service connection.
constexpr unsigned ENOUGH = 10;
// Effort in percent, and the least speed that counts as motion in m/s.
constexpr double EFFORT = 50;
constexpr double MOTION = 0.1;
constexpr auto BEAT = 100ms;
// Interval of requests that are not answered.
constexpr auto AGAIN = 1s;
constexpr auto PATIENCE = 35s;

void say(const std::string& line)
{
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
}

std::runtime_error failure(const std::string& what)
{
    return std::runtime_error(what + ": " + std::strerror(errno));
}

void require(bool is_so, const std::string& otherwise)
{
    if (!is_so)
        throw std::runtime_error(otherwise);
}

void wait_until(const std::function<bool()>& is_so, const std::string& otherwise)
{
    for (const auto deadline = Clock::now() + PATIENCE; !is_so(); std::this_thread::sleep_for(BEAT))
        require(Clock::now() < deadline, otherwise);
}

bool succeeds(const std::string& command)
{
    return std::system(command.c_str()) == 0;
}

// ---- the door: tells what the node manager lists, and where it is

sockaddr_un door(socklen_t& length)
{
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, DOOR, sizeof DOOR - 1);
    length = offsetof(sockaddr_un, sun_path) + sizeof DOOR - 1;
    return address;
}

// A connection to the node manager of this host, or -1.
int knock()
{
    socklen_t length;
    const sockaddr_un address = door(length);
    const int connection = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (connect(connection, reinterpret_cast<const sockaddr*>(&address), length) == 0)
        return connection;
    close(connection);
    return -1;
}

// The node manager's list, or nothing if there is no node manager.
std::string tree()
{
    const int connection = knock();
    std::string text;
    char part[4096];
    for (ssize_t count; connection >= 0 && (count = read(connection, part, sizeof part)) > 0;)
        text.append(part, count);
    if (connection >= 0)
        close(connection);
    return text;
}

// Moves this process to the network of the node manager.
void enter_its_network()
{
    int connection = -1;
    wait_until([&] { return (connection = knock()) >= 0; }, "there is no node manager on this host");
    ucred manager{};
    socklen_t length = sizeof manager;
    if (getsockopt(connection, SOL_SOCKET, SO_PEERCRED, &manager, &length) != 0)
        throw failure("the node manager's process");
    close(connection);
    const int network = open(("/proc/" + std::to_string(manager.pid) + "/ns/net").c_str(), O_RDONLY | O_CLOEXEC);
    if (network < 0 || setns(network, CLONE_NEWNET) != 0)
        throw failure("the node manager's network");
    close(network);
}

// ---- OpenJAUS

class Handler : public EventHandler {
public:
    void handleEvent(NodeManagerEvent* event) override
    {
        if (event->getType() == NodeManagerEvent::ErrorEvent)
            say(static_cast<ErrorEvent*>(event)->toString());
        delete event;
    }
};

// Settings in a directory of their own, which becomes the current one.
void write_settings()
{
    char directory[] = "/tmp/openjaus-peer-XXXXXX";
    if (!mkdtemp(directory) || chdir(directory) != 0 || mkdir("config", 0700) != 0)
        throw failure(directory);
    std::ofstream("nodeManager.conf")
        << "[JAUS]\nSubsystemId: " << SUBSYSTEM
        << "\nNodeId: 1\nSubsystem_Identification: OpenJAUS\nNode_Identification: Simulator\n"
           "[Component_Communications]\nJAUS_OPC_UDP_Interface: true\nOpenJAUS_UDP_Interface: true\n"
           "[Node_Communications]\nEnabled: false\n"
           "[Subsystem_Communications]\nEnabled: true\nJAUS_OPC_UDP_Interface: true\nJAUS_OPC_UDP_IP_Address: "
        << INNER_ADDRESS << "\n";
    std::ofstream("config/vehicleSim.conf")
        << "INITIAL_LAT_DEGREES\t=\t37.2136\nINITIAL_LON_DEGREES\t=\t-80.4376\nINITIAL_HEADING_DEGREES\t=\t0.0\n";
}

// Answers each connection with the node manager's list.
[[noreturn]] void manage(int listener)
{
    FileLoader settings("nodeManager.conf");
    Handler handler;
    NodeManager manager(&settings, &handler);
    for (;;) {
        const int connection = accept(listener, nullptr, nullptr);
        // Its list with services does not fit its own buffer.
        const std::string text = manager.systemTreeToString();
        if (connection < 0)
            throw failure("accept");
        // A client that only looks for this process does not wait for the list.
        (void)send(connection, text.data(), text.size(), MSG_NOSIGNAL);
        close(connection);
    }
}

[[noreturn]] void simulate()
{
    require(vehicleSimStartup() == 0, "the vehicle does not start");
    require(pdCreate() && gposCreate() && vssCreate() && wdCreate(), "a component does not start");
    for (;;)
        pause();
}

// A child that ends with its parent.
pid_t child(const std::function<void()>& work)
{
    const pid_t pid = fork();
    if (pid < 0)
        throw failure("fork");
    if (pid > 0)
        return pid;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    try {
        work();
    } catch (const std::exception& error) {
        say(error.what());
    } catch (const char* error) {
        say(error);
    }
    _exit(1);
}

int listen_at_the_door()
{
    socklen_t length;
    const sockaddr_un address = door(length);
    const int listener = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (bind(listener, reinterpret_cast<const sockaddr*>(&address), length) != 0 || listen(listener, 8) != 0)
        throw failure("OpenJAUS runs on this host already");
    return listener;
}

// The node manager in a new network. It listens before it leaves this one.
pid_t start_manager()
{
    int steps[2], links[2];
    if (pipe2(steps, O_CLOEXEC) != 0 || pipe2(links, O_CLOEXEC) != 0)
        throw failure("pipe");
    const pid_t manager = child([&] {
        close(links[1]);
        const int listener = listen_at_the_door();
        if (unshare(CLONE_NEWNET) != 0 || write(steps[1], "", 1) != 1)
            throw failure("a network for OpenJAUS");
        char octet;
        require(read(links[0], &octet, 1) == 1, "OpenJAUS has no link");
        manage(listener);
    });
    close(steps[1]);
    char octet;
    require(read(steps[0], &octet, 1) == 1, "the node manager does not start");
    const std::string network = std::to_string(manager);
    // The link of an OpenJAUS that was killed goes some time after it.
    const std::string link = "ip link add " + OUTER_LINK + " type veth peer name " + INNER_LINK + " netns " + network;
    wait_until([&] { return succeeds(link); }, link + " failed");
    const std::string inside = "nsenter --net=/proc/" + network + "/ns/net ";
    const std::string commands[] = {
        "ip address add " + OUTER_ADDRESS + "/24 brd + dev " + OUTER_LINK,
        "ip link set " + OUTER_LINK + " up",
        inside + "ip link set lo up",
        inside + "ip address add " + INNER_ADDRESS + "/24 brd + dev " + INNER_LINK,
        inside + "ip link set " + INNER_LINK + " up",
        inside + "ip route add 224.0.0.0/4 dev " + INNER_LINK,
    };
    for (const std::string& command : commands)
        require(succeeds(command), command + " failed");
    require(write(links[1], "", 1) == 1, "the node manager has ended");
    close(links[0]);
    return manager;
}

// Runs until one of the three ends.
void run(const std::string& cable)
{
    write_settings();
    std::map<pid_t, std::string> parts{{start_manager(), "the node manager"}};
    wait_until([] { return !tree().empty(); }, "the node manager does not answer");
    parts[child([] {
        enter_its_network();
        simulate();
    })] = "the simulator";
    parts[child([&] {
        execlp("jaus-ra-gateway", "jaus-ra-gateway", "--interface", cable.c_str(), "--ra-interface",
               OUTER_LINK.c_str(), "--ra-grant", "65535.255.255 control=255 clear-emergency=any", nullptr);
        throw failure("jaus-ra-gateway");
    })] = "the gateway";
    wait_until([] { return tree().find("PrimitiveDriver") != std::string::npos; }, "the simulator is not listed");
    say("ready");
    int status = 0;
    const std::string ended = parts[wait(&status)];
    throw std::runtime_error(ended + " has ended, status " + std::to_string(status));
}

// ---- the client

std::atomic<unsigned> poses{0};
std::atomic<unsigned> velocities{0};
std::atomic<double> speed{0};
std::atomic<bool> is_in_control{false};

void hear_pose(OjCmpt, JausMessage)
{
    ++poses;
}

void hear_velocity(OjCmpt, JausMessage message)
{
    if (ReportVelocityStateMessage report = reportVelocityStateMessageFromJausMessage(message)) {
        speed = report->velocityXMps;
        reportVelocityStateMessageDestroy(report);
        ++velocities;
    }
}

void hear_confirmation(OjCmpt, JausMessage message)
{
    if (ConfirmComponentControlMessage confirmation = confirmComponentControlMessageFromJausMessage(message)) {
        is_in_control = confirmation->responseCode == JAUS_CONTROL_ACCEPTED;
        confirmComponentControlMessageDestroy(confirmation);
    }
}

// A component that commands the primitive driver of another subsystem.
class Client {
public:
    explicit Client(int subsystem) : component_(create()), driver_(find(subsystem, JAUS_PRIMITIVE_DRIVER))
    {
        ojCmptSetAuthority(component_, AUTHORITY);
        ojCmptSetMessageCallback(component_, JAUS_REPORT_GLOBAL_POSE, hear_pose);
        ojCmptSetMessageCallback(component_, JAUS_REPORT_VELOCITY_STATE, hear_velocity);
        ojCmptSetMessageCallback(component_, JAUS_CONFIRM_COMPONENT_CONTROL, hear_confirmation);
        pose_ = connect(subsystem, JAUS_GLOBAL_POSE_SENSOR, JAUS_REPORT_GLOBAL_POSE);
        velocity_ = connect(subsystem, JAUS_VELOCITY_STATE_SENSOR, JAUS_REPORT_VELOCITY_STATE);
        ojCmptSetState(component_, JAUS_READY_STATE);
        require(ojCmptRun(component_) == 0, "the component does not run");
        own_ = ojCmptGetAddress(component_);
    }

    void follow()
    {
        wait_until([] { return poses >= ENOUGH && velocities >= ENOUGH; }, "too few reports");
        say("service connections: pose " + std::to_string(ojCmptIsIncomingScActive(component_, pose_)) + " velocity " +
            std::to_string(ojCmptIsIncomingScActive(component_, velocity_)));
    }

    void take_control()
    {
        auto last = Clock::now() - AGAIN;
        const auto is_taken = [&] {
            if (!is_in_control && Clock::now() - last >= AGAIN) {
                last = Clock::now();
                RequestComponentControlMessage request = requestComponentControlMessageCreate();
                request->authorityCode = AUTHORITY;
                send(request, requestComponentControlMessageToJausMessage, requestComponentControlMessageDestroy);
            }
            return is_in_control.load();
        };
        wait_until(is_taken, "control was not confirmed");
        send(resumeMessageCreate(), resumeMessageToJausMessage, resumeMessageDestroy);
    }

    void drive()
    {
        const auto is_moving = [&] {
            push(EFFORT);
            return std::abs(speed) > MOTION;
        };
        wait_until(is_moving, "it does not move");
        say("it moves at " + std::to_string(speed) + " m/s");
    }

    void stop()
    {
        push(0);
        send(standbyMessageCreate(), standbyMessageToJausMessage, standbyMessageDestroy);
        send(releaseComponentControlMessageCreate(), releaseComponentControlMessageToJausMessage,
             releaseComponentControlMessageDestroy);
        ojCmptTerminateSc(component_, pose_);
        ojCmptTerminateSc(component_, velocity_);
        ojCmptDestroy(component_);
    }

private:
    static OjCmpt create()
    {
        char name[] = "Interoperability";
        OjCmpt component = ojCmptCreate(name, CLIENT_TYPE, CLIENT_HZ);
        require(component, "the component could not be created");
        return component;
    }

    // The address of the component of a type, once the node manager lists it.
    JausAddress find(int subsystem, int type)
    {
        JausAddress address = jausAddressCreate();
        address->subsystem = subsystem;
        address->node = address->instance = 0;
        address->component = type;
        wait_until([&] { return ojCmptLookupAddress(component_, address); },
                   "no component of type " + std::to_string(type) + " is listed");
        return address;
    }

    // The index of a service connection to the component of a type.
    int connect(int subsystem, int type, unsigned short report)
    {
        JausAddress sensor = find(subsystem, type);
        const int index = ojCmptEstablishSc(component_, report, EVERY_FIELD, sensor, CONNECTION_HZ, CONNECTION_TIMEOUT,
                                            CONNECTION_QUEUE);
        jausAddressDestroy(sensor);
        return index;
    }

    void push(double percent)
    {
        SetWrenchEffortMessage command = setWrenchEffortMessageCreate();
        command->presenceVector = 1 << JAUS_WRENCH_PV_PROPULSIVE_LINEAR_X_BIT;
        command->propulsiveLinearEffortXPercent = percent;
        send(command, setWrenchEffortMessageToJausMessage, setWrenchEffortMessageDestroy);
    }

    // Sends a message to the primitive driver, and destroys it.
    template <typename Message> void send(Message message, JausMessage (*pack)(Message), void (*destroy)(Message))
    {
        jausAddressCopy(message->source, own_);
        jausAddressCopy(message->destination, driver_);
        JausMessage packed = pack(message);
        ojCmptSendMessage(component_, packed);
        jausMessageDestroy(packed);
        destroy(message);
    }

    OjCmpt component_;
    JausAddress driver_;
    JausAddress own_ = nullptr;
    int pose_ = -1;
    int velocity_ = -1;
};

void drive(int subsystem)
{
    enter_its_network();
    Client client(subsystem);
    client.follow();
    client.take_control();
    client.drive();
    client.stop();
}

void print_tree(const std::string& word)
{
    std::string text;
    wait_until([&] { return (text = tree()).find(word) != std::string::npos; }, word + " is not listed");
    say(text);
}

void act(int count, char** words)
{
    const std::string act = count > 1 ? words[1] : "";
    const std::string value = count > 2 ? words[2] : "";
    if (act == "version")
        say(PEER_VERSION);
    else if (act == "run" && count == 3)
        run(value);
    else if (act == "tree" && count == 3)
        print_tree(value);
    else if (act == "drive" && count == 3)
        drive(std::stoi(value));
    else
        throw std::runtime_error("version | run INTERFACE | tree WORD | drive SUBSYSTEM");
}

} // namespace

int main(int count, char** words)
{
    try {
        act(count, words);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "openjaus-peer: %s\n", error.what());
        return 1;
    }
    return 0;
}
