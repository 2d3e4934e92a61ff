// Codec of generated JAUS messages, written by `jaus jsidl cpp`. C++17, header only, no dependencies.
//
// A message is a struct whose function `visit` passes its members to a visitor: Reader and Writer
// here, Json in json.hpp. Layout tags tell a visitor what a C++ type does not: limits of counts,
// lengths of strings. Nothing is read past the end of the octets, and no function needs exceptions:
// decode and encode return a value or an error.

#ifndef JAUS_CODEC_HPP
#define JAUS_CODEC_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace jaus::codec {

/// Octets of a message or a field.
using Octets = std::vector<std::uint8_t>;

/// Octets that belong to somebody else.
class Span {
public:
    constexpr Span() = default;
    constexpr Span(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
    Span(const Octets& octets) : Span(octets.data(), octets.size()) {}
    template <std::size_t N>
    constexpr Span(const std::array<std::uint8_t, N>& octets) : Span(octets.data(), N) {}

    constexpr const std::uint8_t* begin() const { return data_; }
    constexpr const std::uint8_t* end() const { return data_ + size_; }
    constexpr std::size_t size() const { return size_; }
    /// Some of the octets, which the caller knows to be there.
    constexpr Span part(std::size_t from, std::size_t size) const {
        return size == 0 ? Span() : Span(data_ + from, size);
    }

private:
    const std::uint8_t* data_ = nullptr;
    std::size_t size_ = 0;
};

/// A value, or the reason why there is none. Access to what is absent ends as in std::variant.
template <class T, class E>
class [[nodiscard]] Expected {
public:
    Expected(T value) : content_(std::in_place_index<0>, std::move(value)) {}
    Expected(E error) : content_(std::in_place_index<1>, std::move(error)) {}

    explicit operator bool() const { return content_.index() == 0; }
    T& operator*() { return std::get<0>(content_); }
    const T& operator*() const { return std::get<0>(content_); }
    T* operator->() { return &std::get<0>(content_); }
    const T* operator->() const { return &std::get<0>(content_); }
    const E& error() const { return std::get<1>(content_); }

private:
    std::variant<T, E> content_;
};

namespace detail {

/// The decimal with so many significant digits that is nearest to a finite number: digits, and the
/// exponent of the last one.
struct Decimal {
    std::uint64_t digits = 0;
    int exponent = 0;

    static Decimal of(double number, int digits) {
        char text[40];
        std::snprintf(text, sizeof text, "%.*e", digits - 1, std::fabs(number));
        Decimal decimal;
        const char* at = text;
        // The decimal point depends on the locale.
        for (; *at != 'e' && *at != '\0'; ++at) {
            if (*at >= '0' && *at <= '9') {
                decimal.digits = decimal.digits * 10 + static_cast<std::uint64_t>(*at - '0');
            }
        }
        decimal.exponent = (*at == 'e' ? std::atoi(at + 1) : 0) - (digits - 1);
        return decimal;
    }

    double magnitude() const {
        char text[40];
        const auto whole = static_cast<unsigned long long>(digits);
        std::snprintf(text, sizeof text, "%llue%d", whole, exponent);
        return std::strtod(text, nullptr);
    }
};

/// The shortest text that stands for a number.
inline std::string text_of(double number) {
    if (std::isnan(number)) return "NaN";
    if (std::isinf(number)) return number < 0 ? "-inf" : "inf";
    Decimal decimal;
    for (int digits = 1; digits <= 17; ++digits) {
        decimal = Decimal::of(number, digits);
        if (decimal.magnitude() == std::fabs(number)) break;
    }
    std::string text = std::to_string(decimal.digits);
    const int point = static_cast<int>(text.size()) + decimal.exponent;
    if (number == 0) {
        text = "0";
    } else if (point > 21 || point < -6) {
        text += "e" + std::to_string(decimal.exponent);
    } else if (decimal.exponent >= 0) {
        text.append(static_cast<std::size_t>(decimal.exponent), '0');
    } else if (point > 0) {
        text.insert(static_cast<std::size_t>(point), ".");
    } else {
        text.insert(0, "0." + std::string(static_cast<std::size_t>(-point), '0'));
    }
    return (number < 0 ? "-" : "") + text;
}

inline std::string hexadecimal(std::uint64_t number) {
    char text[24];
    std::snprintf(text, sizeof text, "%#llx", static_cast<unsigned long long>(number));
    return text;
}

inline std::string code(unsigned number) {
    char text[16];
    std::snprintf(text, sizeof text, "%04Xh", number);
    return text;
}

} // namespace detail

// Errors

enum class Problem {
    code,           ///< Octets of another message.
    too_short,      ///< The octets end too early.
    trailing,       ///< Octets follow the message.
    presence,       ///< A presence vector has undefined bits.
    count,          ///< A count is outside its limits.
    tag,            ///< The tag of a variant names no alternative.
    index,          ///< The index of a variable field names no type.
    empty_elements, ///< More elements without octets than one message may hold.
    too_long        ///< A text is longer than its field.
};

/// Octets that are not a message, or a message that its definition cannot express.
struct Error {
    Problem problem = Problem::code;
    /// The name of the message.
    std::string message;
    /// The way to the field in the names of the definition, such as `NodeList[2].NodeID`.
    std::string path;
    std::string reason;

