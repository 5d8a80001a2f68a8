// A square of a shadow map, small enough for a core's cache, while one thread fills it.
//
// A segment counts at steps no longer than a node's spacing. Steps in the square and in the cells around it are written
// down once, side by side. The nearest of each cell make the front; then, behind the front, each counts in the layer
// that it lies in, of the nearest node. The cells around tell the front of the square's nodes and of their neighbours,
// so that every square is made without the others.
#pragma once

#include "shadow_map.hpp"

#include <algorithm>
#include <cmath>

namespace ringlet {

/// A segment on the map.
struct CastSegment {
    float u, v, w;    // of its first step: nodes, nodes, [m]
    float du, dv, dw; // from one step to the next
    uint32_t counts;  // what each step adds
    int32_t steps;    // none if it casts no shadow
};

class ShadowSquare {
  public:
    static constexpr float kCount = 65536; // counts for a mean of one strand

    explicit ShadowSquare(ShadowMap &map)
        : map_(map), nearest_(kCells * kCells), front_(kNodes * kNodes + 1), counts_(kSide * kSide * K + 1) {}

    /// Squares along an axis of so many nodes.
    static int along(int nodes) { return (nodes + kSide - 1) / kSide; }

    /// The squares along an axis of n nodes, first and last, in which steps from `from` to `from + way` may count; whether
    /// there are any.
    static RINGLET_INLINE Ints reached(Floats from, Floats way, int n, Ints range[2]) {
        constexpr float slack = 0.2f; // all of this is rounded
        const Floats none = splat(0.0f), most = splat(n - 1.0f);
        const Floats low = from + minimum<float>(way, none) - (kAfter + slack), high = from + maximum<float>(way, none) + (kBefore + slack);
        range[0] = whole(minimum<float>(maximum<float>(low, none), most) * (1.0f / kSide));
        range[1] = whole(minimum<float>(maximum<float>(high, none), most) * (1.0f / kSide));
        return (high >= 0.0f) & (low < float(n));
    }

    /// Fills square (a, b) with those of the segments whose numbers are given.
    void fill(int a, int b, const CastSegment *segments, const uint32_t *numbers, size_t count) {
        left_ = a * kSide, top_ = b * kSide;
        write_steps(segments, numbers, count);
        find_front();
        count_layers();
        add_up();
    }

  private:
    static constexpr int K = ShadowMap::kLayers, kSide = 64; // nodes along a square
    static constexpr int kBefore = 3, kAfter = 2;            // cells around it
    static constexpr int kCells = kSide + kBefore + kAfter, kNodes = kSide + 2;

    ShadowMap &map_;
    int left_ = 0, top_ = 0;     // its first node
    size_t steps_ = 0;           // of all segments
    std::vector<float> u_, v_, w_;
    std::vector<uint32_t> share_;
    std::vector<float> nearest_; // of each cell, from `kBefore` before the first on
    std::vector<float> front_;   // of each node, from the one before the first on
    std::vector<uint32_t> counts_; // of each node's layers, and of those outside

    template <class Lanes, class Value> static RINGLET_INLINE Lanes read(const std::vector<Value> &from, size_t at) {
        Lanes lanes;
        __builtin_memcpy(&lanes, from.data() + at, sizeof lanes);
        return lanes;
    }

    template <class Lanes, class Value> static RINGLET_INLINE void write(std::vector<Value> &to, size_t at, const Lanes &lanes) {
        __builtin_memcpy(to.data() + at, &lanes, sizeof lanes);
    }

    void room_for(size_t steps) {
        if (steps <= u_.size()) return;
        for (std::vector<float> *values : {&u_, &v_, &w_}) values->resize(2 * steps);
        share_.resize(2 * steps);
    }

