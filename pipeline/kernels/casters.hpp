// Strands that cast shadows, and their segments as a light sees them, 16 side by side.
#pragma once

#include "shadow_square.hpp"

#include <array>
#include <cmath>

namespace ringlet {

/// Strands that cast shadows, kept until all are there.
struct Casters {
    std::vector<float> x[3], widths; // (S, P) [m], points from the maps' centre on; behind them room for a whole vector
    std::vector<uint32_t> names;     // (S,) a hash of where each begins
    size_t count = 0;                // S
    int P = 0;

    void clear() { count = 0, P = 0, names.clear(); }

    /// Tells strands from one another, whoever holds them: by their first point. 0 and -0 are the same place.
    static uint32_t name(const float *root) {
        uint32_t hash = 0;
        for (int k = 0; k < 3; ++k) {
            const float x = root[k] + 0.0f;
            uint32_t bits;
            __builtin_memcpy(&bits, &x, sizeof bits);
            hash = mix(hash + bits);
        }
        return hash;
    }

    void add(const float *points, const float *wide, size_t S, int each, const std::array<double, 3> &centre) {
        const size_t first = count * each, more = S * each;
        P = each, count += S;
        for (std::vector<float> &values : x) values.resize(first + more + 16);
        widths.resize(first + more + 16);
        std::copy(wide, wide + more, widths.begin() + ptrdiff_t(first));
        for (int k = 0; k < 3; ++k)
            for (size_t i = 0; i < more; ++i) x[k][first + i] = float(points[3 * i + k] - centre[k]);
        for (size_t s = 0; s < S; ++s) names.push_back(name(points + 3 * s * each));
    }
};

/// Which voxels are deep in the hair, as one light sees it.
struct DeepHair {
    const std::vector<int8_t> &flags; // (nx, ny, nz) and three more
    int n[3];
    float origin[3], spacing;         // [m] corner of the first voxel, from the maps' centre on; side of a voxel

    /// Whether points are in deep voxels.
    RINGLET_INLINE Ints at(const Floats x[3]) const {
        Ints index{}, inside = x[0] == x[0];
        for (int k = 0; k < 3; ++k) {
            const Floats v = (x[k] - origin[k]) * (1 / spacing);
            inside &= (v >= 0.0f) & (v < float(n[k]));
            index = index * n[k] + whole(inside ? v : splat(0.0f));
        }
        return inside & (gather_bytes(flags.data(), inside ? index : Ints{}) != 0);
    }
};

/// 16 segments of a strand on a map, and the squares that they may count in.
class PlacedSegments {
  public:
    int count; // of the 16

    /// From point `first` of the strand on.
    PlacedSegments(const ShadowMap &map, const Casters &casters, const DeepHair &deep, size_t strand, int first)
        : count(std::min(16, casters.P - 1 - first)) {
        const size_t at = strand * casters.P + first;
        Floats from[3], way[3];
        const Ints both = place(map, casters, deep, at, from) & place(map, casters, deep, at + 1, way);
        for (int k = 0; k < 3; ++k) way[k] -= from[k];
        const Floats length = square_root<float>(way[0] * way[0] + way[1] * way[1]);
        Floats lane;
        for (int k = 0; k < 16; ++k) lane[k] = float(k);
        // Not-a-number and strands that broke cast no shadow
        const Ints sound = (length > 0.0f) & (length < 1e4f) & (lane < float(count));
        const Ints steps = sound ? (both ? Ints{} + 1 : whole(sound ? length : splat(0.0f)) + 1) : Ints{};
        const Floats part = 1.0f / maximum<float>(real(steps), splat(1.0f)), wide = 0.5f * (read(casters.widths, at) + read(casters.widths, at + 1));
        const Floats share = length * wide * (1 / map.spacing) * map.opacity * part;
        for (int k = 0; k < 3; ++k) {
            way[k] *= part, from[k] += 0.5f * way[k];
            __builtin_memcpy(fields_[k], from + k, sizeof from[k]), __builtin_memcpy(fields_[3 + k], way + k, sizeof way[k]);
        }
        const Ints counts = whole(sound ? minimum<float>(share * ShadowSquare::kCount + 0.5f, splat(2e9f)) : splat(0.0f));
        __builtin_memcpy(fields_[6], &counts, sizeof counts), __builtin_memcpy(fields_[7], &steps, sizeof steps);
        const Floats after = real(steps - 1);
        Ints range[2][2], some = sound;
        for (int k = 0; k < 2; ++k) some &= ShadowSquare::reached(from[k], after * way[k], map.n[k], range[k]);
        const Ints packed = range[0][0] | range[0][1] << 8 | range[1][0] << 16 | range[1][1] << 24;
        squares_ = some ? packed : Ints{} + 1; // none from 1 to 0
    }

    void write(CastSegment *segments, uint32_t *squares) const {
        for (int k = 0; k < count; ++k) __builtin_memcpy(squares + k, (const char *)&squares_ + 4 * k, sizeof *squares);
        for (int k = 0; k < count; ++k) {
            uint32_t own[8];
            for (int field = 0; field < 8; ++field) own[field] = fields_[field][k];
            static_assert(sizeof(CastSegment) == sizeof own);
            __builtin_memcpy((void *)(segments + k), own, sizeof own);
        }
    }

  private:
    uint32_t fields_[8][16]; // of CastSegment, in its order
    Ints squares_;           // first and last along u, first and last along v: a byte each

    static RINGLET_INLINE Floats read(const std::vector<float> &values, size_t at) {
        Floats lanes;
        __builtin_memcpy(&lanes, values.data() + at, sizeof lanes);
        return lanes;
    }

    /// 16 points on the map: nodes, nodes, [m]; whether each is deep.
    static RINGLET_INLINE Ints place(const ShadowMap &map, const Casters &casters, const DeepHair &deep, size_t at, Floats to[3]) {
        const Floats x[3] = {read(casters.x[0], at), read(casters.x[1], at), read(casters.x[2], at)};
        for (int k = 0; k < 3; ++k) {
            const float *a = map.axis[k];
            to[k] = a[0] * x[0] + a[1] * x[1] + a[2] * x[2] - map.low[k];
            if (k < 2) to[k] *= 1 / map.spacing;
        }
        return deep.at(x);
    }
};

} // namespace ringlet