    /// For example `ReportGlobalPose: Altitude: octets needed: 4, left: 2`.
    std::string text() const { return message + ": " + (path.empty() ? "" : path + ": ") + reason; }
};

struct DecodeError : Error {
    /// The octet at which the field begins, from 0.
    std::size_t offset = 0;

    std::string text() const { return Error::text() + " at octet " + std::to_string(offset); }
};

struct EncodeError : Error {};

/// A number outside the range of a field.
struct OutOfRange {
    const char* field = "";
    double value = 0;
    double lower = 0;
    double upper = 0;
    const char* units = "";

    std::string text() const {
        const std::string unit = units;
        return std::string(field) + ": " + detail::text_of(value) + " is not in "
            + detail::text_of(lower) + " to " + detail::text_of(upper)
            + (unit.empty() || unit == "one" ? "" : " " + unit);
    }
};

/// Nothing, or the reason why a value was not set.
using Checked = Expected<std::monostate, OutOfRange>;

// Numbers that are carried as integers

enum class Rounding { nearest, down, up };

/// The range of a scaled integer.
struct Range {
    const char* field;
    double lower;
    double upper;
    const char* units;
    Rounding rounding;
};

namespace detail {

struct IntegerBacked {};

/// An exact sum of floating point numbers that do not overlap (Shewchuk 1997).
class Expansion {
public:
    /// Adds (a - b) * (2 * half + odd), where the factor has at most 66 bits.
    void add_product_of_difference(double a, double b, std::int64_t half, int odd) {
        const auto [difference, rest] = two_sum(a, -b);
        const std::int64_t low = half % (std::int64_t{1} << 32);
        const double factors[] = {2.0 * static_cast<double>(low) + odd,
            2.0 * static_cast<double>(half - low)};
        for (const double factor : factors) {
            add_product(rest, factor);
            add_product(difference, factor);
        }
    }

    int sign() const {
        if (size_ == 0) return 0;
        return parts_[size_ - 1] > 0 ? 1 : -1;
    }

private:
    static std::pair<double, double> two_sum(double a, double b) {
        const double sum = a + b;
        const double part = sum - a;
        return {sum, (a - (sum - part)) + (b - part)};
    }

    void add_product(double a, double b) {
        const double product = a * b;
        add(std::fma(a, b, -product));
        add(product);
    }

    void add(double value) {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < size_; ++i) {
            const auto [high, low] = two_sum(value, parts_[i]);
            value = high;
            if (low != 0) parts_[kept++] = low;
        }
        if (value != 0 && kept < parts_.size()) parts_[kept++] = value;
        size_ = kept;
    }

    std::array<double, 16> parts_{};
    std::size_t size_ = 0;
};

/// The values of a scaled integer, counted from its least one. The 0 of a signed integer is the
/// centre of the range; its least integer is one step below.
class Scale {
public:
    template <class Raw>
    static Scale of(const Range& range, Raw) {
        static_assert(std::is_integral_v<Raw> && sizeof(Raw) <= 4);
        const int below = std::is_signed_v<Raw> ? 1 : 0;
        const auto greatest = (std::int64_t{1} << (8 * sizeof(Raw))) - 1;
        return Scale(range, greatest - below, below);
    }

    double unbounded(std::int64_t count) const {
        return static_cast<double>(count - below_) * step_ + range_.lower;
    }

