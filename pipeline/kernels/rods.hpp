// All segments of all strands as soft rods: sorted into cells, and the forces of all that touch.
//
// A rod meets those of the 27 cells around its middle. It works out the force on itself only, from all it touches, in
// the order of the cells: every pair is computed twice, but no lists are kept, so that no result depends on threads or
// earlier steps. Both sides of a pair compute the same numbers (what lies lower in this order is first): their forces are opposite.
#pragma once

#include "capsule_pairs.hpp"
#include "rod_data.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <omp.h>

namespace ringlet {

/// What all contacts of a rod do to its two points: a force and the matrix C (xx, xy, xz, yy, yz, zz) of each.
struct RodLoad {
    float at[2][9];
};

/// The rods of one step in their cells, and their contacts.
class RodGrid {
    static constexpr int W = kLanes<float>;
    static constexpr int kChunk = 64;   // rods that a thread takes at a time
    static constexpr int kRange = 2048; // rods whose extent is one thread's work

  public:
    /// `allowed`: see Closeness; `cell` [m]: the middles of two rods that touch are no farther apart.
    RodGrid(const Closeness &allowed, int count, int per_strand, double cell, const RodLaw &law)
        : allowed_(allowed), per_strand_(per_strand), cell_size_(float(cell)), law_(law), all_(count), valid_(count),
          touched_(count), loads_(count), cell_(count), ranges_((count + kRange - 1) / kRange) {}

    /// Puts a rod in: its ends, each a point and its velocity. `valid`: it may touch others.
    void put(int rod, const float (&a)[6], const float (&b)[6], bool valid) {
        for (int k = 0; k < 6; ++k) {
            const int part = k < 3 ? k : k + 3;
            all_[rod].part[part] = 0.5f * (a[k] + b[k]);
            all_[rod].part[part + 3] = 0.5f * (b[k] - a[k]);
        }
        valid_[rod] = valid;
    }

    /// Works out the loads. Called by every thread of a parallel region.
    void work() {
        sort();
        const int count = int(order_.size());
        fill();
        Nearby &nearby = nearby_[omp_get_thread_num()];
#pragma omp for schedule(dynamic, 1)
        for (int chunk = 0; chunk < (count + kChunk - 1) / kChunk; ++chunk) {
            find_pairs(chunk * kChunk, std::min(count, (chunk + 1) * kChunk), nearby);
            keep_near(nearby);
            for (int at = 0; at < nearby.near_count; at += W) meet(nearby, at);
        }
    }

    /// Tells `note(strand, strand, distance)` of all pairs that are nearer than the reach. Not in a parallel region.
    template <class Note> void measure(Note note) {
        sort();
        fill();
        Nearby nearby;
        for (int place = 0; place < int(order_.size()); place += kChunk) {
            find_pairs(place, std::min(int(order_.size()), place + kChunk), nearby);
            keep_near(nearby);
            for (int at = 0; at < nearby.near_count; at += W) {
                const Pairs pairs(nearby, at);
                const Points gap = closest(pairs.own, pairs.other).gap;
                const Floats distance = square_root<float>(dot(gap, gap));
                for (int lane = 0; lane < std::min(W, nearby.near_count - at); ++lane)
                    note(strand_[pairs.own[lane]], strand_[pairs.other[lane]], distance[lane]);
            }
        }
    }

    /// Load of a rod, or null if it touches nothing.
    const RodLoad *load(int rod) const { return touched_[rod] ? &loads_[rod] : nullptr; }

  private:
    struct Extent {
        float low[3] = {1e30f, 1e30f, 1e30f}, high[3] = {-1e30f, -1e30f, -1e30f};
    };

    /// What a thread works with: the rods of the 27 cells around one, and the pairs of some rods with others.
    struct Nearby {
        std::vector<float> x, y, z, limit;
        std::vector<int> strand, place, found;
        std::vector<int> own, other, near; // pairs of places; those of them whose rods are within reach
        int count = 0, pair_count = 0, near_count = 0;

