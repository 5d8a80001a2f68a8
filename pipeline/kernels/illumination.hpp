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
    const float *surroundings;           // (nx/2, ny/2, nz/2, 16): as `surroundings` writes them
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

/// Where a point (in voxels) lies in tables on voxels twice as large.
struct SkyPlace {
    Place x, y, z;
    size_t across[2]; // voxels along y and z

    RINGLET_INLINE SkyPlace(const Illumination &light, const Vec3<float> &g)
        : x(0.5f * g.x - 0.25f, light.n[0] / 2), y(0.5f * g.y - 0.25f, light.n[1] / 2), z(0.5f * g.z - 0.25f, light.n[2] / 2),
          across{size_t(light.n[1] / 2), size_t(light.n[2] / 2)} {}

    /// The first entries of the records of a table, each of `size` floats.
    template <class Record> RINGLET_INLINE void read(const float *table, size_t size, Floats *entries) const {
        const size_t row = size * across[1], stride[3] = {row * across[0], row, size};
        ringlet::read<Record>(table, x, y, z, stride, entries);
    }
};

} // namespace ringlet