    void write_steps(const CastSegment *segments, const uint32_t *numbers, size_t count) {
        const float low[2] = {float(left_ - kBefore), float(top_ - kBefore)};
        const float least[2] = {std::max(low[0], 1.0f), std::max(low[1], 1.0f)};
        const float most[2] = {std::min(low[0] + kCells, map_.n[0] - 2.0f), std::min(low[1] + kCells, map_.n[1] - 2.0f)};
        Floats lane;
        for (int k = 0; k < 16; ++k) lane[k] = float(k);
        steps_ = 0;
        for (size_t i = 0; i < count; ++i) {
            if (i + 8 < count) __builtin_prefetch(segments + numbers[i + 8]);
            const CastSegment &s = segments[numbers[i]];
            int first = 0, last = s.steps;
            if (last > 16) narrow(s, low, first, last);
            if (first < last) room_for(steps_ + size_t(last - first) + 32);
            for (; first < last; first += 16) {
                const Floats t = lane + float(first), u = s.u + t * s.du, v = s.v + t * s.dv, w = s.w + t * s.dw;
                const Ints which = (t < float(last)) & (u >= least[0]) & (v >= least[1]) & (u < most[0]) & (v < most[1]) & (w >= 0.0f) & (w < 10.0f);
                write(share_, steps_, Words{} + s.counts);
                pack_set_lanes(which, u, &u_[steps_]), pack_set_lanes(which, v, &v_[steps_]);
                steps_ += size_t(pack_set_lanes(which, w, &w_[steps_]));
            }
        }
        room_for(steps_ + 16);
        // The rest of the last 16 counts for nothing
        write(u_, steps_, splat(least[0])), write(v_, steps_, splat(least[1]));
        write(w_, steps_, splat(ShadowMap::kFar)), write(share_, steps_, Words{});
    }

    /// Narrows the steps of a long segment to those that may count here.
    static void narrow(const CastSegment &s, const float low[2], int &first, int &last) {
        const float from[2] = {s.u, s.v}, step[2] = {s.du, s.dv};
        for (int k = 0; k < 2; ++k) {
            if (std::abs(step[k]) < 1e-3f) continue;
            const float a = (low[k] - 1 - from[k]) / step[k], b = (low[k] + kCells + 1 - from[k]) / step[k];
            first = std::max(first, int(std::min(a, b))), last = std::min(last, int(std::max(a, b)) + 1);
        }
    }

    /// The front: each node's is the nearest hair in the four cells around it, so that between nodes nothing is before it.
    void find_front() {
        std::fill(nearest_.begin(), nearest_.end(), ShadowMap::kFar);
        for (size_t first = 0; first < steps_; first += 16) {
            alignas(64) int cells[16];
            const Ints i = whole(read<Floats>(u_, first)) - (left_ - kBefore), j = whole(read<Floats>(v_, first)) - (top_ - kBefore);
            const Ints at = i * kCells + j;
            __builtin_memcpy(cells, &at, sizeof cells);
            for (int k = 0; k < 16; ++k) nearest_[cells[k]] = std::min(nearest_[cells[k]], w_[first + k]);
        }
        for (int i = 0; i < kNodes; ++i) {
            const float *cells = nearest_.data() + i * kCells; // of the four rows around
            float two[kCells], four[kCells];
            for (int j = 0; j < kCells; ++j) {
                two[j] = std::min(cells[kCells + j], cells[2 * kCells + j]);
                four[j] = std::min(two[j], std::min(cells[j], cells[3 * kCells + j]));
            }
            for (int j = 0; j < kNodes; ++j) {
                const float around = std::min(two[j + 1], two[j + 2]);
                // Beside the hair the front goes on, so that skin there is not taken for hair
                const float wider = std::min(std::min(four[j], four[j + 1]), std::min(four[j + 2], four[j + 3]));
                const float front = around < ShadowMap::kFar ? around : wider;
                front_[i * kNodes + j] = front < ShadowMap::kFar ? front : 10.0f;
            }
        }
        for_nodes([&](int i, int j, size_t node) RINGLET_ALWAYS {
            map_.surface[2 * node] = front_[(i + 1) * kNodes + j + 1], map_.surface[2 * node + 1] = 0;
        });
    }

