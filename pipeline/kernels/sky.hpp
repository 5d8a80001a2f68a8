// The head and the sky on the density grid: body density, mean transmittance towards the sky, outward normal.
#pragma once

#include "density.hpp"
#include "distance_field.hpp"
#include "elementary.hpp"
#include "pose.hpp"
#include "sweep.hpp"

namespace ringlet {

/// Where a grid stands: shape, outer corner of its first voxel, side of a voxel.
struct GridFrame {
    int n[3];
    double origin[3], spacing;
};

/// Opacity of the head inside its surface, on voxels: 1.5 fibres a voxel [1/voxel], a ramp one voxel wide at its edge.
/// It is one voxel thinner than the head, so that hair on the skin does not lie in its shadow.
inline void body_density(const DistanceField &field, const Pose &pose, const GridFrame &grid, float *density, int threads) {
    const Rigid<float> to_rest(pose.inverse());
    const float h = float(grid.spacing);
    Floats lane;
    for (int i = 0; i < 16; ++i) lane[i] = float(i);
#pragma omp parallel for collapse(2) schedule(static) num_threads(threads)
    for (int x = 0; x < grid.n[0]; ++x)
        for (int y = 0; y < grid.n[1]; ++y) {
            float *row = density + (size_t(x) * grid.n[1] + y) * grid.n[2];
            for (int z = 0; z < grid.n[2]; z += 16) {
                const Vec3<float> middle{splat(float(grid.origin[0] + (x + 0.5) * grid.spacing)),
                                         splat(float(grid.origin[1] + (y + 0.5) * grid.spacing)),
                                         (lane + (z + 0.5f)) * h + float(grid.origin[2])};
                Floats phi;
                Vec3<float> gradient;
                sample(field, to_rest(middle), phi, gradient);
                const Floats solid = clamp(0.5f - (phi + h) / h, 0, 1) * (1.5f / h);
                for (int i = 0; i < 16 && z + i < grid.n[2]; ++i) row[z + i] = solid[i];
            }
        }
}

/// Mean of 2 x 2 x 2 voxels.
inline std::vector<float> halve(const float *values, const int n[3]) {
    const size_t row = n[2], slab = row * n[1];
    std::vector<float> halved;
    halved.reserve(slab * n[0] / 8);
    for (int x = 0; x + 1 < n[0]; x += 2)
        for (int y = 0; y + 1 < n[1]; y += 2)
            for (int z = 0; z + 1 < n[2]; z += 2) {
                const float *at = values + x * slab + y * row + z;
                float sum = 0;
                for (size_t corner : {size_t(0), row, slab, slab + row}) sum += at[corner] + at[corner + 1];
                halved.push_back(sum / 8);
            }
    return halved;
}

/// Hair and head at half the resolution, and the sky's directions.
struct Sky {
    std::vector<float> hair, body; // [1/m]
    int n[3];
    double spacing;                // [m]
    const float *loss;             // (3,)
    const float *directions;       // (D, 3)
    int count;                     // D
};

/// Adds e^(-k n - body), k for R, G and B, over all directions to records (nx, ny, nz, 8). The order of the sum is
/// that of the directions, for any number of threads.
inline void add_transmittance(const Sky &sky, float *records, int threads) {
    const ptrdiff_t voxels = ptrdiff_t(sky.hair.size());
    constexpr int batch = 4;
    std::vector<std::vector<float>> depths(2 * batch, std::vector<float>(voxels + 16));
    for (int first = 0; first < sky.count; first += batch) {
        const int last = std::min(first + batch, sky.count);
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
        for (int job = 2 * first; job < 2 * last; ++job)
            sweep((job % 2 ? sky.body : sky.hair).data(), depths[job - 2 * first].data(), sky.n, sky.spacing,
                  sky.directions + 3 * (job / 2));
#pragma omp parallel for schedule(static) num_threads(threads)
        for (ptrdiff_t i = 0; i < voxels; i += 16)
            for (int d = 0; d < last - first; ++d) {
                Floats hair, body;
                __builtin_memcpy(&hair, &depths[2 * d][i], sizeof hair);
                __builtin_memcpy(&body, &depths[2 * d + 1][i], sizeof body);
                for (int c = 0; c < 3; ++c) {
                    const Floats share = exponential(-sky.loss[c] * hair - body) * (1.0f / sky.count);
                    for (ptrdiff_t k = 0; k < 16 && i + k < voxels; ++k) records[8 * (i + k) + c] += share[k];
                }
            }
    }
}

/// Writes minus the gradient of the smoothed hair to entries 4, 5, 6 of the records.
inline void add_normals(Sky &sky, float *records, int threads) {
    // Twice 0.7 is one voxel here, two of the density grid
    for (int pass = 0; pass < 2; ++pass) blur(sky.hair.data(), sky.n, threads);
    const ptrdiff_t stride[3] = {ptrdiff_t(sky.n[1]) * sky.n[2], sky.n[2], 1};
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int x = 0; x < sky.n[0]; ++x)
        for (int y = 0; y < sky.n[1]; ++y)
            for (int z = 0; z < sky.n[2]; ++z) {
                const ptrdiff_t i = x * stride[0] + y * stride[1] + z;
                const int at[3] = {x, y, z};
                for (int axis = 0; axis < 3; ++axis) {
                    const ptrdiff_t below = at[axis] > 0 ? stride[axis] : 0;
                    const ptrdiff_t above = at[axis] + 1 < sky.n[axis] ? stride[axis] : 0;
                    records[8 * i + 4 + axis] = sky.hair[i - below] - sky.hair[i + above];
                }
            }
}

} // namespace ringlet
