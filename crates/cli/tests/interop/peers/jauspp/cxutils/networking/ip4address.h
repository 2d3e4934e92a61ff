#ifndef CXUTILS_NETWORKING_IP4ADDRESS_H
#define CXUTILS_NETWORKING_IP4ADDRESS_H

#include <cstring>
#include <string>
#include <vector>

#include <arpa/inet.h>

namespace CxUtils {

class IP4Address {
public:
    using List = std::vector<IP4Address>;

    IP4Address() = default;
    IP4Address(const char* text) { SetAddress(text); }
    IP4Address(const std::string& text) { SetAddress(text); }

    explicit IP4Address(in_addr address)
    {
        char text[INET_ADDRSTRLEN];
        SetAddress(inet_ntop(AF_INET, &address, text, sizeof text));
    }

    // In dots, or localhost.
    void SetAddress(const std::string& text)
    {
        mString = text == "localhost" ? "127.0.0.1" : text;
        const in_addr address = in();
        std::memcpy(mData, &address, sizeof mData);
    }

    void Clear() { *this = IP4Address(); }

    in_addr in() const
    {
        in_addr address{};
        inet_pton(AF_INET, mString.c_str(), &address);
        return address;
    }

    bool operator==(const IP4Address& other) const { return mString == other.mString; }
    bool operator!=(const IP4Address& other) const { return !(*this == other); }
    bool operator<(const IP4Address& other) const { return mString < other.mString; }

    std::string mString;
    unsigned char mData[4] = {};
};

} // namespace CxUtils

#endif
