// Decodes and encodes the messages on standard input: module, service, message, code and octets in
// each line. Answers {"hex": …, "view": …} or {"error": …}.
#include <cstdio>
#include <iostream>
#include <map>
#include <sstream>

#include "jaus/json.hpp"
// Includes the sets of messages, and lists them as `Sets`.
#include "sets.hpp"

namespace {

using namespace jaus;

std::string quoted(const std::string& text) {
    std::string out = "\"";
    for (const char character : text) {
        if (character == '"' || character == '\\') out += '\\';
        out += character;
    }
    return out + "\"";
}

std::string hex(const codec::Octets& octets) {
    std::string out;
    for (const std::uint8_t octet : octets) {
        char digits[3];
        std::snprintf(digits, sizeof digits, "%02x", static_cast<unsigned>(octet));
        out += digits;
    }
    return out;
}

template <class Message>
std::string answer(const codec::Octets& octets) {
    const auto message = codec::decode<Message>(octets);
    if (!message) return "{\"error\":" + quoted(message.error().text()) + "}";
    const auto encoded = codec::encode(*message);
    if (!encoded) return "{\"error\":" + quoted(encoded.error().text()) + "}";
    return "{\"hex\":\"" + hex(*encoded) + "\",\"view\":" + codec::to_json(*message) + "}";
}

using Answer = std::string (*)(const codec::Octets&);
using Answers = std::map<std::string, Answer>;

template <class Message>
void add(Answers& answers) {
    char code[8];
    std::snprintf(code, sizeof code, "%04x", static_cast<unsigned>(Message::kCode));
    for (const char* service : Message::kServices) {
        answers[std::string(service) + '\t' + Message::kName + '\t' + code] = &answer<Message>;
    }
}

template <class... Message>
void add_all(Answers& answers, codec::Types<Message...>) {
    (add<Message>(answers), ...);
}

template <class... Set>
void add_sets(Answers& answers, std::tuple<Set...>) {
    (add_all(answers, Set{}), ...);
}

codec::Octets octets_of(const std::string& hex) {
    codec::Octets octets;
    for (std::size_t at = 0; at + 1 < hex.size(); at += 2) {
        const auto octet = std::strtoul(hex.substr(at, 2).c_str(), nullptr, 16);
        octets.push_back(static_cast<std::uint8_t>(octet));
    }
    // Exactly as much memory, so that a sanitizer sees a read past the end.
    octets.shrink_to_fit();
    return octets;
}

} // namespace

int main() {
    Answers answers;
    add_sets(answers, Sets{});
    for (std::string line; std::getline(std::cin, line);) {
        const std::size_t first = line.find('\t'), last = line.rfind('\t');
        const auto found = answers.find(line.substr(first + 1, last - first - 1));
        if (found == answers.end()) {
            std::cout << "{\"error\":\"no such message\"}\n";
            continue;
        }
        std::cout << found->second(octets_of(line.substr(last + 1))) << '\n';
    }
}
