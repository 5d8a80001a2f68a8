// The shadow maps of all lights, frame after frame, from strands that are added in any chunks.
#pragma once

#include "blockers.hpp"
#include "shadow_fill.hpp"

namespace ringlet {

/// Where hair is: its bounds, and how finely it is looked at.
struct Bounds {
    double lower[3], upper[3]; // [m]
    float spacing, width;      // [m] between nodes; a typical drawn width
    float share;               // part of all strands that casts shadows for all of them
    float told;                // part of them of which it is told past which others light goes
};

/// Lays a map of the light in this direction over the bounds: two unit vectors across it are Duff et al., Building an
/// Orthonormal Basis, Revisited, JCGT 2017.
inline void lay(ShadowMap &map, const float L[3], const Bounds &bounds) {
    const float sign = std::copysign(1.0f, L[2]), a = -1 / (sign + L[2]), b = L[0] * L[1] * a;
    const float axis[3][3] = {{1 + sign * L[0] * L[0] * a, sign * b, -sign * L[0]}, {b, sign + L[1] * L[1] * a, -L[1]}, {-L[0], -L[1], -L[2]}};
    __builtin_memcpy(map.axis, axis, sizeof axis);
    map.spacing = bounds.spacing;
    float size[3];
    for (int k = 0; k < 3; ++k) map.centre[k] = 0.5 * (bounds.lower[k] + bounds.upper[k]);
    for (int k = 0; k < 3; ++k) {
        size[k] = 0;
        for (int i = 0; i < 3; ++i) size[k] += float(std::abs(axis[k][i]) * (bounds.upper[i] - bounds.lower[i]));
    }
    for (int k = 0; k < 2; ++k) {
        map.n[k] = int(std::ceil(size[k] / map.spacing)) + 6;
        map.low[k] = -0.5f * map.spacing * (map.n[k] - 1);
    }
    map.low[2] = -0.5f * size[2] - map.spacing;
    map.unit = (size[2] + 2 * map.spacing) / (std::exp2((ShadowMap::kLayers - 1.0f) / ShadowMap::kOctave) - 1);
    // A strand in the middle of its own footprint, a box times a tent, covers c of what light passes there. As it never
    // lies before itself, it dims as 1 + 0.37 c strands at random would: the mean of e^-fc over its footprint, to c^2.
    const float c = 0.75f * bounds.width / map.spacing;
    map.opacity = 1 + 0.37f * std::min(c / bounds.share, 1.0f);
    map.own = 0.5f * c * map.opacity;
    map.width = bounds.width;
}

struct Shadows {
    std::vector<std::array<float, 3>> directions; // towards the lights
    std::vector<ShadowMap> maps;
    std::vector<Blockers> blockers; // for each map, beside it; of none where strands are many
    Casters casters;
    ShadowFill fill;
    float told = 0;
    bool finished; // as soon as nothing is missing, which without lights is at once

    explicit Shadows(std::vector<std::array<float, 3>> lights) : directions(std::move(lights)), finished(directions.empty()) {}
    Shadows(Shadows &&) = default;

    /// Forgets all strands; maps keep their memory.
    void begin(const Bounds &bounds) {
        maps.resize(directions.size()), blockers.resize(directions.size());
        told = bounds.told;
        for (size_t l = 0; l < maps.size(); ++l) lay(maps[l], directions[l].data(), bounds);
        casters.clear();
        finished = directions.empty();
    }

    /// Takes in strands (S, P).
    void add(const float *points, const float *widths, size_t S, int P) {
        if (!maps.empty()) casters.add(points, widths, S, P, maps[0].centre);
    }

    /// Makes the maps of all that was added and of the head.
    void finish(const HairVoxels &voxels, const DistanceField *field, const Pose &pose, int threads) {
        std::vector<std::vector<int8_t>> deep(maps.size());
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
        for (size_t l = 0; l < maps.size(); ++l) deep[l] = voxels.deep(directions[l].data());
        for (size_t l = 0; l < maps.size(); ++l) {
            fill(maps[l], casters, voxels.deep_in(deep[l]), threads);
            find_solid(maps[l], field, pose, threads);
        }
        // Lights side by side: nothing is shared between them
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
        for (size_t l = 0; l < maps.size(); ++l) {
            blockers[l].clear();
            if (told > 0 && casters.count) blockers[l].fill(maps[l], casters);
        }
        finished = true;
    }
};

} // namespace ringlet
