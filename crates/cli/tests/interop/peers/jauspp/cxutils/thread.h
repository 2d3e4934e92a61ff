#ifndef CXUTILS_THREAD_H
#define CXUTILS_THREAD_H

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

namespace CxUtils {

inline void SleepMs(unsigned milliseconds)
{
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
}

// A thread that runs a function, or `Execute` of a derived class.
class Thread {
public:
    Thread() = default;
    virtual ~Thread() { StopThread(); }

    int CreateThread()
    {
        return start([this] { Execute(); });
    }

    int CreateThread(void (*function)(void*), void* argument)
    {
        return start([function, argument] { function(argument); });
    }

    // Requests the end, and waits for it unless this is the thread itself.
    void StopThread(unsigned = 0)
    {
        quits_ = true;
        if (thread_.joinable() && thread_.get_id() != std::this_thread::get_id())
            thread_.join();
    }

    bool IsThreadActive() const { return runs_; }
    bool QuitThreadFlag() const { return quits_; }
    void SetThreadName(const std::string&) {}

protected:
    virtual void Execute() {}

private:
    template <typename Work> int start(Work work)
    {
        if (runs_)
            return 0;
        StopThread();
        quits_ = false;
        runs_ = true;
        thread_ = std::thread([this, work] {
            work();
            runs_ = false;
        });
        return 1;
    }

    std::thread thread_;
    std::atomic<bool> runs_{false};
    std::atomic<bool> quits_{false};
};

} // namespace CxUtils

#endif
