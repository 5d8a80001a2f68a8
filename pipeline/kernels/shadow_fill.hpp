// How a shadow map is made of strands and of the head.
//
// A segment counts at steps no longer than a node's spacing. Segments are sorted into squares of the map that a core's
// cache holds, and each square is filled by one thread: first the nearest hair of each cell, of which the front is made,
// then the sums of the layers. Sums are integers, so nothing depends on the order of strands.
#pragma once

#include "distance_field.hpp"
#include "pose.hpp"
#include "shadow_map.hpp"
#include "sweep.hpp"

#include <algorithm>
#include <cmath>

namespace ringlet {

/// Strands that cast shadows, kept until all are there.
struct Casters {
    std::vector<float> points, widths; // (S, P, 3) from the maps' centre on [m], (S, P) [m]
    int P = 0;

    size_t count() const { return P ? widths.size() / P : 0; }
};

/// Hair on voxels, which tells what is deep in it: not exact, but there only the sum of the strands matters.
struct HairVoxels {
    static constexpr float kDeep = 16; // strands, behind which nothing is lit directly

    const float *density; // (nx, ny, nz) [1/m]
    int n[3];
    float origin[3];      // [m] corner of the first voxel, from the maps' centre on
    float spacing;        // [m]

    /// Whether something is deep, for each voxel.
    std::vector<uint8_t> deep(const float direction[3]) const {
        const size_t voxels = size_t(n[0]) * n[1] * n[2];
        std::vector<float> before(voxels);
        sweep(density, before.data(), n, spacing, direction);
        std::vector<uint8_t> result(voxels);
        for (size_t i = 0; i < voxels; ++i) result[i] = before[i] > kDeep;
        return result;
    }

    /// The voxel of a point; -1 outside.
    ptrdiff_t at(const float *x) const {
        ptrdiff_t index = 0;
        const float inverse = 1 / spacing;
        for (int k = 0; k < 3; ++k) {
            const float v = (x[k] - origin[k]) * inverse;
            if (!(v >= 0 && v < float(n[k]))) return -1;
            index = index * n[k] + ptrdiff_t(v);
        }
        return index;
    }
};

/// A segment on the map.
struct CastSegment {
    float u, v, w;    // of its first step: nodes, nodes, [m]
    float du, dv, dw; // from one step to the next
    uint32_t counts;  // what each step adds
    int32_t steps;    // none if it casts no shadow
};

class ShadowFill {
  public:
    ShadowFill(ShadowMap &map, const Casters &casters, int threads) : map_(map), casters_(casters), threads_(threads) {}

    void operator()(const HairVoxels &voxels, const std::vector<uint8_t> &deep) {
        place(voxels, deep);
        sort_into_squares();
        find_front();
        sum_layers();
    }

  private:
    static constexpr int K = ShadowMap::kLayers, kSide = 32; // nodes along a square
    static constexpr float kCount = 65536;                    // counts for a mean of one strand

    ShadowMap &map_;
    const Casters &casters_;
    const int threads_;
    std::vector<CastSegment> segments_;
    std::vector<uint32_t> sorted_; // segments, square after square
    std::vector<size_t> begin_;    // (squares + 1,) of each square's
    std::vector<float> front_;     // of each node [m] above low[2]

    int across() const { return (map_.n[1] + kSide - 1) / kSide; }
    int squares() const { return (map_.n[0] + kSide - 1) / kSide * across(); }

    /// All segments on the map, in the order of strands.
    void place(const HairVoxels &voxels, const std::vector<uint8_t> &deep) {
        const int P = casters_.P;
        segments_.resize(casters_.count() * size_t(std::max(P - 1, 0)));
#pragma omp parallel for schedule(static) num_threads(threads_)
        for (size_t s = 0; s < casters_.count(); ++s) {
            float before[3] = {};
            bool was_deep = false;
            for (int j = 0; j < P; ++j) {
                const float *x = casters_.points.data() + 3 * (s * P + j);
                float here[3];
                for (int k = 0; k < 3; ++k) {
                    const float *a = map_.axis[k];
                    here[k] = a[0] * x[0] + a[1] * x[1] + a[2] * x[2] - map_.low[k];
                    if (k < 2) here[k] *= 1 / map_.spacing;
                }
                const ptrdiff_t voxel = voxels.at(x);
                const bool is_deep = voxel >= 0 && deep[voxel];
                const float *widths = casters_.widths.data() + s * P + j;
                if (j > 0) segments_[s * (P - 1) + j - 1] = segment(before, here, 0.5f * (widths[-1] + widths[0]), is_deep && was_deep);
                std::copy(here, here + 3, before);
                was_deep = is_deep;
            }
        }
    }

