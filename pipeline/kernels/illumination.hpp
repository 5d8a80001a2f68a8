// Lights and sky, and what of them reaches each voxel of the density grid.
#pragma once

#include "fibre.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace ringlet {

/// Values at the middles of voxels.
struct Voxels {
    const float *values;
    int n[3];
};

struct Illumination {
    int lights;
    const float *directions;             // (L, 3) unit vectors towards the lights
    const float *irradiance;             // (L, 3) R, G, B on a surface that faces the light
    const float *sky;                    // (3,) radiance
    const float *towards, *away, *body;  // (L, nx, ny, nz): fibres towards and away from the light, body towards it
    const float *surroundings;           // (nx/2, ny/2, nz/2, 8): transmittance R, G, B, 0, outward normal, 0
    int n[3];
    std::array<double, 3> origin{0, 0, 0}; // outer corner of the first voxel [m]
    double spacing = 1;                    // [m]
    bool glints = true;

    Voxels depth(const float *values, int light) const {
        return {values + size_t(light) * n[0] * n[1] * n[2], {n[0], n[1], n[2]}};
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

/// Trilinear, clamped to the grid.
RINGLET_INLINE Floats trilinear(const Voxels &grid, Vec3<float> g) {
    const Place x(g.x, grid.n[0]), y(g.y, grid.n[1]), z(g.z, grid.n[2]);
    const int row = grid.n[2], slab = row * grid.n[1];
    const Ints at = x.at * slab + y.at * row + z.at;
    float corners[8][16];
    int index[16];
    __builtin_memcpy(index, &at, sizeof index);
    const int offset[8] = {0, 1, row, row + 1, slab, slab + 1, slab + row, slab + row + 1};
    for (int corner = 0; corner < 8; ++corner) {
        const float *values = grid.values + offset[corner];
#pragma omp simd
        for (int i = 0; i < 16; ++i) corners[corner][i] = values[index[i]];
    }
    Floats c[8];
    __builtin_memcpy(c, corners, sizeof c);
    for (int i = 0; i < 4; ++i) c[i] = c[2 * i] + z.part * (c[2 * i + 1] - c[2 * i]);
    for (int i = 0; i < 2; ++i) c[i] = c[2 * i] + y.part * (c[2 * i + 1] - c[2 * i]);
    return c[0] + x.part * (c[1] - c[0]);
}

/// Entries of `surroundings`: on voxels twice as large.
RINGLET_INLINE void read_surroundings(const Illumination &light, Vec3<float> g, Floats entries[8]) {
    const int n[3] = {light.n[0] / 2, light.n[1] / 2, light.n[2] / 2};
    const Place x(0.5f * g.x - 0.25f, n[0]), y(0.5f * g.y - 0.25f, n[1]), z(0.5f * g.z - 0.25f, n[2]);
    const size_t row = n[2], slab = row * n[1];
    Eight records[16];
    for (int i = 0; i < 16; ++i) {
        const size_t at = x.at[i] * slab + y.at[i] * row + z.at[i];
        const auto edge = [&](size_t from) {
            return mean(record(light.surroundings, from), record(light.surroundings, from + 1), z.part[i]);
        };
        const auto side = [&](size_t from) { return mean(edge(from), edge(from + row), y.part[i]); };
        records[i] = mean(side(at), side(at + slab), x.part[i]);
    }
    transpose(records, entries);
}

} // namespace ringlet
