// Entries of a tile in the order of depth, sorted no farther than they are wanted.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace ringlet {

class DepthOrder {
  public:
    /// Takes entries, depth << 32 | number, where depth is the bits of a positive float. Slices of depth hold about 8.
    void begin(std::span<const uint64_t> entries) {
        count_ = entries.size(), sorted_ = 0, slice_ = 0;
        order_.resize(count_);
        if (count_ == 0) return;
        const auto [least, most] = std::minmax_element(entries.begin(), entries.end());
        const float first = depth(*least), span = depth(*most) - first;
        const int slices = int(std::clamp<size_t>(count_ / 8, 1, kSlices));
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
    }

    size_t size() const { return count_; }

    /// The entries, of which the first `wanted` are in order.
    const uint64_t *sorted(size_t wanted) {
        for (; sorted_ < std::min(wanted, count_); sorted_ = end_[slice_++])
            std::sort(order_.begin() + ptrdiff_t(sorted_), order_.begin() + ptrdiff_t(end_[slice_]));
        return order_.data();
    }

  private:
    static constexpr size_t kSlices = 4096;

    std::vector<uint64_t> order_;
    std::vector<uint32_t> end_; // of each slice
    size_t count_ = 0, sorted_ = 0, slice_ = 0;

    static float depth(uint64_t entry) {
        const uint32_t bits = uint32_t(entry >> 32);
        float value;
        std::memcpy(&value, &bits, sizeof value);
        return value;
    }
};

} // namespace ringlet
