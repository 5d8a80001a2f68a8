// How a shadow map is made of strands and of the head.
//
// Segments are sorted into the squares of the map in which they count (shadow_square.hpp), and each square is filled by
// one thread. Sums are integers, so nothing depends on the order of strands.
#pragma once

#include "density.hpp"
#include "distance_field.hpp"
#include "pose.hpp"
#include "shadow_square.hpp"
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

    SweptVoxels density; // [1/m], half as fine as the density grid
    int n[3];
    float origin[3];     // [m] corner of the first voxel, from the maps' centre on
    float spacing;       // [m]

    /// Of a density grid (nx, ny, nz).
    HairVoxels(const float *fine, const int extents[3], float fine_spacing, int threads)
        : density(halve(fine, extents, threads).data(), std::array<int, 3>{extents[0] / 2, extents[1] / 2, extents[2] / 2}.data(), threads),
          n{density.n[0], density.n[1], density.n[2]}, origin{}, spacing(2 * fine_spacing) {}

    /// Whether something is deep, for each voxel.
    std::vector<uint8_t> deep(const float direction[3]) const {
        const Rows rows(n, dominant(direction) == 2);
        std::vector<float> before(rows.size());
        sweep<1>({&density}, spacing, direction,
                 [&](size_t at, const Floats (&tau)[1]) RINGLET_ALWAYS { __builtin_memcpy(before.data() + at, tau, sizeof tau); });
        std::vector<uint8_t> result(size_t(n[0]) * n[1] * n[2]);
        for (int x = 0; x < n[0]; ++x)
            rows.each(x, [&](size_t at, size_t voxel) RINGLET_ALWAYS { result[voxel] = before[at] > kDeep; });
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

class ShadowFill {
  public:
    ShadowFill(const Casters &casters, int threads) : casters_(casters), threads_(threads) {}

    void operator()(ShadowMap &map, const HairVoxels &voxels, const std::vector<uint8_t> &deep) {
        map_ = &map;
        sort_into_squares(voxels, deep);
        map.surface.resize(2 * map.nodes());
        map.layers.clear(map.nodes() * ShadowMap::kLayers);
#pragma omp parallel num_threads(threads_)
        {
            ShadowSquare filled(map);
#pragma omp for schedule(dynamic, 1)
            for (int square = 0; square < squares(); ++square)
                filled.fill(square / across(), square % across(), segments_.data(), sorted_.data() + begin_[square], begin_[square + 1] - begin_[square]);
        }
    }

  private:
    const Casters &casters_;
    const int threads_;
    ShadowMap *map_ = nullptr;
    std::vector<CastSegment> segments_; // of all strands, in their order; room for those of the next map
    std::vector<uint32_t> sorted_;      // segments, square after square
    std::vector<size_t> begin_;         // (squares + 1,) of each square's

    int across() const { return ShadowSquare::along(map_->n[1]); }
    int squares() const { return ShadowSquare::along(map_->n[0]) * across(); }

    /// The segments of a strand on the map.
    void place(size_t strand, const HairVoxels &voxels, const std::vector<uint8_t> &deep) {
        const int P = casters_.P;
        float before[3] = {};
        bool was_deep = false;
        for (int j = 0; j < P; ++j) {
            const float *x = casters_.points.data() + 3 * (strand * P + j);
            float here[3];
            for (int k = 0; k < 3; ++k) {
                const float *a = map_->axis[k];
                here[k] = a[0] * x[0] + a[1] * x[1] + a[2] * x[2] - map_->low[k];
                if (k < 2) here[k] *= 1 / map_->spacing;
            }
            const ptrdiff_t voxel = voxels.at(x);
            const bool is_deep = voxel >= 0 && deep[voxel];
            const float *widths = casters_.widths.data() + strand * P + j;
            if (j > 0) segments_[strand * (P - 1) + j - 1] = segment(before, here, 0.5f * (widths[-1] + widths[0]), is_deep && was_deep);
            std::copy(here, here + 3, before);
            was_deep = is_deep;
        }
    }

    /// A segment between two points on the map; where it is deep, of one step.
    CastSegment segment(const float *from, const float *to, float width, bool deep) const {
        const float du = to[0] - from[0], dv = to[1] - from[1], dw = to[2] - from[2], length = std::sqrt(du * du + dv * dv);
        // Not-a-number and strands that broke cast no shadow
        if (!(length > 0 && length < 1e4f)) return {};
        const int steps = deep ? 1 : int(length) + 1;
        const float part = 1.0f / steps, share = length * width / map_->spacing * map_->opacity * part;
        return {from[0] + 0.5f * part * du, from[1] + 0.5f * part * dv, from[2] + 0.5f * part * dw, part * du, part * dv, part * dw,
                uint32_t(share * ShadowSquare::kCount + 0.5f), steps};
    }

    /// Calls visit(square) for squares that a segment's steps may count in.
    template <class Visit> RINGLET_INLINE void each_square(const CastSegment &s, Visit &&visit) const {
        int first[2], last[2];
        if (s.steps == 0 || !ShadowSquare::reached(s.u, (s.steps - 1) * s.du, map_->n[0], first[0], last[0]) ||
            !ShadowSquare::reached(s.v, (s.steps - 1) * s.dv, map_->n[1], first[1], last[1]))
            return;
        for (int a = first[0]; a <= last[0]; ++a)
            for (int b = first[1]; b <= last[1]; ++b) visit(a * across() + b);
    }

    /// Segments on the map, and a counting sort of them, with counters for each thread.
    void sort_into_squares(const HairVoxels &voxels, const std::vector<uint8_t> &deep) {
        const size_t strands = casters_.count(), each = size_t(std::max(casters_.P - 1, 0));
        segments_.resize(strands * each);
        std::vector<std::vector<size_t>> next(threads_, std::vector<size_t>(squares()));
        const auto share = [&](int thread) { return strands * thread / threads_; };
#pragma omp parallel for schedule(static, 1) num_threads(threads_)
        for (int thread = 0; thread < threads_; ++thread)
            for (size_t s = share(thread); s < share(thread + 1); ++s) {
                place(s, voxels, deep);
                for (size_t i = s * each; i < (s + 1) * each; ++i)
                    each_square(segments_[i], [&](int square) RINGLET_ALWAYS { ++next[thread][square]; });
            }
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
            for (size_t i = share(thread) * each; i < share(thread + 1) * each; ++i)
                each_square(segments_[i], [&](int square) RINGLET_ALWAYS { sorted_[next[thread][square]++] = uint32_t(i); });
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
