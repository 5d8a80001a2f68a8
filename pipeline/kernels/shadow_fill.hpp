// How a shadow map is made of strands and of the head.
//
// Segments are sorted into the squares of the map in which they count (shadow_square.hpp), and each square is filled by
// one thread. Sums are integers, so nothing depends on the order of strands.
#pragma once

#include "casters.hpp"
#include "density.hpp"
#include "distance_field.hpp"
#include "pose.hpp"
#include "sweep.hpp"

#include <algorithm>
#include <cmath>

namespace ringlet {

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

    /// Whether something is deep, for each voxel, and three zeros.
    std::vector<int8_t> deep(const float direction[3]) const {
        const Rows rows(n, dominant(direction) == 2);
        std::vector<float> before(rows.size());
        sweep<1>({&density}, spacing, direction,
                 [&](size_t at, const Floats (&tau)[1]) RINGLET_ALWAYS { __builtin_memcpy(before.data() + at, tau, sizeof tau); });
        std::vector<int8_t> result(size_t(n[0]) * n[1] * n[2] + 3);
        for (int x = 0; x < n[0]; ++x)
            rows.each(x, [&](size_t at, size_t voxel) RINGLET_ALWAYS { result[voxel] = before[at] > kDeep; });
        return result;
    }

    DeepHair deep_in(const std::vector<int8_t> &flags) const {
        return {flags, {n[0], n[1], n[2]}, {origin[0], origin[1], origin[2]}, spacing};
    }
};

/// Fills maps, one after another; keeps room for the segments of the next.
class ShadowFill {
  public:
    void operator()(ShadowMap &map, const Casters &casters, const DeepHair &deep, int threads) {
        sort_into_squares(map, casters, deep, threads);
        map.surface.resize(2 * map.nodes());
        map.layers.resize(map.nodes() * ShadowMap::kLayers);
        const int across = ShadowSquare::along(map.n[1]), squares = int(begin_.size()) - 1;
#pragma omp parallel num_threads(threads)
        {
            ShadowSquare filled(map);
#pragma omp for schedule(dynamic, 1)
            for (int square = 0; square < squares; ++square)
                filled.fill(square / across, square % across, segments_.data(), sorted_.data() + begin_[square], begin_[square + 1] - begin_[square]);
        }
    }

  private:
    std::vector<CastSegment> segments_; // of all strands, in their order
    std::vector<uint32_t> reached_;     // squares that each may count in
    std::vector<uint32_t> sorted_;      // segments, square after square
    std::vector<size_t> begin_;         // (squares + 1,) of each square's

    /// Calls visit(square) for squares that a segment's steps may count in.
    template <class Visit> static RINGLET_INLINE void each_square(uint32_t reached, int across, Visit &&visit) {
        const int first = reached & 255, last = reached >> 8 & 255, left = reached >> 16 & 255, right = reached >> 24;
        for (int a = first; a <= last; ++a)
            for (int b = left; b <= right; ++b) visit(a * across + b);
    }

    /// Segments on the map, and a counting sort of them, with counters for each thread.
    void sort_into_squares(const ShadowMap &map, const Casters &casters, const DeepHair &deep, int threads) {
        const int across = ShadowSquare::along(map.n[1]), squares = ShadowSquare::along(map.n[0]) * across;
        const size_t each = size_t(std::max(casters.P - 1, 0));
        segments_.resize(casters.count * each), reached_.resize(casters.count * each);
        std::vector<std::vector<size_t>> next(threads, std::vector<size_t>(squares));
        const auto share = [&](int thread) { return casters.count * thread / threads; };
#pragma omp parallel for schedule(static, 1) num_threads(threads)
        for (int thread = 0; thread < threads; ++thread)
            for (size_t s = share(thread); s < share(thread + 1); ++s)
                for (size_t first = 0; first < each; first += 16) {
                    const size_t i = s * each + first;
                    const PlacedSegments placed(map, casters, deep, s, int(first));
                    placed.write(segments_.data() + i, reached_.data() + i);
                    for (int k = 0; k < placed.count; ++k)
                        each_square(reached_[i + k], across, [&](int square) RINGLET_ALWAYS { ++next[thread][square]; });
                }
        begin_.assign(1, 0);
        size_t total = 0;
        for (int square = 0; square < squares; ++square) {
            for (auto &mine : next) {
                const size_t count = mine[square];
                mine[square] = total, total += count;
            }
            begin_.push_back(total);
        }
        sorted_.resize(total);
#pragma omp parallel for schedule(static, 1) num_threads(threads)
        for (int thread = 0; thread < threads; ++thread)
            for (size_t i = share(thread) * each; i < share(thread + 1) * each; ++i)
                each_square(reached_[i], across, [&](int square) RINGLET_ALWAYS { sorted_[next[thread][square]++] = uint32_t(i); });
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
    // Nodes four by four: their rays take the same ways
    Ints down, along;
    for (int k = 0; k < 16; ++k) down[k] = k / 4, along[k] = k % 4;
    const auto world = [&](int k, Floats u, Floats v, Floats w) RINGLET_ALWAYS {
        return map.axis[0][k] * u + map.axis[1][k] * v + map.axis[2][k] * w + float(map.centre[k]);
    };
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
    for (int top = 0; top < map.n[0]; top += 4)
        for (int left = 0; left < map.n[1]; left += 4) {
            const Floats u = real(down + top) * map.spacing + map.low[0], v = real(along + left) * map.spacing + map.low[1];
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
            for (int k = 0; k < 16; ++k) {
                const int i = top + k / 4, j = left + k % 4;
                if (i < map.n[0] && j < map.n[1]) map.solid[size_t(i) * map.n[1] + j] = hit[k];
            }
        }
}

} // namespace ringlet
