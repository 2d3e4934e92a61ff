// Decodes random octets as each message: they are refused, or encoded again as they were. Prints how many
// were read.
#include <algorithm>
#include <cstdio>
#include <random>

#include "jaus/json.hpp"
// Includes the sets of messages, and lists them as `Sets`.
#include "sets.hpp"

namespace {

using namespace jaus;

std::mt19937 chance(5684);
unsigned read_messages = 0, tried = 0;

unsigned below(unsigned limit) { return static_cast<unsigned>(chance()) % limit; }

// Mostly small numbers, so that counts, tags and presence vectors are often right.
std::uint8_t octet(unsigned kind) {
    switch (kind) {
    case 0: return static_cast<std::uint8_t>(below(3));
    case 1: return static_cast<std::uint8_t>(below(256));
    case 2: return 0;
    default: return static_cast<std::uint8_t>(below(8) == 0 ? 0xFF : below(2));
    }
}

template <class Message>
bool attack() {
    for (unsigned turn = 0; turn < 1500; ++turn) {
        codec::Octets octets{Message::kCode & 0xFF, Message::kCode >> 8};
        const unsigned kind = below(4), length = below(turn < 200 ? 8 : 200);
        for (unsigned i = 0; i < length; ++i) octets.push_back(octet(kind));
        // On the heap and without room, so that a sanitizer sees an octet that is read beyond the end.
        octets.shrink_to_fit();
        auto message = codec::decode<Message>(octets);
        if (!message && message.error().problem == codec::Problem::trailing) {
            octets.resize(message.error().offset);
            octets.shrink_to_fit();
            message = codec::decode<Message>(octets);
        }
        ++tried;
        if (!message) {
            if (message.error().text().empty() || message.error().offset > octets.size()) return false;
            continue;
        }
        ++read_messages;
        const auto again = codec::encode(*message);
        // Octets that a string of fixed length has after its end do not come back.
        if (!again || again->size() != octets.size() || codec::to_json(*message).empty()) {
            std::fprintf(stderr, "%s\n", Message::kName);
            return false;
        }
        const auto second = codec::decode<Message>(*again);
        if (!second || codec::to_json(*second) != codec::to_json(*message)) return false;
    }
    return true;
}

template <class... Message>
bool attack_all(codec::Types<Message...>) {
    return (attack<Message>() && ...);
}

template <class... Set>
bool attack_sets(std::tuple<Set...>) {
    return (attack_all(Set{}) && ...);
}

} // namespace

int main() {
    if (!attack_sets(Sets{})) return 1;
    std::printf("%u of %u\n", read_messages, tried);
}
