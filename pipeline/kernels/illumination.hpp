// Lights and sky: what of the sky reaches each voxel of the density grid, and the lights' shadow maps.
#pragma once

#include "fibre.hpp"
#include "shadows.hpp"

#include <array>

namespace ringlet {

struct Illumination {
    int lights;
    const float *directions;             // (L, 3) unit vectors towards the lights
    const float *irradiance;             // (L, 3) R, G, B on a surface that faces the light
    const float *sky;                    // (3,) radiance
    const float *surroundings;           // (nx/2, ny/2, nz/2, 8): transmittance R, G, B to hair, 0, outward normal, 0
    const float *open;                   // (nx/2, ny/2, nz/2, 4): transmittance R, G, B, 0
    int n[3]; // voxels of the density grid
    const Shadows *shadows; // a map for each light
    std::array<double, 3> origin{0, 0, 0}; // outer corner of the first voxel [m]
    double spacing = 1;                    // [m]
    bool glints = true;

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

/// A point from the middle of the shadow maps on.
RINGLET_INLINE Vec3<float> from_centre(const Illumination &light, Vec3<float> x) {
    if (!light.lights) return x;
    const std::array<double, 3> &c = light.shadows->maps[0].centre;
    return {x.x - float(c[0]), x.y - float(c[1]), x.z - float(c[2])};
}

/// Entries of `surroundings` (Eight) or `open` (Four): on voxels twice as large.
template <class Record>
RINGLET_INLINE void read_sky(const Illumination &light, const float *table, Vec3<float> g, Floats *entries) {
    constexpr size_t size = sizeof(Record) / 4;
    const int n[3] = {light.n[0] / 2, light.n[1] / 2, light.n[2] / 2};
    const Place x(0.5f * g.x - 0.25f, n[0]), y(0.5f * g.y - 0.25f, n[1]), z(0.5f * g.z - 0.25f, n[2]);
    const size_t row = size * n[2], stride[3] = {row * n[1], row, size};
    read<Record>(table, x, y, z, stride, entries);
}

} // namespace ringlet