    double value(std::int64_t count) const { return std::min(unbounded(count), range_.upper); }

    /// The count of a number, rounded exactly; none outside the range.
    std::optional<std::int64_t> count(double number) const {
        if (below_ > 0 && number < range_.lower && number >= range_.lower - 1.5 * step_) {
            return reaches(number, 0) ? 1 : 0;
        }
        if (!(range_.lower <= number && number <= range_.upper)) return std::nullopt;
        const double steps = (number - range_.lower) / step_;
        const double half = range_.rounding == Rounding::nearest ? 0.5 : 0.0;
        const double shifted = range_.rounding == Rounding::up ? steps + 1.0 : steps + half;
        // A few rounding errors affect `steps`. They matter only this close to an integer.
        const double doubt = (steps + 1.0) * (8.0 * 2.220446049250313e-16);
        const double whole = std::floor(shifted);
        const double fraction = shifted - whole;
        if (fraction > doubt && fraction < 1.0 - doubt) {
            return std::min(static_cast<std::int64_t>(whole), steps_) + below_;
        }
        return exactly(number) + below_;
    }

    /// The decimal with the fewest digits that has this count.
    double shortest(std::int64_t count) const {
        if (this->count(0.0) == count) return 0.0;
        const double exact = unbounded(count);
        // With `down` and `up` the exact value is the boundary of what has the count.
        double inside = exact;
        if (range_.rounding == Rounding::down) inside = std::min(exact + step_ / 2, range_.upper);
        if (range_.rounding == Rounding::up) inside = exact - step_ / 2;
        for (const double number : {exact, inside}) {
            for (int digits = 1; digits <= 17; ++digits) {
                for (const double decimal : around(number, digits)) {
                    if (this->count(decimal) == count) return decimal;
                }
            }
        }
        return exact;
    }

private:
    Scale(const Range& range, std::int64_t steps, int below)
        : range_(range), steps_(steps), below_(below),
          step_((range.upper - range.lower) / static_cast<double>(steps)) {}

    /// The decimals with so many digits around a number, the nearer first.
    static std::array<double, 2> around(double number, int digits) {
        const Decimal nearest = Decimal::of(number, digits);
        Decimal other = nearest;
        std::uint64_t power = 1;
        for (int i = 1; i < digits; ++i) power *= 10;
        if (nearest.magnitude() <= std::fabs(number)) {
            other.digits += 1;
        } else if (nearest.digits == power) {
            // Below a power of ten, decimals are ten times as dense.
            other = {nearest.digits * 10 - 1, nearest.exponent - 1};
        } else {
            other.digits -= 1;
        }
        const double sign = number < 0 ? -1.0 : 1.0;
        return {sign * nearest.magnitude(), sign * other.magnitude()};
    }

    std::int64_t exactly(double number) const {
        std::int64_t least = 0, greatest = steps_;
        while (least < greatest) {
            const std::int64_t middle = greatest - (greatest - least) / 2;
            if (reaches(number, middle)) least = middle;
            else greatest = middle - 1;
        }
        return least;
    }

    /// Whether a number is rounded to so many steps above the lower limit, or more.
    bool reaches(double number, std::int64_t steps) const {
        // Twice the steps, less 1 to the nearest integer, less 2 up.
        const std::int64_t half = range_.rounding == Rounding::down ? steps : steps - 1;
        const int odd = range_.rounding == Rounding::nearest ? 1 : 0;
        Expansion excess;
        excess.add_product_of_difference(number, range_.lower, steps_, 0);
        excess.add_product_of_difference(range_.upper, range_.lower, -half, -odd);
        return excess.sign() >= (range_.rounding == Rounding::up ? 1 : 0);
    }

    Range range_;
    std::int64_t steps_;
    std::int64_t below_;
    double step_;
};

} // namespace detail

/// A real number in a range, spread evenly over an integer. `Derived` has the range as `kRange`.
template <class Derived, class Integer>
class Scaled : public detail::IntegerBacked {
public:
    /// The value for the nearest integer, rounded exactly.
    static Expected<Derived, OutOfRange> of(double value) {
        const Range& range = Derived::kRange;
        const auto count = scale().count(value);
        if (!count) {
            return OutOfRange{range.field, value, range.lower, range.upper, range.units};
        }
        return from_raw(static_cast<Integer>(*count + kLeast));
    }