        void make_room(size_t rods) {
            if (x.size() >= rods + 2 * W) return;
            for (auto *values : {&x, &y, &z, &limit}) values->resize(2 * rods + 2 * W);
            for (auto *values : {&strand, &place, &found}) values->resize(2 * rods + 2 * W);
        }

        void make_room_for_pairs(size_t pairs) {
            if (own.size() >= pairs + 2 * W) return;
            for (auto *values : {&own, &other, &near}) values->resize(2 * pairs + 2 * W);
        }
    };

    /// Places of W pairs of rods that are within reach; past the last pair, the last one again.
    struct Pairs {
        int own[W], other[W];

        Pairs(const Nearby &nearby, int at) {
            for (int lane = 0; lane < W; ++lane) {
                const int pair = nearby.near[std::min(at + lane, nearby.near_count - 1)];
                own[lane] = nearby.own[pair], other[lane] = nearby.other[pair];
            }
        }
    };

    const Closeness &allowed_;
    const int per_strand_;
    const float cell_size_;
    const RodLaw law_;
    std::vector<Rod> all_;
    Rods sorted_;
    std::vector<float> limit_; // square of how near to a rod's middle a segment must come to touch it
    std::vector<uint8_t> valid_, touched_;
    std::vector<RodLoad> loads_;
    std::vector<int> cell_, first_, order_, strand_; // cell of a rod; first place of a cell; rod and strand at a place
    int from_[3] = {0, 0, 0}, n_[3] = {1, 1, 1}; // first cell and number of cells
    std::vector<Extent> ranges_;
    std::vector<Nearby> nearby_; // of each thread

    /// Counting sort by cells; rods of one cell stay in their order.
    void sort() {
        const int count = int(valid_.size());
#pragma omp for schedule(static)
        for (int range = 0; range < int(ranges_.size()); ++range) measure_extent(range);
#pragma omp single
        span_cells();
#pragma omp for schedule(static)
        for (int k = 0; k < count; ++k) {
            touched_[k] = 0;
            cell_[k] = -1;
            if (!valid_[k]) continue;
            int at[3];
            for (int axis = 0; axis < 3; ++axis) at[axis] = cell_along(all_[k].part[axis]) - from_[axis];
            cell_[k] = (at[2] * n_[1] + at[1]) * n_[0] + at[0];
        }
#pragma omp single
        order_cells();
    }

    int cell_along(float x) const { return int(std::floor(x * (1 / cell_size_))); }

    void measure_extent(int range) {
        Extent extent;
        for (int k = range * kRange; k < std::min(int(valid_.size()), (range + 1) * kRange); ++k)
            for (int axis = 0; axis < 3 && valid_[k]; ++axis) {
                extent.low[axis] = std::min(extent.low[axis], all_[k].part[axis]);
                extent.high[axis] = std::max(extent.high[axis], all_[k].part[axis]);
            }
        ranges_[range] = extent;
    }

    /// The box of cells around all rods, and one more on every side.
    void span_cells() {
        for (int axis = 0; axis < 3; ++axis) {
            float low = 1e30f, high = -1e30f;
            for (const Extent &extent : ranges_)
                low = std::min(low, extent.low[axis]), high = std::max(high, extent.high[axis]);
            if (low > high) low = high = 0; // no rod is valid
            from_[axis] = cell_along(low) - 1;
            n_[axis] = cell_along(high) + 2 - from_[axis];
        }
    }

