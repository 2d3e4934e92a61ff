// TCP: the port only, by which JAUS++ decides which process of a host is the node manager. No connection is
// ever made, because JTCP of JAUS++ hangs when a message comes in two segments.
#ifndef CXUTILS_NETWORKING_TCPLISTENSOCKET_H
#define CXUTILS_NETWORKING_TCPLISTENSOCKET_H

#include "socket.h"

namespace CxUtils {

class TcpServer : public Socket {
public:
    IP4Address GetClientAddress() const { return IP4Address(); }
    IP4Address GetSourceAddress() const { return IP4Address(); }
    IP4Address GetDestinationAddress() const { return IP4Address(); }
    unsigned short GetPort() const { return 0; }
};

class TcpClient : public TcpServer {
public:
    bool InitializeSocket(const IP4Address&, unsigned short) { return false; }
};

class TcpListenSocket : public Socket {
public:
    // False if another process has the port.
    bool InitializeSocket(unsigned short port, int backlog, int, int, int, int)
    {
        open(SOCK_STREAM);
        const int reuse = 1;
        if (is_open() && set(SOL_SOCKET, SO_REUSEADDR, reuse) && bind_to(IP4Address("0.0.0.0"), port) &&
            ::listen(descriptor(), backlog) == 0)
            return true;
        Shutdown();
        return false;
    }

    TcpServer* AwaitConnection() { return nullptr; }
};

} // namespace CxUtils

#endif