    static Derived from_raw(Integer raw) {
        Derived scaled;
        scaled.raw_ = raw;
        return scaled;
    }

    /// The integer on the wire.
    Integer raw() const { return raw_; }
    /// The number in the unit of the field.
    double value() const { return scale().value(count()); }
    /// The decimal with the fewest digits that stands for the integer.
    double shortest() const { return scale().shortest(count()); }

private:
    static constexpr std::int64_t kLeast =
        std::is_signed_v<Integer> ? -(std::int64_t{1} << (8 * sizeof(Integer) - 1)) : 0;

    static detail::Scale scale() { return detail::Scale::of(Derived::kRange, Integer{}); }
    std::int64_t count() const { return std::int64_t{raw_} - kLeast; }

    Integer raw_ = 0;
};

/// A part of a bit field, with the limits of its values.
struct Part {
    const char* name;
    unsigned from;
    unsigned to;
    std::uint64_t lower;
    std::uint64_t upper;

    /// One bit for each bit of the part, from bit 0.
    constexpr std::uint64_t mask() const { return ~std::uint64_t{0} >> (63 - (to - from)); }
};

/// Several numbers in one unsigned integer. Bits outside them are preserved.
template <class Derived, class Integer>
class Bits : public detail::IntegerBacked {
public:
    static Derived from_raw(Integer raw) {
        Derived bits;
        bits.raw_ = raw;
        return bits;
    }

    /// The integer on the wire.
    Integer raw() const { return raw_; }

protected:
    template <class T>
    T get_bits(const Part& part) const {
        return static_cast<T>((std::uint64_t{raw_} >> part.from) & part.mask());
    }

    Checked set_bits(const Part& part, std::uint64_t value) {
        if (value < part.lower || value > part.upper) {
            const auto real = [](std::uint64_t number) { return static_cast<double>(number); };
            return OutOfRange{part.name, real(value), real(part.lower), real(part.upper), "one"};
        }
        const std::uint64_t others = raw_ & ~(part.mask() << part.from);
        raw_ = static_cast<Integer>(others | value << part.from);
        return std::monostate{};
    }

private:
    Integer raw_ = 0;
};

// Accessors of scaled members

template <class T>
double in_units(const T& scaled) {
    return scaled.value();
}

template <class T>
std::optional<double> in_units(const std::optional<T>& scaled) {
    return scaled ? std::optional<double>(scaled->value()) : std::nullopt;
}

template <class Member, class T>
Checked assign(Member& member, const Expected<T, OutOfRange>& value) {
    if (!value) return value.error();
    member = *value;
    return std::monostate{};
}

// Composites

/// Octets in one of several formats.
template <class Format>
struct Formatted {
    Format format{};
    Octets data{};
};

/// Elements in a fixed number of dimensions. The first one varies fastest on the wire.
template <class T, std::size_t... Sizes>
class Array {
public:
    static constexpr std::array<std::size_t, sizeof...(Sizes)> kSizes{Sizes...};
    static constexpr std::size_t kTotal = (Sizes * ...);

    Array() : elements_(kTotal) {}

    /// The element at these indices. An index out of range ends as in std::vector::at.
    template <class... Index>
    T& operator()(Index... indices) {
        return elements_.at(place({static_cast<std::size_t>(indices)...}));
    }
    template <class... Index>
    const T& operator()(Index... indices) const {
        return elements_.at(place({static_cast<std::size_t>(indices)...}));
    }

    /// All elements in the order of the wire.
    auto begin() { return elements_.begin(); }
    auto begin() const { return elements_.begin(); }
    auto end() { return elements_.end(); }
    auto end() const { return elements_.end(); }
    static constexpr std::size_t size() { return kTotal; }

private:
    static std::size_t place(const std::array<std::size_t, sizeof...(Sizes)>& indices) {
        std::size_t place = 0, stride = 1;
        for (std::size_t i = 0; i < indices.size(); ++i) {
            if (indices[i] >= kSizes[i]) return kTotal;
            place += indices[i] * stride;
            stride *= kSizes[i];
        }
        return place;
    }

    std::vector<T> elements_;
};

// Layout tags

/// A type that has one layout.
struct Value {};

/// A string of fixed length, padded with zeros.
template <std::size_t Length>
struct Padded {};

