// Only its name is used: it marks the id of a component as taken on this host.
#ifndef CXUTILS_IPC_MAPPEDMEMORY_H
#define CXUTILS_IPC_MAPPEDMEMORY_H

#include <cstddef>
#include <cstring>
#include <string>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace CxUtils {

// An abstract socket, which a network namespace has for itself and which ends with its process.
class MappedMemory {
public:
    MappedMemory() = default;
    MappedMemory(const MappedMemory&) = delete;
    MappedMemory& operator=(const MappedMemory&) = delete;
    ~MappedMemory() { CloseMappedMemory(); }

    // 0 if the name is taken.
    int CreateMappedMemory(const std::string& name, unsigned)
    {
        CloseMappedMemory();
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::strncpy(address.sun_path + 1, name.c_str(), sizeof address.sun_path - 2);
        const socklen_t length = offsetof(sockaddr_un, sun_path) + 1 + std::strlen(address.sun_path + 1);
        socket_ = socket(AF_UNIX, SOCK_DGRAM, 0);
        if (bind(socket_, reinterpret_cast<sockaddr*>(&address), length) == 0)
            return 1;
        CloseMappedMemory();
        return 0;
    }

    void CloseMappedMemory()
    {
        if (socket_ >= 0)
            close(socket_);
        socket_ = -1;
    }

private:
    int socket_ = -1;
};

} // namespace CxUtils

#endif
