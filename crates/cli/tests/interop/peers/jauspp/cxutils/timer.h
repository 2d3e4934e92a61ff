#ifndef CXUTILS_TIMER_H
#define CXUTILS_TIMER_H

#include <functional>

#include "thread.h"

namespace CxUtils {

// Calls a function at a rate. It sleeps for a period between two calls, and so is never early.
class Timer {
public:
    ~Timer() { Stop(); }

    // Seconds since some start.
    static double GetTimeSeconds()
    {
        return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    }

    void RegisterTimerEvent(void (*function)(void*), void* argument)
    {
        call_ = [function, argument] { function(argument); };
    }

    bool Start(double hertz)
    {
        if (hertz <= 0 || !call_)
            return false;
        hertz_ = hertz;
        return thread_.CreateThread(&Timer::run, this) > 0;
    }

    void Stop() { thread_.StopThread(); }
    bool ChangeFrequency(double hertz)
    {
        hertz_ = hertz;
        return true;
    }

    double GetFrequency() const { return hertz_; }
    bool IsActive() const { return thread_.IsThreadActive(); }
    bool IsShuttingDown() const { return thread_.QuitThreadFlag(); }
    void SetName(const std::string&) {}

private:
    static void run(void* self)
    {
        Timer& timer = *static_cast<Timer*>(self);
        while (!timer.thread_.QuitThreadFlag()) {
            timer.call_();
            std::this_thread::sleep_for(std::chrono::duration<double>(1 / timer.hertz_));
        }
    }

    std::function<void()> call_;
    std::atomic<double> hertz_{1};
    Thread thread_;
};

} // namespace CxUtils

#endif
