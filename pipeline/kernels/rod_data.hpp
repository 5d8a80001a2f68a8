// What rods.hpp works on: segments as a structure of arrays, and how near pairs of strands may come to each other.
#pragma once

#include "simd.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ringlet {

using Floats = Lanes<float>;
using Points = Vec3<float>;

/// A segment: 0-2 its middle, 3-5 its half, 6-11 their velocities; a cache line.
struct alignas(64) Rod {
    float part[12];
};

/// Segments as structure of arrays, in groups of three: middles, halves, and their velocities.
struct Rods {
    std::vector<float> part[12];

    void resize(size_t count) {
        for (auto &values : part) values.resize(count + kLanes<float>); // a whole vector can be read anywhere
    }

    RINGLET_INLINE Points load(int group, size_t at) const {
        return {read(part[3 * group], at), read(part[3 * group + 1], at), read(part[3 * group + 2], at)};
    }

    RINGLET_INLINE Points pick(int group, const int *at) const {
        return {pick_part(3 * group, at), pick_part(3 * group + 1, at), pick_part(3 * group + 2, at)};
    }

    RINGLET_INLINE Points every(int group, size_t at) const {
        return {splat(part[3 * group][at]), splat(part[3 * group + 1][at]), splat(part[3 * group + 2][at])};
    }

    static RINGLET_INLINE Floats read(const std::vector<float> &values, size_t at) {
        Floats result;
        __builtin_memcpy(&result, &values[at], sizeof result);
        return result;
    }

  private:
    RINGLET_INLINE Floats pick_part(int k, const int *at) const {
        float values[kLanes<float>];
        const float *from = part[k].data();
#pragma omp simd
        for (int lane = 0; lane < kLanes<float>; ++lane) values[lane] = from[at[lane]];
        Floats result;
        __builtin_memcpy(&result, values, sizeof result);
        return result;
    }
};

/// How near pairs of strands come to each other at rest, where that is nearer than the reach: a hash table.
class Closeness {
  public:
    explicit Closeness(int strands) : strands_(strands), slots_(1024) {}

    /// Notes that two strands come this near.
    void note(int a, int b, float distance) {
        if (2 * (used_ + 1) > slots_.size()) grow();
        Slot &slot = slots_[place(key(a, b))];
        used_ += slot.key == 0;
        slot.distance = slot.key == 0 ? distance : std::min(slot.distance, distance);
        slot.key = key(a, b);
    }

    float of(int a, int b, float otherwise) const {
        const Slot &slot = slots_[place(key(a, b))];
        return slot.key == 0 ? otherwise : slot.distance;
    }

  private:
    struct Slot {
        uint64_t key = 0; // 0: empty
        float distance = 0;
    };
    int strands_;
    size_t used_ = 0;
    std::vector<Slot> slots_; // a power of two, at most half of them used

    uint64_t key(int a, int b) const { return uint64_t(std::min(a, b)) * strands_ + std::max(a, b) + 1; }

    size_t place(uint64_t key) const {
        size_t at = (key * 0x9e3779b97f4a7c15u >> 32) & (slots_.size() - 1);
        while (slots_[at].key != 0 && slots_[at].key != key) at = (at + 1) & (slots_.size() - 1);
        return at;
    }

    void grow() {
        std::vector<Slot> old(2 * slots_.size());
        old.swap(slots_);
        for (const Slot &slot : old)
            if (slot.key != 0) slots_[place(slot.key)] = slot;
    }
};

} // namespace ringlet
