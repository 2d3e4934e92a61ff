#ifndef CXUTILS_MUTEX_H
#define CXUTILS_MUTEX_H

#include <mutex>

namespace CxUtils {

class Mutex {
public:
    class ScopedLock {
    public:
        explicit ScopedLock(const Mutex* mutex) : lock_(mutex->mutex_) {}

    private:
        std::lock_guard<std::recursive_mutex> lock_;
    };

    explicit Mutex(const char* = "") {}
    // A copy of what a mutex protects has a mutex of its own.
    Mutex(const Mutex&) {}
    Mutex& operator=(const Mutex&) { return *this; }

    void Lock() const { mutex_.lock(); }
    void Unlock() const { mutex_.unlock(); }

private:
    mutable std::recursive_mutex mutex_;
};

} // namespace CxUtils

#endif