/// A count of octets in an unsigned integer, then the octets.
template <class Count, std::uint64_t Min, std::uint64_t Max>
struct Counted {};

/// A count of elements in an unsigned integer, then the elements.
template <class Count, std::uint64_t Min, std::uint64_t Max, class Element = Value>
struct List {};

/// The elements of an Array.
template <class Element = Value>
struct Each {};

/// An alternative of a variant.
template <class Layout = Value>
struct Alternative {
    const char* name;
};

/// A type and unit of a variable field.
struct Choice {
    std::uint8_t index;
    const char* units;
};

/// The types of a set of messages.
template <class... Message>
struct Types {};

namespace detail {

/// Elements without octets that one message may hold: their count alone takes no octets.
constexpr std::uint32_t kMostEmptyElements = 4096;

inline std::string outside(std::uint64_t count, std::uint64_t min, std::uint64_t max) {
    return "count " + std::to_string(count) + " is outside " + std::to_string(min) + " to "
        + std::to_string(max);
}

inline std::string too_many_empty() {
    return "more than " + std::to_string(kMostEmptyElements) + " elements that take no octets";
}

inline std::string no_alternative(std::uint64_t tag, std::size_t alternatives) {
    return "tag " + std::to_string(tag) + " selects none of the variant's "
        + std::to_string(alternatives) + " alternatives";
}

/// The error of a visitor, to which the enclosing fields are added.
template <class E>
class Failure {
public:
    bool fail(Problem problem, std::string reason) {
        error_.problem = problem;
        error_.reason = std::move(reason);
        return false;
    }

    bool in(const std::string& step) {
        const bool joined = error_.path.empty() || error_.path[0] == '[';
        error_.path = step + (joined ? "" : ".") + error_.path;
        return false;
    }

    bool in(std::size_t index) { return in("[" + std::to_string(index) + "]"); }

    E error(const char* message) {
        error_.message = message;
        return std::move(error_);
    }

protected:
    /// Takes one of the elements without octets; false if none is left.
    bool take_empty() { return empty_elements_ > 0 && empty_elements_-- > 0; }

    E error_;
    std::uint32_t empty_elements_ = kMostEmptyElements;
};

/// The unsigned integer of the size of a number.
template <std::size_t Size>
using Unsigned = std::conditional_t<Size == 1, std::uint8_t,
    std::conditional_t<Size == 2, std::uint16_t,
        std::conditional_t<Size == 4, std::uint32_t, std::uint64_t>>>;

} // namespace detail

/// Reads the members of a message.
class Reader : public detail::Failure<DecodeError> {
public:
    explicit Reader(Span octets) : octets_(octets) {}

    bool begin(std::uint16_t code) {
        std::uint16_t found = 0;
        if (!number(found)) return false;
        if (found == code) return true;
        return fail_at(0, Problem::code,
            "message code " + detail::code(found) + ", expected " + detail::code(code));
    }

    bool end() {
        if (left() == 0) return true;
        return fail_at(at_, Problem::trailing,
            "octets after the end of the message: " + std::to_string(left()));
    }

    template <class W, class... T>
    bool presence(W, std::optional<T>&... members) {
        static_assert(sizeof...(T) <= 8 * sizeof(W));
        const std::size_t start = at_;
        W vector{};
        if (!number(vector)) return false;
        std::uint64_t bits = vector, mask = 0;
        const auto take = [&](auto& member) {
            if ((bits & 1) != 0) member.emplace();
            else member.reset();
            bits >>= 1;
            mask = mask << 1 | 1;
        };
        (take(members), ...);
        const std::uint64_t undefined = std::uint64_t{vector} & ~mask;
        if (undefined == 0) return true;
        return fail_at(start, Problem::presence,
            "presence vector " + detail::hexadecimal(vector) + " has undefined bits "
                + detail::hexadecimal(undefined));
    }

    template <class T, class L = Value>
    bool operator()(const char* name, T& member, L layout = {}) {
        return value(member, layout) || in(name);
    }

    template <class T, class L = Value>
    bool operator()(const char* name, std::optional<T>& member, L layout = {}) {
        return !member || value(*member, layout) || in(name);
    }

    /// The only list or variant of a message; it is not in the path of an error.
    template <class T, class L = Value>
    bool whole(T& member, L layout = {}) {
        return value(member, layout);
    }

