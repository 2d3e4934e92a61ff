// Time of day in UTC.
#ifndef CXUTILS_TIME_H
#define CXUTILS_TIME_H

#include <cstdint>
#include <ctime>
#include <string>

#include <sys/time.h>

namespace CxUtils {

class Time {
public:
    using Stamp = std::uint64_t;

    // Milliseconds since 1970.
    static Stamp GetUtcTimeMs()
    {
        timeval now;
        gettimeofday(&now, nullptr);
        return Stamp(now.tv_sec) * 1000 + now.tv_usec / 1000;
    }

    static Time GetUtcTime() { return Time(true); }

    explicit Time(bool now = false)
    {
        if (now)
            SetCurrentTime();
    }
    virtual ~Time() = default;

    void SetCurrentTime()
    {
        const Stamp now = GetUtcTimeMs();
        const std::time_t seconds = now / 1000;
        std::tm fields;
        gmtime_r(&seconds, &fields);
        mDay = fields.tm_mday;
        mHour = fields.tm_hour;
        mMinute = fields.tm_min;
        mSecond = fields.tm_sec;
        mMilliseconds = now % 1000;
    }

    void Clear() { mDay = mHour = mMinute = mSecond = mMilliseconds = 0; }

    // Milliseconds since 1970. The fields have no month: it is this one, or the one before if the day is yet to come.
    Stamp ToMs() const
    {
        const std::time_t now = std::time(nullptr);
        std::tm fields;
        gmtime_r(&now, &fields);
        if (static_cast<int>(mDay) > fields.tm_mday + 1)
            --fields.tm_mon;
        fields.tm_mday = mDay;
        fields.tm_hour = mHour;
        fields.tm_min = mMinute;
        fields.tm_sec = mSecond;
        return Stamp(timegm(&fields)) * 1000 + mMilliseconds;
    }

    double ToSeconds() const { return ToMs() / 1000.0; }

    // In seconds.
    double operator-(const Time& other) const { return ToSeconds() - other.ToSeconds(); }

    std::string ToString() const
    {
        return std::to_string(mHour) + ":" + std::to_string(mMinute) + ":" + std::to_string(mSecond) + "." +
               std::to_string(mMilliseconds);
    }

    unsigned mDay = 0;
    unsigned mHour = 0;
    unsigned mMinute = 0;
    unsigned mSecond = 0;
    unsigned mMilliseconds = 0;
};

// The clock of this host stays as it is.
inline bool SetSystemTime(unsigned, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned)
{
    return false;
}

} // namespace CxUtils

#endif