    /// A segment between two points on the map; where it is deep, of one step.
    CastSegment segment(const float *from, const float *to, float width, bool deep) const {
        const float du = to[0] - from[0], dv = to[1] - from[1], dw = to[2] - from[2], length = std::sqrt(du * du + dv * dv);
        // Not-a-number and strands that broke cast no shadow
        if (!(length > 0 && length < 1e4f)) return {};
        const int steps = deep ? 1 : int(length) + 1;
        const float part = 1.0f / steps, share = length * width / map_.spacing * map_.opacity * part;
        return {from[0] + 0.5f * part * du, from[1] + 0.5f * part * dv, from[2] + 0.5f * part * dw, part * du, part * dv, part * dw,
                uint32_t(share * kCount + 0.5f), steps};
    }

    /// Calls visit(square) for squares that a segment's steps may count in.
    template <class Visit> void each_square(const CastSegment &s, Visit &&visit) const {
        if (s.steps == 0) return;
        int first[2], last[2];
        const float from[2] = {s.u, s.v}, way[2] = {(s.steps - 1) * s.du, (s.steps - 1) * s.dv};
        for (int k = 0; k < 2; ++k) {
            const float low = from[k] + std::min(way[k], 0.0f) - 0.6f, high = from[k] + std::max(way[k], 0.0f) + 0.6f;
            if (!(high >= 0 && low < float(map_.n[k]))) return;
            first[k] = int(std::max(low, 0.0f)) / kSide, last[k] = int(std::min(high, map_.n[k] - 1.0f)) / kSide;
        }
        for (int a = first[0]; a <= last[0]; ++a)
            for (int b = first[1]; b <= last[1]; ++b) visit(a * across() + b);
    }

    /// A counting sort, with counters for each thread.
    void sort_into_squares() {
        std::vector<std::vector<size_t>> next(threads_, std::vector<size_t>(squares()));
        const auto share = [&](int thread) { return segments_.size() * thread / threads_; };
#pragma omp parallel for schedule(static, 1) num_threads(threads_)
        for (int thread = 0; thread < threads_; ++thread)
            for (size_t i = share(thread); i < share(thread + 1); ++i)
                each_square(segments_[i], [&](int square) { ++next[thread][square]; });
        begin_.assign(1, 0);
        size_t total = 0;
        for (int square = 0; square < squares(); ++square) {
            for (auto &mine : next) {
                const size_t count = mine[square];
                mine[square] = total, total += count;
            }
            begin_.push_back(total);
        }
        sorted_.resize(total);
#pragma omp parallel for schedule(static, 1) num_threads(threads_)
        for (int thread = 0; thread < threads_; ++thread)
            for (size_t i = share(thread); i < share(thread + 1); ++i)
                each_square(segments_[i], [&](int square) { sorted_[next[thread][square]++] = uint32_t(i); });
    }

    /// Calls visit(u, v, w, which, counts) for the steps of a square's segments, 16 side by side, `which` of them on the map.
    template <class Visit> RINGLET_INLINE void each_step(int square, Visit &&visit) const {
        const float low[2] = {float(square / across() * kSide), float(square % across() * kSide)};
        Floats lane;
        for (int k = 0; k < 16; ++k) lane[k] = float(k);
        for (size_t i = begin_[square]; i < begin_[square + 1]; ++i) {
            if (i + 8 < begin_[square + 1]) __builtin_prefetch(&segments_[sorted_[i + 8]]);
            const CastSegment &s = segments_[sorted_[i]];
            int first = 0, last = s.steps;
            if (last > 16) near(s, low, first, last);
            for (; first < last; first += 16) {
                const Floats t = lane + float(first), u = s.u + t * s.du, v = s.v + t * s.dv, w = s.w + t * s.dw;
                const Ints which = (t < float(last)) & (u >= 1.0f) & (v >= 1.0f) & (u < float(map_.n[0] - 2)) & (v < float(map_.n[1] - 2)) &
                                   (w >= 0.0f) & (w < 10.0f);
                visit(which ? u : splat(0.0f), which ? v : splat(0.0f), w, which, s.counts);
            }
        }
    }

