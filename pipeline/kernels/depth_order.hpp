// Entries of a tile in the order of depth, sorted no farther than they are wanted.
//
// They are dealt into slices of depth of a few entries each; then 16 entries at a time find their places by counting which
// of the 16 come before them: no branch depends on what is compared.
#pragma once

#include "simd.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace ringlet {

class DepthOrder {
  public:
    /// Takes entries, depth << 32 | number, where depth is the bits of a positive float. Slices of depth hold about 3.
    void begin(std::span<const uint64_t> entries) {
        count_ = entries.size(), sorted_ = 0, slice_ = 0;
        order_.resize(count_ + kTogether);
        if (count_ == 0) return;
        int64_t least = INT64_MAX, most = 0;
        for (const uint64_t entry : entries) least = std::min(least, int64_t(entry)), most = std::max(most, int64_t(entry));
        const float first = depth(uint64_t(least)), span = depth(uint64_t(most)) - first;
        const int slices = int(std::clamp<size_t>(count_ / 3, 1, kSlices));
        const float scale = span > 0 ? float(slices) / span : 0;
        const auto slice = [&](uint64_t entry) { return std::min(int((depth(entry) - first) * scale), slices - 1); };
        end_.assign(slices, 0);
        for (const uint64_t entry : entries) ++end_[slice(entry)];
        uint32_t total = 0;
        for (uint32_t &end : end_) {
            const uint32_t size = end;
            end = total, total += size;
        }
        for (const uint64_t entry : entries) order_[end_[slice(entry)]++] = entry;
        std::fill(order_.end() - kTogether, order_.end(), uint64_t(INT64_MAX));
    }

    size_t size() const { return count_; }

    /// The entries, of which the first `wanted` are in order.
    const uint64_t *sorted(size_t wanted) {
        while (sorted_ < std::min(wanted, count_)) {
            size_t end = end_[slice_++];
            uint64_t *from = order_.data() + sorted_;
            if (end > sorted_ + kTogether) {
                std::sort(from, order_.data() + end);
            } else {
                while (slice_ < end_.size() && end_[slice_] <= sorted_ + kTogether) end = end_[slice_++];
                sort_together(from);
            }
            sorted_ = end;
        }
        return order_.data();
    }

  private:
    static constexpr size_t kSlices = 8192, kTogether = 16;

    std::vector<uint64_t> order_; // and kTogether more, behind all others
    std::vector<uint32_t> end_; // of each slice
    size_t count_ = 0, sorted_ = 0, slice_ = 0;

    /// Sorts kTogether entries, of which none belongs before the first or behind the last.
    static void sort_together(uint64_t *entries) {
        typedef Mask<double> Eight;
        Eight low, high, before_low{}, before_high{};
        std::memcpy(&low, entries, sizeof low), std::memcpy(&high, entries + 8, sizeof high);
        for (size_t k = 0; k < kTogether; ++k) {
            const Eight each = Eight{} + int64_t(entries[k]);
            before_low -= each < low, before_high -= each < high;
        }
        uint64_t entry[kTogether];
        int64_t place[kTogether];
        std::memcpy(entry, entries, sizeof entry);
        std::memcpy(place, &before_low, sizeof before_low), std::memcpy(place + 8, &before_high, sizeof before_high);
        for (size_t k = 0; k < kTogether; ++k) entries[place[k]] = entry[k];
    }

    static float depth(uint64_t entry) {
        const uint32_t bits = uint32_t(entry >> 32);
        float value;
        std::memcpy(&value, &bits, sizeof value);
        return value;
    }
};

} // namespace ringlet
