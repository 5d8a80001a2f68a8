// The shadow maps of all lights, from strands that are added in any chunks.
#pragma once

#include "shadow_fill.hpp"

namespace ringlet {

/// Where hair is: its bounds, and how finely it is looked at.
struct Bounds {
    double lower[3], upper[3]; // [m]
    float spacing, width;      // [m] between nodes; a typical drawn width
    float share;               // part of all strands that casts shadows for all of them
};

/// An empty map of the light in this direction: two unit vectors across it (Duff et al., Building an Orthonormal Basis,
/// Revisited, JCGT 2017), and room for the bounds.
inline ShadowMap empty_map(const float L[3], const Bounds &bounds) {
    ShadowMap map{};
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
    return map;
}

struct Shadows {
    std::vector<ShadowMap> maps;
    Casters casters;

    Shadows() = default;
    Shadows(Shadows &&) = default;

    /// Takes in strands (S, P).
    void add(const float *points, const float *widths, size_t S, int P) {
        if (maps.empty()) return;
        casters.P = P;
        const size_t first = casters.points.size();
        casters.points.resize(first + 3 * S * P);
        for (size_t k = 0; k < 3 * S * P; ++k) casters.points[first + k] = float(points[k] - maps[0].centre[k % 3]);
        casters.widths.insert(casters.widths.end(), widths, widths + S * P);
    }

    /// Makes the maps of all that was added and of the head.
    void finish(const HairVoxels &voxels, const DistanceField *field, const Pose &pose, int threads) {
        std::vector<std::vector<uint8_t>> deep(maps.size());
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
        for (size_t l = 0; l < maps.size(); ++l) {
            const auto &away = maps[l].axis[2];
            const float to_light[3] = {-away[0], -away[1], -away[2]};
            deep[l] = voxels.deep(to_light);
        }
        ShadowFill fill(casters, threads);
        for (size_t l = 0; l < maps.size(); ++l) {
            fill(maps[l], voxels, deep[l]);
            find_solid(maps[l], field, pose, threads);
        }
        casters = {};
    }
};

} // namespace ringlet
