#ifndef CXUTILS_CIRCULARARRAY_H
#define CXUTILS_CIRCULARARRAY_H

#include <deque>

namespace CxUtils {

// A queue that its user enlarges when it is full.
template <typename Item> class CircularArray {
public:
    void reserve(unsigned capacity) { capacity_ = capacity; }
    void resize(unsigned capacity) { capacity_ = capacity; }
    unsigned capacity() const { return capacity_; }
    unsigned size() const { return items_.size(); }
    bool empty() const { return items_.empty(); }
    void clear() { items_.clear(); }
    void push_back(const Item& item) { items_.push_back(item); }

    // False if there is none.
    bool pop_front(Item* item)
    {
        if (items_.empty())
            return false;
        *item = std::move(items_.front());
        items_.pop_front();
        return true;
    }

private:
    std::deque<Item> items_;
    unsigned capacity_ = 0;
};

} // namespace CxUtils

#endif
