// All segments of all strands as soft rods: sorted into cells, and the forces of all that touch.
//
// A rod meets those of the 27 cells around its middle. It works out the force on itself only, from all it touches, in
// the order of the cells: every pair is computed twice, but no lists are kept, so that no result depends on threads or
// earlier steps. Both sides of a pair compute the same numbers (the lower segment is first): their forces are opposite.
#pragma once

#include "capsule_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace ringlet {

/// Segments as structure of arrays: group 0 middles, 1 halves, 2 and 3 their velocities.
struct Rods {
    std::vector<float> part[12];

    void resize(size_t count) {
        for (auto &values : part) values.resize(count + kLanes<float>); // a whole vector can be read anywhere
    }

    RINGLET_INLINE Points load(int group, size_t at) const {
        Points p;
        __builtin_memcpy(&p.x, &part[3 * group][at], sizeof p.x);
        __builtin_memcpy(&p.y, &part[3 * group + 1][at], sizeof p.y);
        __builtin_memcpy(&p.z, &part[3 * group + 2][at], sizeof p.z);
        return p;
    }

    RINGLET_INLINE Points pick(int group, const int *at) const {
        return {pick_part(3 * group, at), pick_part(3 * group + 1, at), pick_part(3 * group + 2, at)};
    }

    RINGLET_INLINE Points every(int group, size_t at) const {
        return {splat(part[3 * group][at]), splat(part[3 * group + 1][at]), splat(part[3 * group + 2][at])};
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

/// What all contacts of a rod do to its two points: a force and the matrix C (xx, xy, xz, yy, yz, zz) of each.
struct RodLoad {
    float at[2][9];
};

/// The rods of one step in their cells, and their contacts.
class RodGrid {
    static constexpr int W = kLanes<float>;
    static constexpr int kChunk = 64;   // rods that a thread takes at a time
    static constexpr int kFound = 1024; // candidates that are kept before they are met

  public:
    /// `allowed`: see Closeness; `cell` [m]: the middles of two rods that touch are no farther apart.
    RodGrid(const Closeness &allowed, int count, int per_strand, double cell, const RodLaw &law)
        : allowed_(allowed), per_strand_(per_strand), cell_size_(float(cell)), law_(law), valid_(count), touched_(count),
          loads_(count), cell_(count) {
        all_.resize(count);
    }

    /// Puts a rod in: its ends, each a point and its velocity. `valid`: it may touch others.
    void put(int rod, const float (&a)[6], const float (&b)[6], bool valid) {
        for (int k = 0; k < 6; ++k) {
            const int part = k < 3 ? k : k + 3;
            all_.part[part][rod] = 0.5f * (a[k] + b[k]);
            all_.part[part + 3][rod] = 0.5f * (b[k] - a[k]);
        }
        valid_[rod] = valid;
    }

    /// Works out the loads. Called by every thread of a parallel region.
    void work() {
#pragma omp single
        sort();
        const int count = int(order_.size());
        fill();
#pragma omp for schedule(dynamic, 1)
        for (int chunk = 0; chunk < (count + kChunk - 1) / kChunk; ++chunk) {
            Runs runs;
            int last = -1;
            for (int place = chunk * kChunk; place < std::min(count, (chunk + 1) * kChunk); ++place) {
                const int cell = cell_[order_[place]];
                if (cell != last) runs = around(cell);
                last = cell;
                meet_all(place, runs);
            }
        }
    }

    /// Tells `note(strand, strand, distance)` of all pairs that are nearer than the reach. Not in a parallel region.
    template <class Note> void measure(Note note) {
        sort();
        fill();
        int found[kFound + W];
        for (int place = 0; place < int(order_.size()); ++place) {
            const Runs runs = around(cell_[order_[place]]);
            for (int k = 0; k < 9; ++k)
                for (int at = runs.begin[k]; at < runs.end[k]; at += W) {
                    const int count = find(place, at, runs.end[k], found, 0);
                    std::fill(found + count, found + W, count > 0 ? found[0] : place);
                    const Closest near = closest(place, found, Mask<float>{});
                    const Floats square = dot(near.gap, near.gap);
                    for (int lane = 0; lane < count; ++lane)
                        if (square[lane] < law_.reach * law_.reach)
                            note(strand_[place], strand_[found[lane]], std::sqrt(square[lane]));
                }
        }
    }

    /// Load of a rod, or null if it touches nothing.
    const RodLoad *load(int rod) const { return touched_[rod] ? &loads_[rod] : nullptr; }

  private:
    struct Runs {
        int begin[9], end[9];
    };

    /// Sums over the contacts of a rod, in lanes.
    struct Sums {
        Floats at[2][9] = {};
        bool any = false;
    };

    const Closeness &allowed_;
    const int per_strand_;
    const float cell_size_;
    const RodLaw law_;
    Rods all_, sorted_;
    std::vector<uint8_t> valid_, touched_;
    std::vector<RodLoad> loads_;
    std::vector<int> cell_, first_, order_, strand_; // cell of a rod; first place of a cell; rod and strand at a place
    int n_[3] = {1, 1, 1};

    /// Counting sort by cells; rods of one cell stay in their order.
    void sort() {
        const int count = int(valid_.size());
        const float per_cell = 1 / cell_size_;
        float low[3] = {1e30f, 1e30f, 1e30f}, high[3] = {-1e30f, -1e30f, -1e30f};
        for (int axis = 0; axis < 3; ++axis)
            for (int k = 0; k < count; ++k) {
                if (!valid_[k]) continue;
                low[axis] = std::min(low[axis], all_.part[axis][k]);
                high[axis] = std::max(high[axis], all_.part[axis][k]);
            }
        int from[3];
        for (int axis = 0; axis < 3; ++axis) {
            if (low[axis] > high[axis]) low[axis] = high[axis] = 0;
            from[axis] = int(std::floor(low[axis] * per_cell)) - 1;
            n_[axis] = int(std::floor(high[axis] * per_cell)) + 2 - from[axis];
        }
        first_.assign(size_t(n_[0]) * n_[1] * n_[2] + 1, 0);
        int kept = 0;
        for (int k = 0; k < count; ++k) {
            touched_[k] = 0;
            if (!valid_[k]) continue;
            int at[3];
            for (int axis = 0; axis < 3; ++axis) at[axis] = int(std::floor(all_.part[axis][k] * per_cell)) - from[axis];
            cell_[k] = (at[2] * n_[1] + at[1]) * n_[0] + at[0];
            ++first_[cell_[k] + 1];
            ++kept;
        }
        for (size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
        order_.resize(kept), strand_.resize(kept + W), sorted_.resize(kept);
        // Filling moves the start of a cell to its end; the cell before has it then
        for (int k = count - 1; k >= 0; --k)
            if (valid_[k]) order_[--first_[cell_[k] + 1]] = k;
        for (size_t c = 0; c + 1 < first_.size(); ++c) first_[c] = first_[c + 1];
        first_.back() = kept;
    }

    /// The rods in the order of their cells.
    void fill() {
        const int count = int(order_.size());
#pragma omp for schedule(static)
        for (int place = 0; place < count; ++place) {
            strand_[place] = order_[place] / per_strand_;
            for (int k = 0; k < 12; ++k) sorted_.part[k][place] = all_.part[k][order_[place]];
        }
    }

    /// The places of the rods in the cells around one: 9 runs of 3 cells.
    Runs around(int cell) const {
        Runs runs;
        int k = 0;
        for (int z = -1; z <= 1; ++z)
            for (int y = -1; y <= 1; ++y, ++k) {
                const int middle = cell + (z * n_[1] + y) * n_[0];
                runs.begin[k] = first_[middle - 1], runs.end[k] = first_[middle + 2];
            }
        return runs;
    }

    void meet_all(int place, const Runs &runs) {
        int found[kFound + W], count = 0;
        Sums sums;
        for (int k = 0; k < 9; ++k)
            for (int at = runs.begin[k]; at < runs.end[k]; at += W) {
                count = find(place, at, runs.end[k], found, count);
                if (count < kFound) continue;
                for (int done = 0; done < kFound; done += W) meet(place, found + done, W, sums);
                count -= kFound;
                std::copy_n(found + kFound, count, found);
            }
        for (int done = 0; done < count; done += W) meet(place, found + done, std::min(W, count - done), sums);
        if (!sums.any) return;
        RodLoad &load = loads_[order_[place]];
        for (int end = 0; end < 2; ++end)
            for (int k = 0; k < 9; ++k) {
                float sum = 0;
                for (int lane = 0; lane < W; ++lane) sum += sums.at[end][k][lane];
                load.at[end][k] = sum;
            }
        touched_[order_[place]] = 1;
    }

    /// Appends the places at .. at + W - 1 whose rods may touch: another strand, middle near enough to this segment.
    RINGLET_INLINE int find(int place, int at, int end, int *found, int count) const {
        const Points half = sorted_.every(1, place), apart = sorted_.load(0, at) - sorted_.every(0, place);
        const Points other = sorted_.load(1, at);
        const Floats along = clamp_one(dot(apart, half) * reciprocal<float>(dot(half, half)));
        const Points away = apart - along * half;
        const Floats size = dot(other, other), distance = dot(away, away);
        // |away| < reach + |other|, without roots: (a + b)^2 <= 2 a^2 + 2 b^2 would let too many pass
        const Floats excess = distance - size - splat(law_.reach * law_.reach);
        Mask<float> near = (excess < 0) | (excess * excess < (4 * law_.reach * law_.reach) * size);
        Mask<float> strand;
        __builtin_memcpy(&strand, &strand_[at], sizeof strand);
        near &= strand != strand_[place];
        for (uint32_t bits = set_lanes<float>(near) & lanes_before(end - at); bits; bits &= bits - 1)
            found[count++] = at + __builtin_ctz(bits);
        return count;
    }

    static RINGLET_INLINE uint32_t lanes_before(int count) { return count >= W ? 0xffff : (1u << count) - 1; }

    /// Of this rod and W found ones, the lower of each pair first.
    RINGLET_INLINE Closest closest(int place, const int *found, Mask<float> second) const {
        const Points c = sorted_.every(0, place), h = sorted_.every(1, place);
        const Points c_other = sorted_.pick(0, found), h_other = sorted_.pick(1, found);
        return {select(second, c_other, c), select(second, h_other, h), select(second, c, c_other),
                select(second, h, h_other)};
    }

    /// Adds the contacts with the first `count` of W found rods.
    void meet(int place, int *found, int count, Sums &sums) const {
        for (int lane = count; lane < W; ++lane) found[lane] = found[0];
        const int rod = order_[place];
        Mask<float> second, mine; // this rod is the second of the pair; lanes that are in use
        for (int lane = 0; lane < W; ++lane) {
            second[lane] = order_[found[lane]] < rod ? -1 : 0;
            mine[lane] = lane < count ? -1 : 0;
        }
        const Closest at = closest(place, found, second);
        const Floats square = dot(at.gap, at.gap);
        mine &= square < law_.reach * law_.reach;
        if (!any<float>(mine)) return;
        const RodForce force = touch(place, found, second, mine, at, square);
        const Floats sign = select<float>(second, splat(-1.0f), splat(1.0f));
        const Floats mine_at = select<float>(second, at.t, at.s);
        const Floats along = select<float>(mine, force.along, splat(0.0f));
        const Floats across = select<float>(mine, force.normal, splat(0.0f)) - along;
        const Points f = select(mine, sign * force.force, Points{}), n = force.n;
        const Floats values[9] = {f.x, f.y, f.z, along + across * n.x * n.x, across * n.x * n.y, across * n.x * n.z,
                                  along + across * n.y * n.y, across * n.y * n.z, along + across * n.z * n.z};
        for (int k = 0; k < 9; ++k) {
            sums.at[0][k] += 0.5f * (1 - mine_at) * values[k];
            sums.at[1][k] += 0.5f * (1 + mine_at) * values[k];
        }
        sums.any = true;
    }

    /// The force on the first rod of each pair.
    RINGLET_INLINE RodForce touch(int place, const int *found, Mask<float> second, Mask<float> near, const Closest &at,
                                  Floats square) const {
        const int strand = strand_[place];
        Floats allowed = splat(law_.reach);
        for (uint32_t bits = set_lanes<float>(near); bits; bits &= bits - 1) {
            const int lane = __builtin_ctz(bits);
            allowed[lane] = allowed_.of(strand, strand_[found[lane]], law_.reach);
        }
        const Points v = sorted_.every(2, place), g = sorted_.every(3, place);
        const Points v_other = sorted_.pick(2, found), g_other = sorted_.pick(3, found);
        const Points u1 = select(second, v_other, v) + at.s * select(second, g_other, g);
        const Points u2 = select(second, v, v_other) + at.t * select(second, g, g_other);
        return {law_, at.gap, square_root<float>(maximum<float>(square, splat(1e-16f))), allowed, u1 - u2};
    }
};

} // namespace ringlet