    /// Header, body or footer; it is not in the path of an error.
    template <class T, class L = Value>
    bool section(const char*, T& member, L layout = {}) {
        return value(member, layout);
    }

    template <class Tag, class... T, class... L>
    bool variant(Tag, std::variant<T...>& out, const Alternative<L>&... alternatives) {
        const std::size_t start = at_;
        Tag tag{};
        if (!number(tag)) return false;
        if (tag >= sizeof...(T)) {
            return fail_at(start, Problem::tag, detail::no_alternative(tag, sizeof...(T)));
        }
        return alternative(tag, out, std::index_sequence_for<T...>{}, alternatives...);
    }

    /// A variant without alternatives.
    template <class Tag>
    bool nothing(Tag) {
        const std::size_t start = at_;
        Tag tag{};
        if (!number(tag)) return false;
        return tag == 0 || fail_at(start, Problem::tag, detail::no_alternative(tag, 0));
    }

    template <class... T, class... C>
    bool measure(std::variant<T...>& out, const C&... choices) {
        const std::size_t start = at_;
        std::uint8_t index = 0;
        if (!number(index)) return false;
        return choice(start, index, out, std::index_sequence_for<T...>{}, choices...);
    }

private:
    std::size_t left() const { return octets_.size() - at_; }

    bool fail_at(std::size_t offset, Problem problem, std::string reason) {
        error_.offset = offset;
        return fail(problem, std::move(reason));
    }

    bool take(std::uint64_t needed, Span& taken) {
        if (needed > left()) {
            return fail_at(at_, Problem::too_short,
                "octets needed: " + std::to_string(needed) + ", left: " + std::to_string(left()));
        }
        taken = octets_.part(at_, static_cast<std::size_t>(needed));
        at_ += taken.size();
        return true;
    }

    template <class T>
    bool number(T& out) {
        Span taken;
        if (!take(sizeof(T), taken)) return false;
        std::uint64_t wide = 0;
        unsigned shift = 0;
        for (const std::uint8_t octet : taken) {
            wide |= std::uint64_t{octet} << shift;
            shift += 8;
        }
        const auto bits = static_cast<detail::Unsigned<sizeof(T)>>(wide);
        std::memcpy(&out, &bits, sizeof(T));
        return true;
    }

    template <class Count>
    bool count(std::uint64_t min, std::uint64_t max, std::uint64_t& out) {
        const std::size_t start = at_;
        Count found{};
        if (!number(found)) return false;
        out = found;
        if (out >= min && out <= max) return true;
        return fail_at(start, Problem::count, detail::outside(out, min, max));
    }

    template <class T>
    bool value(T& out, Value) {
        if constexpr (std::is_enum_v<T>) {
            std::underlying_type_t<T> raw{};
            if (!number(raw)) return false;
            out = static_cast<T>(raw);
            return true;
        } else if constexpr (std::is_arithmetic_v<T>) {
            return number(out);
        } else if constexpr (std::is_base_of_v<detail::IntegerBacked, T>) {
            auto raw = out.raw();
            if (!number(raw)) return false;
            out = T::from_raw(raw);
            return true;
        } else {
            return T::visit(*this, out);
        }
    }

    template <std::size_t Length>
    bool value(std::string& out, Padded<Length>) {
        Span taken;
        if (!take(Length, taken)) return false;
        const std::uint8_t* end = taken.end();
        while (end != taken.begin() && *(end - 1) == 0) --end;
        out.assign(taken.begin(), end);
        return true;
    }

    template <class Out, class Count, std::uint64_t Min, std::uint64_t Max>
    bool value(Out& out, Counted<Count, Min, Max>) {
        std::uint64_t length = 0;
        Span taken;
        if (!count<Count>(Min, Max, length) || !take(length, taken)) return false;
        out.assign(taken.begin(), taken.end());
        return true;
    }

    template <class Format, class Count, std::uint64_t Min, std::uint64_t Max>
    bool value(Formatted<Format>& out, Counted<Count, Min, Max> layout) {
        return value(out.format, Value{}) && value(out.data, layout);
    }