    void order_cells() {
        first_.assign(size_t(n_[0]) * n_[1] * n_[2] + 1, 0);
        for (int cell : cell_)
            if (cell >= 0) ++first_[cell + 1];
        for (size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
        const int kept = first_.back();
        nearby_.resize(std::max<size_t>(nearby_.size(), omp_get_num_threads()));
        order_.resize(kept), strand_.resize(kept + W), limit_.resize(kept + W), sorted_.resize(kept);
        // Filling backwards moves the end of a cell to its start; the cell before has it then
        for (int k = int(cell_.size()) - 1; k >= 0; --k)
            if (cell_[k] >= 0) order_[--first_[cell_[k] + 1]] = k;
        std::copy(first_.begin() + 1, first_.end(), first_.begin());
        first_.back() = kept;
    }

    /// The rods in the order of their cells.
    void fill() {
        const int count = int(order_.size());
#pragma omp for schedule(static)
        for (int place = 0; place < count; ++place) {
            strand_[place] = order_[place] / per_strand_;
            const Rod &rod = all_[order_[place]];
            for (int k = 0; k < 12; ++k) sorted_.part[k][place] = rod.part[k];
            const float *h = rod.part + 3, limit = law_.reach + std::sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
            limit_[place] = 1.001f * limit * limit;
        }
    }

    /// Copies what `find` reads, so that it runs through whole vectors: 9 runs of 3 cells each.
    void collect(int cell, Nearby &nearby) const {
        nearby.count = 0;
        for (int run = 0; run < 9; ++run) {
            const int middle = cell + ((run / 3 - 1) * n_[1] + run % 3 - 1) * n_[0];
            const int begin = first_[middle - 1], count = first_[middle + 2] - begin;
            nearby.make_room(nearby.count + count);
            for (int k = 0; k < count; k += W) {
                const int to = nearby.count + k, from = begin + k;
                copy(sorted_.part[0], from, nearby.x, to), copy(sorted_.part[1], from, nearby.y, to);
                copy(sorted_.part[2], from, nearby.z, to), copy(limit_, from, nearby.limit, to);
                copy(strand_, from, nearby.strand, to);
                for (int lane = 0; lane < W; ++lane) nearby.place[to + lane] = from + lane;
            }
            nearby.count += count;
        }
        for (int lane = 0; lane < W; ++lane) nearby.limit[nearby.count + lane] = 0; // nothing is near enough to these
    }

    template <class T>
    static RINGLET_INLINE void copy(const std::vector<T> &from, int at, std::vector<T> &to, int place) {
        __builtin_memcpy(&to[place], &from[at], W * sizeof(T));
    }

    /// The pairs of the rods at begin .. end - 1 with rods that may touch them.
    void find_pairs(int begin, int end, Nearby &nearby) const {
        nearby.pair_count = 0;
        for (int place = begin; place < end; ++place) {
            const int cell = cell_[order_[place]];
            if (place == begin || cell != cell_[order_[place - 1]]) collect(cell, nearby);
            find(place, nearby);
        }
    }

    /// Appends the pairs of one rod with those of other strands whose middle is near enough to its segment.
    void find(int place, Nearby &nearby) const {
        const Points middle = sorted_.every(0, place), half = sorted_.every(1, place);
        const Floats per_square = reciprocal<float>(dot(half, half));
        const int strand = strand_[place];
        int count = 0;
        for (int at = 0; at < nearby.count; at += W) {
            const Points there = {Rods::read(nearby.x, at), Rods::read(nearby.y, at), Rods::read(nearby.z, at)};
            const Points apart = there - middle;
            const Points away = apart - clamp_one(dot(apart, half) * per_square) * half;
            Mask<float> other;
            __builtin_memcpy(&other, &nearby.strand[at], sizeof other);
            const Mask<float> near = (dot(away, away) < Rods::read(nearby.limit, at)) & (other != strand);
            count += write_set_lanes(near, at, &nearby.found[count]);
        }
        nearby.make_room_for_pairs(nearby.pair_count + count);
        for (int k = 0; k < count; ++k) {
            nearby.own[nearby.pair_count + k] = place;
            nearby.other[nearby.pair_count + k] = nearby.place[nearby.found[k]];
        }
        nearby.pair_count += count;
    }

    /// Keeps the pairs that are within reach.
    void keep_near(Nearby &nearby) const {
        nearby.near_count = 0;
        if (nearby.pair_count == 0) return;
        for (int lane = 0; lane < W; ++lane) { // the last vector is filled up
            nearby.own[nearby.pair_count + lane] = nearby.own[0];
            nearby.other[nearby.pair_count + lane] = nearby.other[0];
        }
        for (int at = 0; at < nearby.pair_count; at += W) {
            const Points gap = closest(&nearby.own[at], &nearby.other[at]).gap;
            Mask<float> near = dot(gap, gap) < law_.reach * law_.reach;
            for (int lane = nearby.pair_count - at; lane < W; ++lane) near[lane] = 0;
            nearby.near_count += write_set_lanes(near, at, &nearby.near[nearby.near_count]);
        }
    }

    /// Whether the own rod of a pair is the second one: both sides of it must compute the same.
    static RINGLET_INLINE Mask<float> is_second(const int *own, const int *other) {
        Mask<float> a, b;
        __builtin_memcpy(&a, own, sizeof a);
        __builtin_memcpy(&b, other, sizeof b);
        return b < a;
    }

    RINGLET_INLINE Closest closest(const int *own, const int *other) const {
        const Mask<float> second = is_second(own, other);
        const Points c = sorted_.pick(0, own), h = sorted_.pick(1, own);
        const Points c_other = sorted_.pick(0, other), h_other = sorted_.pick(1, other);
        return {select(second, c_other, c), select(second, h_other, h), select(second, c, c_other),
                select(second, h, h_other)};
    }

    /// The force between the rods of W pairs, and its load on the own one.
    void meet(const Nearby &nearby, int at) {
        const Pairs pairs(nearby, at);
        const Mask<float> second = is_second(pairs.own, pairs.other);
        const Closest near = closest(pairs.own, pairs.other);
        const RodForce force = touch(pairs, second, near);
        const Points f = select<float>(second, splat(-1.0f), splat(1.0f)) * force.force, n = force.n;
        const Floats along = force.along, across = force.normal - along;
        const Floats upper = 0.5f * (1 + select<float>(second, near.t, near.s));
        const Floats load[9] = {f.x, f.y, f.z, along + across * n.x * n.x, across * n.x * n.y, across * n.x * n.z,
                                along + across * n.y * n.y, across * n.y * n.z, along + across * n.z * n.z};
        for (int lane = 0; lane < std::min(W, nearby.near_count - at); ++lane)
            if (force.normal[lane] > 0) add_load(order_[pairs.own[lane]], load, upper, lane);
    }

    RINGLET_INLINE void add_load(int rod, const Floats (&load)[9], const Floats &upper, int lane) {
        RodLoad &sum = loads_[rod];
        if (!touched_[rod]) sum = {};
        touched_[rod] = 1;
        const float part = upper[lane];
        for (int k = 0; k < 9; ++k) {
            const float high = part * load[k][lane];
            sum.at[0][k] += load[k][lane] - high;
            sum.at[1][k] += high;
        }
    }

    /// The force on the first rod of each pair.
    RINGLET_INLINE RodForce touch(const Pairs &pairs, Mask<float> second, const Closest &near) const {
        Floats allowed;
        for (int lane = 0; lane < W; ++lane)
            allowed[lane] = allowed_.of(strand_[pairs.own[lane]], strand_[pairs.other[lane]], law_.reach);
        const Points v = sorted_.pick(2, pairs.own), g = sorted_.pick(3, pairs.own);
        const Points v_other = sorted_.pick(2, pairs.other), g_other = sorted_.pick(3, pairs.other);
        const Points u1 = select(second, v_other, v) + near.s * select(second, g_other, g);
        const Points u2 = select(second, v, v_other) + near.t * select(second, g, g_other);
        const Floats square = maximum<float>(dot(near.gap, near.gap), splat(1e-16f));
        return {law_, near.gap, square_root<float>(square), allowed, u1 - u2};
    }
};

} // namespace ringlet
