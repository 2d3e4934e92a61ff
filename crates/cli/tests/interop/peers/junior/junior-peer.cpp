// A client of Junior's library with a run-time engine of its own, for the interoperability suite: it echoes
// test messages, or sends them and expects them back. If JUNIOR_ENGINE is defined, it is the engine of a fork: of
// the JAUS Tool Set, or of fkie's IOP packages. ../../README.md describes the commands.

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <fstream>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <JuniorAPI.h>

#include "../test-message.h"

// The commit of the library, set by the build.
#ifndef PEER_VERSION
#define PEER_VERSION "version not known"
#endif

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

// Pause between two looks, where the library does not block.
constexpr auto LOOK = 1ms;
// Time without an echo after which a possibly lost message is sent again.
constexpr auto AGAIN = 3s;
// Interval of the messages of `keep`.
constexpr auto BEAT = 200ms;
// Attempts to send an echo: the library leaves retransmission to its client once it has given up.
constexpr int ATTEMPTS = 3;
// Longest message that is received.
constexpr unsigned LONGEST = 2 << 20;
// Where the engine and its clients have their sockets and their settings.
constexpr const char* SOCKETS = "/tmp";
constexpr const char* SETTINGS = "/tmp/interop.xml";
#ifdef JUNIOR_ENGINE
constexpr const char* ENGINE = JUNIOR_ENGINE;
using Handle = std::int64_t;
#else
constexpr const char* ENGINE = "JuniorRTE";
using Handle = long;
#endif
constexpr unsigned short PORT = 3794;

void say(const std::string& line)
{
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
}

std::runtime_error failure(const std::string& what)
{
    return std::runtime_error(what + ": " + std::strerror(errno));
}

unsigned number(const std::string& text)
{
    std::size_t end = 0;
    const unsigned long value = std::stoul(text, &end);
    if (end != text.size())
        throw std::runtime_error(text + " is not a number");
    return static_cast<unsigned>(value);
}

// SUBSYSTEM.NODE.COMPONENT as one number.
unsigned id_of(const std::string& text)
{
    unsigned subsystem, node, component;
    char rest;
    if (std::sscanf(text.c_str(), "%u.%u.%u%c", &subsystem, &node, &component, &rest) != 3)
        throw std::runtime_error(text + " is not an id; write it as in 201.1.1");
    return subsystem << 16 | node << 8 | component;
}

// What the settings of the engine depend on.
struct Links {
    bool udp;
    bool tcp;
    // The one peer that is reached by TCP: it has no discovery.
    std::string address_book;
};

Links links(const std::string& by, unsigned other, const std::string& address)
{
    if (by != "udp" && by != "tcp" && by != "both")
        throw std::runtime_error(by + " is no transport; there are udp, tcp and both");
    Links links{by != "tcp", by != "udp", ""};
    if (links.tcp && !address.empty())
        links.address_book = "J" + std::to_string(other) + "=\"" + address + ":3794\"";
    return links;
}

// 1 MiB needs 258 fragments of 4079 octets or 736 of ours in the history, and buffers that hold it at once.
// EnableUDPforLocal and SockPath are for fkie's engine, which otherwise exchanges messages with its clients by UDP.
void write_settings(const Links& links)
{
    std::ofstream file(SETTINGS);
    file << "<JrXmlConfig>\n"
            "<API_Configuration MaxMsgHistory=\"1000\" OldMsgTimeout=\"3\" DropDuplicateMsgs=\"1\"\n"
            " MTU_Size=\"4079\" MaxAckNakRetries=\"10\" AckTimeout=\"100\" ConnectionTimeout=\"1000\"\n"
            " EnableUDPforLocal=\"0\" SockPath=\"/tmp/\"/>\n"
            "<Log_Configuration LogFileName=\"\" LogMsgLevel=\"0\"/>\n"
            "<RTE_Configuration AllowRelay=\"0\" RTE_CycleTime=\"1\" NumSerialInterfaces=\"0\"\n"
            " EnableUDPInterface=\""
         << links.udp << "\" EnableTCPInterface=\"" << links.tcp
         << "\"/>\n"
            "<UDP_Configuration UDP_Port=\"3794\" MulticastAddr=\"239.255.0.1\" MulticastTTL=\"16\"\n"
            " MaxBufferSize=\"4000000\"/>\n"
            "<TCP_Configuration TCP_Port=\"3794\" MaxBufferSize=\"4000000\"/>\n"
            "<AddressBook "
         << links.address_book << "/>\n</JrXmlConfig>\n";
    if (!file.flush())
        throw failure(SETTINGS);
}