    template <class T, class Count, std::uint64_t Min, std::uint64_t Max, class Element>
    bool value(std::vector<T>& out, List<Count, Min, Max, Element>) {
        std::uint64_t number = 0;
        if (!count<Count>(Min, Max, number)) return false;
        out.clear();
        for (std::uint64_t i = 0; i < number; ++i) {
            // Memory grows with the octets that were read, not with the count.
            T one{};
            if (!element(out.size(), one, Element{})) return false;
            out.push_back(std::move(one));
        }
        return true;
    }

    template <class T, std::size_t... Sizes, class Element>
    bool value(Array<T, Sizes...>& out, Each<Element>) {
        std::size_t index = 0;
        for (T& one : out) {
            if (!element(index++, one, Element{})) return false;
        }
        return true;
    }

    template <class T, class L>
    bool element(std::size_t index, T& out, L layout) {
        const std::size_t start = at_;
        if (!value(out, layout)) return in(index);
        if (at_ != start || take_empty()) return true;
        fail_at(start, Problem::empty_elements, detail::too_many_empty());
        return in(index);
    }

    template <class V, std::size_t... I, class... L>
    bool alternative(std::uint64_t tag, V& out, std::index_sequence<I...>,
        const Alternative<L>&... alternatives) {
        bool is_read = false;
        const auto read = [&](auto& chosen, auto layout, const char* name) {
            is_read = value(chosen, layout) || in(name);
            return true;
        };
        static_cast<void>(
            ((tag == I && read(out.template emplace<I>(), L{}, alternatives.name)) || ...));
        return is_read;
    }

    template <class V, std::size_t... I, class... C>
    bool choice(std::size_t start, std::uint8_t index, V& out, std::index_sequence<I...>,
        const C&... choices) {
        bool is_read = false;
        const auto read = [&](auto& chosen) {
            is_read = value(chosen, Value{});
            return true;
        };
        if (((index == choices.index && read(out.template emplace<I>())) || ...)) return is_read;
        return fail_at(start, Problem::index, "index " + std::to_string(index)
            + " selects none of the field's types and units");
    }

    Span octets_;
    std::size_t at_ = 0;
};

/// Writes the members of a message.
class Writer : public detail::Failure<EncodeError> {
public:
    void begin(std::uint16_t code) { number(code); }

    Octets take() { return std::move(octets_); }

    template <class W, class... T>
    bool presence(W, const std::optional<T>&... members) {
        static_assert(sizeof...(T) <= 8 * sizeof(W));
        std::uint64_t vector = 0, bit = 1;
        ((vector |= members ? bit : 0, bit <<= 1), ...);
        number(static_cast<W>(vector));
        return true;
    }

    template <class T, class L = Value>
    bool operator()(const char* name, const T& member, L layout = {}) {
        return value(member, layout) || in(name);
    }

    template <class T, class L = Value>
    bool operator()(const char* name, const std::optional<T>& member, L layout = {}) {
        return !member || value(*member, layout) || in(name);
    }

    template <class T, class L = Value>
    bool whole(const T& member, L layout = {}) {
        return value(member, layout);
    }

    template <class T, class L = Value>
    bool section(const char*, const T& member, L layout = {}) {
        return value(member, layout);
    }

    template <class Tag, class... T, class... L>
    bool variant(Tag, const std::variant<T...>& chosen, const Alternative<L>&... alternatives) {
        if (chosen.valueless_by_exception()) {
            return fail(Problem::tag, "the variant has no value");
        }
        number(static_cast<Tag>(chosen.index()));
        return alternative(chosen, std::index_sequence_for<T...>{}, alternatives...);
    }

    template <class Tag>
    bool nothing(Tag) {
        number(Tag{0});
        return true;
    }

    template <class... T, class... C>
    bool measure(const std::variant<T...>& chosen, const C&... choices) {
        if (chosen.valueless_by_exception()) {
            return fail(Problem::index, "the field has no value");
        }
        const std::uint8_t indices[] = {choices.index...};
        number(indices[chosen.index()]);
        return choice(chosen, std::index_sequence_for<T...>{});
    }

private:
    template <class T>
    void number(T number) {
        detail::Unsigned<sizeof(T)> bits{};
        std::memcpy(&bits, &number, sizeof(T));
        std::uint64_t wide = bits;
        for (std::size_t i = 0; i < sizeof(T); ++i) {
            octets_.push_back(static_cast<std::uint8_t>(wide & 0xFF));
            wide >>= 8;
        }
    }