    /// Narrows the steps of a long segment to those that may count in the square from `low` on.
    static void near(const CastSegment &s, const float low[2], int &first, int &last) {
        const float from[2] = {s.u, s.v}, step[2] = {s.du, s.dv};
        for (int k = 0; k < 2; ++k) {
            if (std::abs(step[k]) < 1e-3f) continue;
            const float a = (low[k] - 2 - from[k]) / step[k], b = (low[k] + kSide + 2 - from[k]) / step[k];
            first = std::max(first, int(std::min(a, b))), last = std::min(last, int(std::max(a, b)) + 1);
        }
    }

    /// The front: each node's is the nearest hair in the four cells around it, so that between nodes nothing is before it.
    void find_front() {
        const int nu = map_.n[0], nv = map_.n[1];
        const size_t row = nv + 4;
        std::vector<float> nearest((nu + 4) * row, ShadowMap::kFar); // of each cell, from two before the first on
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads_)
        for (int square = 0; square < squares(); ++square) {
            const int left = square / across() * kSide, top = square % across() * kSide;
            each_step(square, [&](Floats u, Floats v, Floats w, Ints which, uint32_t) RINGLET_ALWAYS {
                const Ints i = whole(u), j = whole(v), at = (i + 2) * int(row) + j + 2;
                which &= (i >= left) & (i < left + kSide) & (j >= top) & (j < top + kSide);
                for (uint32_t lanes = set_lanes<float>(which); lanes; lanes &= lanes - 1) {
                    const int k = __builtin_ctz(lanes);
                    float &cell = nearest[at[k]];
                    cell = std::min(cell, w[k]);
                }
            });
        }
        front_.resize(map_.nodes());
        map_.surface.resize(2 * map_.nodes());
#pragma omp parallel for schedule(static) num_threads(threads_)
        for (int i = 0; i < nu; ++i) {
            const float *cells = nearest.data() + i * row; // of rows i - 2 .. i + 1
            std::vector<float> two(row), four(row);
            for (size_t j = 0; j < row; ++j) {
                two[j] = std::min(cells[row + j], cells[2 * row + j]);
                four[j] = std::min(two[j], std::min(cells[j], cells[3 * row + j]));
            }
            for (int j = 0; j < nv; ++j) {
                const float around = std::min(two[j + 1], two[j + 2]);
                // Beside the hair the front goes on, so that skin there is not taken for hair
                const float wider = std::min(std::min(four[j], four[j + 1]), std::min(four[j + 2], four[j + 3]));
                const float front = around < ShadowMap::kFar ? around : wider;
                const size_t node = size_t(i) * nv + j;
                front_[node] = front < ShadowMap::kFar ? front : 10.0f;
                map_.surface[2 * node] = front_[node], map_.surface[2 * node + 1] = 0;
            }
        }
    }

    void sum_layers() {
        map_.layers.clear(map_.nodes() * K);
#pragma omp parallel num_threads(threads_)
        {
            std::vector<uint32_t> counts(kSide * kSide * K);
#pragma omp for schedule(dynamic, 1)
            for (int square = 0; square < squares(); ++square) {
                if (begin_[square] == begin_[square + 1]) continue;
                count(square, counts.data());
                add_up(square, counts.data());
            }
        }
    }

    /// Counts in each layer but the last of a square's nodes.
    void count(int square, uint32_t *counts) const {
        const int left = square / across() * kSide, top = square % across() * kSide, nv = map_.n[1];
        const float inverse = 1 / map_.unit;
        each_step(square, [&](Floats u, Floats v, Floats w, Ints which, uint32_t share) RINGLET_ALWAYS {
            const Ints i = whole(u), j = whole(v);
            const Floats fu = u - real(i), fv = v - real(j);
            const Ints a = i - left + (fu >= 0.5f ? Ints{} + 1 : Ints{}), b = j - top + (fv >= 0.5f ? Ints{} + 1 : Ints{});
            which &= (a >= 0) & (a < kSide) & (b >= 0) & (b < kSide);
            if (!any<float>(which)) return;
            Floats f[4];
            gather_pairs<float>(front_.data(), i * nv + j, f[0], f[1]);
            gather_pairs<float>(front_.data() + nv, i * nv + j, f[2], f[3]);
            const Floats front = (1.0f - fu) * ((1.0f - fv) * f[0] + fv * f[1]) + fu * ((1.0f - fv) * f[2] + fv * f[3]);
            const Floats x = 1.0f + maximum<float>(w - front, splat(0.0f)) * inverse;
            Ints bits;
            __builtin_memcpy(&bits, &x, sizeof bits);
            Ints layer = whole(real(bits - 0x3f800000) * (ShadowMap::kOctave / 8388608.0f));
            layer = layer < K - 2 ? layer : Ints{} + (K - 2);
            const Ints to = (a * kSide + b) * K + layer;
            for (uint32_t lanes = set_lanes<float>(which); lanes; lanes &= lanes - 1) counts[to[__builtin_ctz(lanes)]] += share;
        });
    }

