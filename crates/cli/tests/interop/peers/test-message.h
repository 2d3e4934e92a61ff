// The test message of the interoperability suite: a code that no service acts on, and octets that differ
// from packet to packet.
#ifndef INTEROP_TEST_MESSAGE_H
#define INTEROP_TEST_MESSAGE_H

#include <cstddef>
#include <cstdint>
#include <vector>

using Octets = std::vector<unsigned char>;

constexpr std::uint16_t TEST_CODE = 0xD7F0;
// Size of the message by which both sides learn each other's address.
constexpr std::size_t GREETING = 16;

// A test message of this many octets, its code included.
inline Octets test_message(std::size_t size)
{
    Octets message(size);
    for (std::size_t i = 0; i < size; ++i)
        message[i] = static_cast<unsigned char>(7 * i + i / 251);
    message[0] = TEST_CODE & 0xFF;
    message[1] = TEST_CODE >> 8;
    return message;
}

inline bool is_test_message(const Octets& message)
{
    return message.size() >= 2 && message[0] == (TEST_CODE & 0xFF) && message[1] == TEST_CODE >> 8;
}

#endif