    template <class Count>
    bool count(std::uint64_t min, std::uint64_t max, std::uint64_t found) {
        const std::uint64_t most = std::min<std::uint64_t>(max, static_cast<Count>(~Count{0}));
        if (found < min || found > most) {
            return fail(Problem::count, detail::outside(found, min, most));
        }
        number(static_cast<Count>(found));
        return true;
    }

    template <class T>
    bool value(const T& it, Value) {
        if constexpr (std::is_enum_v<T>) {
            number(static_cast<std::underlying_type_t<T>>(it));
            return true;
        } else if constexpr (std::is_arithmetic_v<T>) {
            number(it);
            return true;
        } else if constexpr (std::is_base_of_v<detail::IntegerBacked, T>) {
            number(it.raw());
            return true;
        } else {
            return T::visit(*this, it);
        }
    }

    template <std::size_t Length>
    bool value(const std::string& text, Padded<Length>) {
        if (text.size() > Length) {
            return fail(Problem::too_long, std::to_string(text.size())
                + " octets of text in a field of " + std::to_string(Length));
        }
        octets_.insert(octets_.end(), text.begin(), text.end());
        octets_.insert(octets_.end(), Length - text.size(), 0);
        return true;
    }

    template <class T, class Count, std::uint64_t Min, std::uint64_t Max>
    bool value(const T& octets, Counted<Count, Min, Max>) {
        if (!count<Count>(Min, Max, octets.size())) return false;
        octets_.insert(octets_.end(), octets.begin(), octets.end());
        return true;
    }

    template <class Format, class Count, std::uint64_t Min, std::uint64_t Max>
    bool value(const Formatted<Format>& it, Counted<Count, Min, Max> layout) {
        return value(it.format, Value{}) && value(it.data, layout);
    }

    template <class T, class Count, std::uint64_t Min, std::uint64_t Max, class Element>
    bool value(const std::vector<T>& list, List<Count, Min, Max, Element>) {
        return count<Count>(Min, Max, list.size()) && elements(list, Element{});
    }

    template <class T, std::size_t... Sizes, class Element>
    bool value(const Array<T, Sizes...>& array, Each<Element>) {
        return elements(array, Element{});
    }

    template <class T, class L>
    bool elements(const T& all, L layout) {
        std::size_t index = 0;
        for (const auto& one : all) {
            const std::size_t start = octets_.size();
            if (!value(one, layout)) return in(index);
            if (octets_.size() == start && !take_empty()) {
                fail(Problem::empty_elements, detail::too_many_empty());
                return in(index);
            }
            ++index;
        }
        return true;
    }

    template <class V, std::size_t... I, class... L>
    bool alternative(const V& chosen, std::index_sequence<I...>,
        const Alternative<L>&... alternatives) {
        bool is_written = false;
        const auto write = [&](const auto* it, auto layout, const char* name) {
            if (it != nullptr) is_written = value(*it, layout) || in(name);
        };
        (write(std::get_if<I>(&chosen), L{}, alternatives.name), ...);
        return is_written;
    }

    template <class V, std::size_t... I>
    bool choice(const V& chosen, std::index_sequence<I...>) {
        bool is_written = false;
        const auto write = [&](const auto* it) {
            if (it != nullptr) is_written = value(*it, Value{});
        };
        (write(std::get_if<I>(&chosen)), ...);
        return is_written;
    }

    Octets octets_;
};

/// The code of a message, if there are at least two octets.
inline std::optional<std::uint16_t> code_of(Span octets) {
    if (octets.size() < 2) return std::nullopt;
    const unsigned code = octets.begin()[0] | static_cast<unsigned>(octets.begin()[1]) << 8;
    return static_cast<std::uint16_t>(code);
}

/// Decodes a whole message from its code to its last octet.
template <class Message>
Expected<Message, DecodeError> decode(Span octets) {
    Reader reader(octets);
    Message message{};
    if (reader.begin(Message::kCode) && Message::visit(reader, message) && reader.end()) {
        return message;
    }
    return reader.error(Message::kName);
}

/// Encodes a whole message.
template <class Message>
Expected<Octets, EncodeError> encode(const Message& message) {
    Writer writer;
    writer.begin(Message::kCode);
    if (Message::visit(writer, message)) return writer.take();
    return writer.error(Message::kName);
}

} // namespace jaus::codec

#endif
