#ifndef CXUTILS_NETWORKING_UDPCLIENT_H
#define CXUTILS_NETWORKING_UDPCLIENT_H

#include <netinet/in.h>

#include "socket.h"

namespace CxUtils {

// A socket with one destination.
class UdpSocket : public Socket {
public:
    // From any port if the source port is 0.
    bool InitializeSocket(const IP4Address& to, unsigned short port, unsigned short source_port = 0)
    {
        open(SOCK_DGRAM);
        return aim(to, port, source_port);
    }

    // Joins the group on the interface and sends to it.
    bool InitializeMulticastSocket(const IP4Address& group, unsigned short source_port, unsigned char ttl,
                                   bool broadcasts, unsigned short port, bool)
    {
        open(SOCK_DGRAM);
        const int is_broadcast = broadcasts;
        const ip_mreq membership{group.in(), interface_.in()};
        return aim(group, port, source_port) && set(SOL_SOCKET, SO_BROADCAST, is_broadcast) &&
               set(IPPROTO_IP, IP_MULTICAST_TTL, ttl) && set(IPPROTO_IP, IP_MULTICAST_IF, interface_.in()) &&
               set(IPPROTO_IP, IP_ADD_MEMBERSHIP, membership);
    }

    // The same socket with another destination.
    UdpSocket* CreateNewDestination(const IP4Address& to, unsigned short port) const
    {
        auto* other = new UdpSocket(*this);
        other->to_ = to;
        other->port_ = port;
        return other;
    }

    int Send(const Packet& packet) const override
    {
        const sockaddr_in to = socket_address(to_, port_);
        return ::sendto(descriptor(), packet.Ptr(), packet.Length(), MSG_NOSIGNAL,
                        reinterpret_cast<const sockaddr*>(&to), sizeof to);
    }

    int Recv(Packet& packet, unsigned longest, long milliseconds, IP4Address* from, unsigned short* from_port) override
    {
        pollfd ready{descriptor(), POLLIN, 0};
        if (!is_open() || ::poll(&ready, 1, milliseconds) <= 0)
            return 0;
        sockaddr_in source{};
        socklen_t length = sizeof source;
        std::vector<unsigned char> octets(longest);
        const int count =
            ::recvfrom(ready.fd, octets.data(), longest, 0, reinterpret_cast<sockaddr*>(&source), &length);
        if (count <= 0)
            return count;
        packet.Clear();
        packet.Write(octets.data(), count);
        if (from)
            *from = IP4Address(source.sin_addr);
        if (from_port)
            *from_port = ntohs(source.sin_port);
        return count;
    }

    unsigned short GetDestinationPort() const { return port_; }
    unsigned short GetSourcePort() const { return source_port_; }
    IP4Address GetDestinationAddress() const { return to_; }
    IP4Address GetConnectionAddress() const { return to_; }
    IP4Address GetSourceAddress() const { return interface_; }

private:
    bool aim(const IP4Address& to, unsigned short port, unsigned short source_port)
    {
        to_ = to;
        port_ = port;
        source_port_ = source_port;
        return is_open() && (source_port == 0 || bind_to(IP4Address("0.0.0.0"), source_port));
    }

    IP4Address to_;
    unsigned short port_ = 0;
    unsigned short source_port_ = 0;
};

using UdpClient = UdpSocket;

} // namespace CxUtils

#endif
