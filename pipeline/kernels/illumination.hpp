// Lights and sky, and what of them reaches each voxel of the density grid.
#pragma once

#include "fibre.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace ringlet {

/// What lies between a voxel and a light, in the order of `Illumination::depths`.
enum Depth { towards, away, body };

struct Illumination {
    int lights;
    const float *directions;             // (L, 3) unit vectors towards the lights
    const float *irradiance;             // (L, 3) R, G, B on a surface that faces the light
    const float *sky;                    // (3,) radiance
    const float *surroundings;           // (nx/2, ny/2, nz/2, 8): transmittance R, G, B, 0, outward normal, 0
    int n[3];
    std::vector<float> depths; // (nx, ny, nz, L, 4): fibres towards and away from the light, body towards it, 0
    std::array<double, 3> origin{0, 0, 0}; // outer corner of the first voxel [m]
    double spacing = 1;                    // [m]
    bool glints = true;

    /// All that a point needs lies side by side: memory, not arithmetic, is what shading waits for.
    void interleave(Depth kind, const float *separate, int threads) {
        const size_t voxels = size_t(n[0]) * n[1] * n[2];
        depths.resize(4 * voxels * lights);
#pragma omp parallel for schedule(static) num_threads(threads)
        for (size_t i = 0; i < voxels; ++i)
            for (int l = 0; l < lights; ++l) depths[4 * (i * lights + l) + kind] = separate[l * voxels + i];
    }
    Vec3<float> direction(int light) const {
        const float *L = directions + 3 * light;
        return {splat(L[0]), splat(L[1]), splat(L[2])};
    }
};

/// World position in voxels from the first voxel's middle.
RINGLET_INLINE Vec3<float> in_voxels(const Illumination &light, Vec3<float> x) {
    const float inverse = float(1 / light.spacing);
    return {(x.x - float(light.origin[0])) * inverse - 0.5f, (x.y - float(light.origin[1])) * inverse - 0.5f,
            (x.z - float(light.origin[2])) * inverse - 0.5f};
}

/// What lies between 16 points, in voxels, and a light: trilinear, clamped to the grid.
RINGLET_INLINE void read_depths(const Illumination &light, int l, Vec3<float> g, Floats entries[4]) {
    const Place x(g.x, light.n[0]), y(g.y, light.n[1]), z(g.z, light.n[2]);
    const size_t one = 4 * size_t(light.lights), row = one * light.n[2], stride[3] = {row * light.n[1], row, one};
    read<Four>(light.depths.data() + 4 * l, x, y, z, stride, entries);
}

/// Entries of `surroundings`: on voxels twice as large.
RINGLET_INLINE void read_surroundings(const Illumination &light, Vec3<float> g, Floats entries[8]) {
    const int n[3] = {light.n[0] / 2, light.n[1] / 2, light.n[2] / 2};
    const Place x(0.5f * g.x - 0.25f, n[0]), y(0.5f * g.y - 0.25f, n[1]), z(0.5f * g.z - 0.25f, n[2]);
    const size_t row = 8 * size_t(n[2]), stride[3] = {row * n[1], row, 8};
    read<Eight>(light.surroundings, x, y, z, stride, entries);
}

} // namespace ringlet