    /// Calls visit(i, j, number) for the square's nodes.
    template <class Visit> RINGLET_INLINE void for_nodes(Visit &&visit) const {
        const int rows = std::min(kSide, map_.n[0] - left_), columns = std::min(kSide, map_.n[1] - top_);
        for (int i = 0; i < rows; ++i)
            for (int j = 0; j < columns; ++j) visit(i, j, size_t(left_ + i) * map_.n[1] + top_ + j);
    }

    /// Counts in each layer but the last of the nodes.
    void count_layers() {
        const float inverse = 1 / map_.unit;
        for (size_t first = 0; first < steps_; first += 16) {
            const Floats u = read<Floats>(u_, first), v = read<Floats>(v_, first), w = read<Floats>(w_, first);
            const Ints i = whole(u), j = whole(v);
            const Floats fu = u - real(i), fv = v - real(j);
            const Ints a = i - left_ + (fu >= 0.5f ? Ints{} + 1 : Ints{}), b = j - top_ + (fv >= 0.5f ? Ints{} + 1 : Ints{});
            const Ints inside = (a >= 0) & (a < kSide) & (b >= 0) & (b < kSide);
            const Ints cell = inside ? (i - left_ + 1) * kNodes + j - top_ + 1 : Ints{};
            Floats f[4];
            gather_pairs<float>(front_.data(), cell, f[0], f[1]);
            gather_pairs<float>(front_.data() + kNodes, cell, f[2], f[3]);
            const Floats front = (1.0f - fu) * ((1.0f - fv) * f[0] + fv * f[1]) + fu * ((1.0f - fv) * f[2] + fv * f[3]);
            const Floats x = 1.0f + maximum<float>(w - front, splat(0.0f)) * inverse;
            Ints bits;
            __builtin_memcpy(&bits, &x, sizeof bits);
            Ints layer = whole(real(bits - 0x3f800000) * (ShadowMap::kOctave / 8388608.0f));
            layer = layer < K - 2 ? layer : Ints{} + (K - 2);
            const Ints to = inside ? (a * kSide + b) * K + layer : Ints{} + kSide * kSide * K;
            alignas(64) int at[16];
            __builtin_memcpy(at, &to, sizeof at);
            for (int k = 0; k < 16; ++k) counts_[at[k]] += share_[first + k];
        }
    }

    /// Makes the layers of the nodes of their counts, which are 0 again then. Float sums are exact up to 256 strands.
    void add_up() {
        for_nodes([&](int i, int j, size_t node) RINGLET_ALWAYS {
            const size_t own = size_t(i * kSide + j) * K;
            Words counts[2] = {read<Words>(counts_, own), read<Words>(counts_, own + 16)};
            float before = 0;
            for (int half = 0; half < 2; ++half) {
                const Floats until = sums_until(__builtin_convertvector(counts[half], Floats) * (1 / kCount)) + before;
                Sums::write(map_.layers.bits.get() + node * K + 16 * half, shifted<1>(until, before));
                before = until[15];
                write(counts_, own + 16 * half, Words{});
            }
            map_.surface[2 * node + 1] = before;
        });
    }

    /// Lanes moved up by so many, `low` below them.
    template <int by> static RINGLET_INLINE Floats shifted(Floats lanes, float low) {
        Ints from;
        for (int k = 0; k < 16; ++k) from[k] = k < by ? 16 : k - by;
        return __builtin_shuffle(lanes, splat(low), from);
    }

    /// Sums of all lanes up to each.
    static RINGLET_INLINE Floats sums_until(Floats x) {
        x += shifted<1>(x, 0), x += shifted<2>(x, 0), x += shifted<4>(x, 0);
        return x + shifted<8>(x, 0);
    }
};

} // namespace ringlet
