// A buffer with a position to read at and one to write at. Numbers are little-endian.
#ifndef CXUTILS_PACKET_H
#define CXUTILS_PACKET_H

#include <algorithm>
#include <climits>
#include <cstring>
#include <list>
#include <string>
#include <type_traits>
#include <vector>

namespace CxUtils {

class Packet {
public:
    using List = std::list<Packet>;

    class Wrapper;

    // All that is reserved may be written to before the length is set.
    unsigned char* Ptr() { return octets_.data(); }
    const unsigned char* Ptr() const { return octets_.data(); }
    unsigned Length() const { return length_; }
    unsigned Size() const { return length_; }
    unsigned Reserved() const { return octets_.size(); }

    void Reserve(unsigned octets)
    {
        if (octets > octets_.size())
            octets_.resize(octets);
    }

    void SetLength(unsigned length)
    {
        Reserve(length);
        length_ = length;
    }

    void Clear(bool = false) { length_ = read_ = write_ = 0; }

    // Deletes octets from a position on.
    void Delete(unsigned count, unsigned position)
    {
        const unsigned start = std::min(position, length_);
        const unsigned end = std::min(start + count, length_);
        std::copy(octets_.begin() + end, octets_.begin() + length_, octets_.begin() + start);
        length_ -= end - start;
        read_ = std::min(read_, length_);
        write_ = length_;
    }

    unsigned GetReadPos() const { return read_; }
    unsigned GetWritePos() const { return write_; }
    void SetReadPos(unsigned position) const { read_ = position; }
    // Does not shorten the packet: what is behind the position stays.
    void SetWritePos(unsigned position) { write_ = position; }

    // Each returns the number of octets.
    int Write(const unsigned char* octets, unsigned length)
    {
        if (length_ < write_ + length)
            extend(write_ + length);
        if (length > 0)
            std::memcpy(octets_.data() + write_, octets, length);
        write_ += length;
        return length;
    }

    int Write(const Packet& other) { return Write(other.Ptr(), other.Length()); }

    int Write(const std::string& text)
    {
        return Write(reinterpret_cast<const unsigned char*>(text.data()), text.size());
    }

    // At a position without moving the position to write at, or at that.
    template <typename Number, typename = std::enable_if_t<std::is_arithmetic<Number>::value>>
    int Write(Number number, unsigned position = HERE)
    {
        const unsigned before = write_;
        if (position != HERE)
            write_ = position;
        const int count = Write(reinterpret_cast<const unsigned char*>(&number), sizeof number);
        if (position != HERE)
            write_ = before;
        return count;
    }

    int WriteByte(unsigned char octet) { return Write(octet); }

    // Each returns the number of octets, or 0 if fewer are left.
    int Read(unsigned char* octets, unsigned length) const
    {
        if (length > length_ || read_ > length_ - length)
            return 0;
        std::memcpy(octets, octets_.data() + read_, length);
        read_ += length;
        return length;
    }

    template <typename Number, typename = std::enable_if_t<std::is_arithmetic<Number>::value>>
    int Read(Number& number, unsigned position = HERE) const
    {
        const unsigned before = read_;
        if (position != HERE)
            read_ = position;
        const int count = Read(reinterpret_cast<unsigned char*>(&number), sizeof number);
        if (position != HERE)
            read_ = before;
        return count;
    }

    int Read(std::string& text, unsigned length) const
    {
        std::vector<unsigned char> octets(length);
        const int count = Read(octets.data(), length);
        text.assign(octets.begin(), octets.begin() + count);
        return count;
    }

    int Read(Packet& other, unsigned length, unsigned position = HERE) const
    {
        const unsigned before = read_;
        if (position != HERE)
            read_ = position;
        std::vector<unsigned char> octets(length);
        const int count = Read(octets.data(), length);
        if (position != HERE)
            read_ = before;
        other.Clear();
        return other.Write(octets.data(), count);
    }

    Packet& operator+=(const Packet& other)
    {
        write_ = length_;
        Write(other);
        return *this;
    }

private:
    static constexpr unsigned HERE = UINT_MAX;

    // Reserves more than that, so that many small writes stay cheap.
    void extend(unsigned length)
    {
        if (length > octets_.size())
            Reserve(2 * length);
        length_ = length;
    }

    std::vector<unsigned char> octets_;
    unsigned length_ = 0;
    mutable unsigned read_ = 0;
    unsigned write_ = 0;
};

// A packet with a copy of some octets.
class Packet::Wrapper {
public:
    Wrapper(const unsigned char* octets, unsigned length) { packet_.Write(octets, length); }
    Packet* GetData() { return &packet_; }
    Packet* operator->() { return &packet_; }

private:
    Packet packet_;
};

} // namespace CxUtils

#endif
