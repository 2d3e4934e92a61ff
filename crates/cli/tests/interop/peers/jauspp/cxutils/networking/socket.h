#ifndef CXUTILS_NETWORKING_SOCKET_H
#define CXUTILS_NETWORKING_SOCKET_H

#include <memory>

#include <ifaddrs.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "../packet.h"
#include "ip4address.h"

namespace CxUtils {

// A socket of the system. Several destinations may share it; it is closed with the last.
class Socket {
public:
    virtual ~Socket() = default;

    // The addresses of this host, as they are at the first call.
    static bool GetHostAddresses(IP4Address::List& addresses)
    {
        static const IP4Address::List all = look_up_host_addresses();
        addresses = all;
        return !all.empty();
    }

    static bool IsHostAddress(const IP4Address& address)
    {
        IP4Address::List all;
        GetHostAddresses(all);
        return std::find(all.begin(), all.end(), address) != all.end();
    }

    void SetNetworkInterface(const IP4Address& address) { interface_ = address; }
    bool IsValid() const { return is_open(); }
    virtual void Shutdown() { descriptor_.reset(); }

    // Octets sent, or negative.
    virtual int Send(const Packet&) const { return -1; }
    // Octets received, 0 if none arrive in time, or negative.
    virtual int Recv(Packet&, unsigned, long, IP4Address*, unsigned short*) { return -1; }

protected:
    bool is_open() const { return descriptor_ && *descriptor_ >= 0; }
    int descriptor() const { return is_open() ? *descriptor_ : -1; }

    void open(int type)
    {
        const auto close = [](int* descriptor) {
            if (*descriptor >= 0)
                ::close(*descriptor);
            delete descriptor;
        };
        descriptor_ = std::shared_ptr<int>(new int(::socket(AF_INET, type, 0)), close);
    }

    bool bind_to(const IP4Address& address, unsigned short port)
    {
        const sockaddr_in own = socket_address(address, port);
        return ::bind(descriptor(), reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0;
    }

    template <typename Value> bool set(int level, int option, const Value& value)
    {
        return ::setsockopt(descriptor(), level, option, &value, sizeof value) == 0;
    }

    static sockaddr_in socket_address(const IP4Address& address, unsigned short port)
    {
        sockaddr_in result{};
        result.sin_family = AF_INET;
        result.sin_addr = address.in();
        result.sin_port = htons(port);
        return result;
    }

    IP4Address interface_;
    std::shared_ptr<int> descriptor_;

private:
    static IP4Address::List look_up_host_addresses()
    {
        IP4Address::List all;
        ifaddrs* first = nullptr;
        if (getifaddrs(&first) != 0)
            return all;
        for (const ifaddrs* each = first; each; each = each->ifa_next)
            if (each->ifa_addr && each->ifa_addr->sa_family == AF_INET)
                all.push_back(IP4Address(reinterpret_cast<const sockaddr_in*>(each->ifa_addr)->sin_addr));
        freeifaddrs(first);
        return all;
    }
};

} // namespace CxUtils

#endif
