// The head and the sky on the density grid: body density, mean transmittance towards the sky, outward normal.
#pragma once

#include "density.hpp"
#include "distance_field.hpp"
#include "elementary.hpp"
#include "pose.hpp"
#include "sweep.hpp"

#include <optional>

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

/// Hair and head at half the resolution, and the sky's directions.
struct Sky {
    std::vector<float> hair, body; // [1/m]; no body: nothing
    int n[3];
    double spacing;                // [m]
    const float *loss;             // (3,)
    const float *directions;       // (D, 3)
    const float *weights;          // (D, 3) R, G, B: what hair answers to light from there; of mean 1 in each channel
    int count;                     // D
};

/// Sums of the light of all directions in R, G and B, weighted and as it is, in both kinds of rows; integers, so that no
/// order of directions changes them.
struct SkySums {
    static constexpr float kWhole = 1 << 30; // of all directions
    static constexpr int kSums = 6;

    std::vector<uint32_t> rows[2][kSums];

    explicit SkySums(const int n[3]) {
        for (int across_z = 0; across_z < 2; ++across_z)
            for (auto &channel : rows[across_z]) channel.resize(Rows(n, across_z).size());
    }

    /// Adds e^(-k n - body), k for R, G and B, of direction d.
    template <int count> void add(const SweptVoxels *const (&voxels)[count], const Sky &sky, int d) {
        const float *direction = sky.directions + 3 * d, share = kWhole / sky.count;
        auto &to = rows[dominant(direction) == 2];
        sweep(voxels, sky.spacing, direction, [&](size_t at, const Floats (&tau)[count]) RINGLET_ALWAYS {
            for (int c = 0; c < 3; ++c) {
                const Floats depth = count == 2 ? sky.loss[c] * tau[0] + tau[count - 1] : sky.loss[c] * tau[0];
                const Floats light = exponential(-depth) * share;
                for (int k : {c, 3 + c}) {
                    Ints sums;
                    __builtin_memcpy(&sums, to[k].data() + at, sizeof sums);
                    sums += whole(light * (k < 3 ? sky.weights[3 * d + c] : 1.0f) + 0.5f);
                    __builtin_memcpy(to[k].data() + at, &sums, sizeof sums);
                }
            }
        });
    }

    void add(const SkySums &others) {
        for (int across_z = 0; across_z < 2; ++across_z)
            for (int k = 0; k < kSums; ++k)
                for (size_t i = 0; i < rows[across_z][k].size(); ++i) rows[across_z][k][i] += others.rows[across_z][k][i];
    }
};

/// Writes the mean of e^(-k n - body) over all directions, weighted, to entries 0, 1, 2 of records (nx, ny, nz, 8), and as it
/// is to those of `open` (nx, ny, nz, 4).
inline void write_transmittance(const Sky &sky, float *records, float *open, int threads) {
    const SweptVoxels hair(sky.hair.data(), sky.n, threads);
    const std::optional<SweptVoxels> body = sky.body.empty() ? std::nullopt : std::optional<SweptVoxels>({sky.body.data(), sky.n, threads});
    SkySums all(sky.n);
#pragma omp parallel num_threads(threads)
    {
        SkySums own(sky.n);
#pragma omp for schedule(dynamic, 1) nowait
        for (int d = 0; d < sky.count; ++d) {
            if (body) own.add<2>({&hair, &*body}, sky, d);
            else own.add<1>({&hair}, sky, d);
        }
#pragma omp critical
        all.add(own);
    }
    const Rows straight(sky.n, false), across(sky.n, true);
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int x = 0; x < sky.n[0]; ++x)
        for (int k = 0; k < SkySums::kSums; ++k) {
            const uint32_t *first = all.rows[0][k].data(), *other = all.rows[1][k].data();
            float *to = k < 3 ? records + k : open + k - 3;
            const size_t step = k < 3 ? 8 : 4;
            straight.each(x, [&](size_t at, size_t voxel) RINGLET_ALWAYS { to[step * voxel] = float(first[at]) * (1 / SkySums::kWhole); });
            across.each(x, [&](size_t at, size_t voxel) RINGLET_ALWAYS { to[step * voxel] += float(other[at]) * (1 / SkySums::kWhole); });
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