    /// Makes the layers of a square's nodes of their counts, which are 0 again then.
    void add_up(int square, uint32_t *counts) {
        const int left = square / across() * kSide, top = square % across() * kSide;
        for (int i = left; i < std::min(left + kSide, map_.n[0]); ++i)
            for (int j = top; j < std::min(top + kSide, map_.n[1]); ++j) {
                const size_t node = size_t(i) * map_.n[1] + j;
                uint32_t *own = counts + size_t((i - left) * kSide + j - top) * K;
                uint64_t sum = 0;
                for (int k = 0; k < K - 1; ++k) {
                    sum += own[k], own[k] = 0;
                    map_.layers.bits[node * K + k + 1] = Sums::packed(float(sum) * (1 / kCount));
                }
                map_.surface[2 * node + 1] = float(sum) * (1 / kCount);
            }
    }
};

/// Where rays enter the box of a field, and where they leave it [m]; they miss it if that is not later.
inline void within(const DistanceField &field, const Vec3<float> &start, const Vec3<float> &along, Floats &first, Floats &last) {
    const Floats from[3] = {start.x, start.y, start.z}, step[3] = {along.x, along.y, along.z};
    first = splat(-1e6f), last = splat(1e6f);
    for (int k = 0; k < 3; ++k) {
        const float low = float(field.origin[k]), high = low + float(field.spacing) * (field.n[k] - 1);
        const Ints flat = (step[k] < 1e-6f) & (step[k] > -1e-6f);
        const Floats inverse = 1.0f / (flat ? splat(1e-6f) : step[k]);
        const Floats a = (low - from[k]) * inverse, b = (high - from[k]) * inverse;
        first = maximum<float>(first, minimum<float>(a, b)), last = minimum<float>(last, maximum<float>(a, b));
    }
}

/// Where rays from the light meet the head, by its distance field (Hart, Sphere Tracing, 1996).
inline void find_solid(ShadowMap &map, const DistanceField *field, const Pose &pose, int threads) {
    map.solid.assign(map.nodes(), ShadowMap::kFar);
    if (!field) return;
    const Rigid<float> to_rest(pose.inverse());
    const Vec3<float> away = to_rest.turn({splat(map.axis[2][0]), splat(map.axis[2][1]), splat(map.axis[2][2])});
    Floats lane;
    for (int k = 0; k < 16; ++k) lane[k] = float(k);
    const auto world = [&](int k, Floats u, Floats v, Floats w) RINGLET_ALWAYS {
        return map.axis[0][k] * u + map.axis[1][k] * v + map.axis[2][k] * w + float(map.centre[k]);
    };
#pragma omp parallel for schedule(dynamic, 4) num_threads(threads)
    for (int i = 0; i < map.n[0]; ++i)
        for (int first = 0; first < map.n[1]; first += 16) {
            const Floats u = splat(map.low[0] + i * map.spacing), v = (lane + float(first)) * map.spacing + map.low[1];
            const Floats w = splat(map.low[2]);
            const Vec3<float> start = to_rest(Vec3<float>{world(0, u, v, w), world(1, u, v, w), world(2, u, v, w)});
            Floats way, end, phi, hit = splat(ShadowMap::kFar);
            within(*field, start, away, way, end);
            Vec3<float> gradient;
            Ints open = way < end;
            for (int step = 0; step < 128 && any<float>(open); ++step) {
                sample(*field, start + way * away, phi, gradient);
                hit = (open & (phi < 1e-4f)) ? way : hit;
                open &= (phi >= 1e-4f) & (way < end);
                way += open ? maximum<float>(phi, splat(2e-4f)) : splat(0.0f);
            }
            for (int k = 0; k < 16 && first + k < map.n[1]; ++k) map.solid[size_t(i) * map.n[1] + first + k] = hit[k];
        }
}

} // namespace ringlet
