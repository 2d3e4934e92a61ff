// What every part of the peer needs: a component of JAUS++ that reads and writes test messages.
#ifndef JAUSPP_PEER_COMPONENT_H
#define JAUSPP_PEER_COMPONENT_H

#include <cstdio>
#include <functional>
#include <stdexcept>
#include <string>

#include <unistd.h>

#include <jaus/core/component.h>

#include "../test-message.h"

inline void say(const std::string& line)
{
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
}

// Ends the process without the library's shutdown, which may fail after all is done.
[[noreturn]] inline void leave(int status)
{
    std::fflush(stdout);
    _exit(status);
}

inline void require(bool is_so, const std::string& otherwise)
{
    if (!is_so)
        throw std::runtime_error(otherwise);
}

inline JAUS::Address address(const std::string& text)
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
inline TestMessage test(std::size_t size, const JAUS::Address& to, const JAUS::Address& from)
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

inline void start(JAUS::Component& component, const JAUS::Address& id, JAUS::Subsystem::Type type)
{
    JAUS::Discovery& discovery = *component.DiscoveryService();
    discovery.SetSubsystemIdentification(type, type == JAUS::Subsystem::Vehicle ? "Simulation" : "Operator");
    discovery.SetNodeIdentification("Host");
    discovery.SetComponentIdentification("Interoperability");
    component.TransportService()->AddMessageTemplate(new TestMessage());
    require(component.Initialize(id), id.ToString() + " could not be initialized");
}

#endif