// The directory of the engine: JUNIOR_RTE, or the one on the PATH. Returns a descriptor of it.
int engine_directory()
{
    const char* wanted = std::getenv("JUNIOR_RTE");
    std::string path = wanted ? wanted : std::getenv("PATH") ? std::getenv("PATH") : "";
    for (std::size_t start = 0; start <= path.size();) {
        const std::size_t end = std::min(path.find(':', start), path.size());
        const std::string directory = path.substr(start, end - start);
        if (access((directory + "/" + ENGINE).c_str(), X_OK) == 0)
            return open(directory.c_str(), O_PATH | O_DIRECTORY);
        start = end + 1;
    }
    throw std::runtime_error(std::string("there is no ") + ENGINE + " on the PATH, nor in the directory JUNIOR_RTE");
}

// Hides the sockets of this engine from those on other hosts: network namespaces share the file system.
void hide_sockets()
{
    if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0)
        throw failure("a mount namespace");
    if (mount("tmpfs", SOCKETS, "tmpfs", 0, nullptr) != 0)
        throw failure("a private /tmp");
}

// Waits until the engine of a process that was killed has left the port: the next one would run without UDP.
void await_free_port()
{
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(PORT);
    for (const auto deadline = Clock::now() + AGAIN; Clock::now() < deadline; std::this_thread::sleep_for(LOOK)) {
        const int probe = socket(AF_INET, SOCK_DGRAM, 0);
        const bool is_free = bind(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
        close(probe);
        if (is_free)
            return;
    }
    throw std::runtime_error("another program holds UDP port " + std::to_string(PORT));
}

// Starts the engine; it ends with this process. Writing to a closed TCP connection must not end it.
void start_engine(int directory)
{
    const pid_t child = fork();
    if (child < 0)
        throw failure("fork");
    if (child > 0)
        return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    signal(SIGPIPE, SIG_IGN);
    // By the descriptor: the private /tmp may cover the path.
    const std::string program = "/proc/self/fd/" + std::to_string(directory) + "/" + ENGINE;
    execl(program.c_str(), ENGINE, SETTINGS, nullptr);
    std::perror(ENGINE);
    _exit(1);
}

struct Message {
    unsigned source;
    Octets octets;
};

#ifdef JUNIOR_ENGINE

// The messages that have arrived. A thread of its own receives them: a fork's library sees acknowledgements only while
// it receives, and its sender waits for them.
class Inbox {
public:
    explicit Inbox(Handle handle)
    {
        std::thread([this, handle] {
            for (;;)
                receive(handle);
        }).detach();
    }

    std::optional<Message> next(Clock::time_point deadline)
    {
        std::unique_lock<std::mutex> lock(mutex_);
        if (!arrived_.wait_until(lock, deadline, [this] { return !messages_.empty(); }))
            return std::nullopt;
        Message message = std::move(messages_.front());
        messages_.pop_front();
        return message;
    }

private:
    void receive(Handle handle)
    {
        unsigned source = 0, size = 0;
        char* octets = nullptr;
        if (JrReceive(handle, &source, &size, &octets) != Ok)
            return std::this_thread::sleep_for(LOOK);
        std::lock_guard<std::mutex> lock(mutex_);
        messages_.push_back({source, Octets(octets, octets + size)});
        delete[] octets;
        arrived_.notify_one();
    }

    std::mutex mutex_;
    std::condition_variable arrived_;
    std::deque<Message> messages_;
};

#else

// The messages that have arrived. The library does not block.
class Inbox {
public:
    explicit Inbox(Handle handle) : handle_(handle), buffer_(LONGEST) {}

    std::optional<Message> next(Clock::time_point deadline)
    {
        do {
            unsigned source = 0, size = buffer_.size();
            const JrErrorCode code = JrReceive(handle_, &source, &size, buffer_.data());
            if (code == Ok)
                return Message{source, Octets(buffer_.begin(), buffer_.begin() + size)};
            if (code != NoMessages)
                throw std::runtime_error("JrReceive: error " + std::to_string(code));
            std::this_thread::sleep_for(LOOK);
        } while (Clock::now() < deadline);
        return std::nullopt;
    }

private:
    const Handle handle_;
    std::vector<char> buffer_;
};

#endif

Handle connect(unsigned id)
{
    Handle handle = 0;
    const JrErrorCode code = JrConnect(id, SETTINGS, &handle);
    if (code != Ok)
        throw std::runtime_error("JrConnect: error " + std::to_string(code));
    return handle;
}

// A client of the engine. It is never disconnected: the engine ends with this process.
class Client {
public:
    explicit Client(unsigned id) : handle_(connect(id)), inbox_(handle_) {}

    // False if acknowledgement was requested and did not come, or if the library's queue is full.
    bool send(unsigned to, const Octets& message, bool acknowledge)
    {
        const char* octets = reinterpret_cast<const char*>(message.data());
        const int flags = acknowledge ? GuaranteeDelivery : 0;
        const JrErrorCode code = JrSend(handle_, to, message.size(), octets, 6, flags);
        if (code != Ok && code != Timeout)
            throw std::runtime_error("JrSend: error " + std::to_string(code));
        if (code == Timeout)
            std::this_thread::sleep_for(BEAT);
        return code == Ok;
    }

    // The next test message, if one comes before the deadline.
    std::optional<Message> receive(Clock::time_point deadline)
    {
        while (auto message = inbox_.next(deadline))
            if (is_test_message(message->octets))
                return message;
        return std::nullopt;
    }

    // Whether this message comes back in time; another one of its size is an error.
    bool returns(unsigned from, const Octets& message, Clock::time_point deadline)
    {
        while (const auto received = receive(deadline)) {
            if (received->source != from || received->octets.size() != message.size())
                continue;
            if (received->octets != message)
                throw std::runtime_error("what came back is not the same");
            return true;
        }
        return false;
    }

private:
    const Handle handle_;
    Inbox inbox_;
};

[[noreturn]] void echo(Client& client, bool acknowledge)
{
    say("connected");
    for (;;) {
        const auto message = client.receive(Clock::now() + AGAIN);
        if (!message)
            continue;
        say(std::to_string(message->octets.size()) + " octets");
        int attempts = ATTEMPTS;
        while (!client.send(message->source, message->octets, acknowledge) && --attempts > 0)
            say("the echo was not acknowledged");
    }
}

void there_and_back(Client& client, unsigned other, std::size_t size, bool acknowledge, Clock::time_point deadline)
{
    const Octets message = test_message(size);
    while (Clock::now() < deadline) {
        if (!client.send(other, message, acknowledge))
            say("not acknowledged");
        else if (client.returns(other, message, std::min(deadline, Clock::now() + AGAIN)))
            return say(std::to_string(size) + " octets there and back");
        else
            say("nothing came back yet");
    }
    throw std::runtime_error(std::to_string(size) + " octets did not come back");
}

[[noreturn]] void keep(Client& client, unsigned other)
{
    const Octets message = test_message(GREETING);
    for (;;) {
        client.send(other, message, false);
        const bool returned = client.returns(other, message, Clock::now() + AGAIN);
        say(returned ? "report: it came back" : "nothing came back");
        std::this_thread::sleep_for(BEAT);
    }
}

void run(const std::vector<std::string>& words)
{
    if (words == std::vector<std::string>{"version"})
        return say(PEER_VERSION);
    const std::string act = words.size() > 2 ? words[2] : "";
    const bool is_echo = act == "echo" && words.size() == 4;
    const bool is_send = act == "send" && words.size() == 8;
    const bool is_keep = act == "keep" && words.size() == 5;
    if (!is_echo && !is_send && !is_keep)
        throw std::runtime_error("version | ID BY echo ACK | ID BY send OTHER ADDRESS SIZE ACK SECONDS | "
                                 "ID BY keep OTHER ADDRESS");
    const unsigned id = id_of(words[0]);
    const unsigned other = is_echo ? 0 : id_of(words[3]);
    const Links used = links(words[1], other, is_echo ? "" : words[4]);

    const int engine = engine_directory();
    hide_sockets();
    write_settings(used);
    if (used.udp)
        await_free_port();
    start_engine(engine);
    // Not destroyed, because a thread may receive for it until the end.
    Client& client = *new Client(id);
    if (is_echo)
        echo(client, words[3] == "1");
    if (is_keep)
        keep(client, other);
    const auto deadline = Clock::now() + std::chrono::seconds(number(words[7]));
    there_and_back(client, other, GREETING, false, deadline);
    there_and_back(client, other, number(words[5]), words[6] == "1", deadline);
}

} // namespace

int main(int count, char** words)
{
    int status = 0;
    try {
        run(std::vector<std::string>(words + 1, words + count));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "junior-peer: %s\n", error.what());
        status = 1;
    }
    // The receiving thread may still run.
    std::fflush(stdout);
    _exit(status);
}
