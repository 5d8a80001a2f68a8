// Drawn hair in voxels, as integers: sums depend neither on threads nor on the order of strands.
//
// A sub-segment no longer than a voxel adds length * width trilinearly to 8 voxels.
#pragma once

#include "simd.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ringlet {

typedef float Eight __attribute__((vector_size(32)));

struct DensityGrid {
    std::array<int, 3> shape;
    std::array<double, 3> origin; // outer corner of the first voxel [m]
    double spacing;               // [m]
    double quantum;               // what one count stands for [m^2]
    std::vector<std::vector<uint32_t>> counts; // (nx, ny, nz) for each thread

    size_t voxels() const { return size_t(shape[0]) * shape[1] * shape[2]; }
};

/// Adds `area` to the 8 voxels around g, given in voxels from the first voxel's middle.
RINGLET_INLINE void add_around(const DensityGrid &grid, uint32_t *counts, const float g[3], float area) {
    // Truncation is floor here: g >= 0 is checked on the float, so that huge values cannot wrap
    if (!(g[0] >= 0 && g[1] >= 0 && g[2] >= 0 && g[0] < grid.shape[0] - 1 && g[1] < grid.shape[1] - 1 &&
          g[2] < grid.shape[2] - 1))
        return;
    const int x = int(g[0]), y = int(g[1]), z = int(g[2]);
    const float u = g[0] - x, v = g[1] - y, w = g[2] - z;
    const float low = area * (1 - w), high = area * w;
    const size_t row = grid.shape[2], slab = row * grid.shape[1];
    uint32_t *at = counts + x * slab + y * row + z;
    const float weight[4] = {(1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v};
    const size_t offset[4] = {0, row, slab, slab + row};
    for (int corner = 0; corner < 4; ++corner) {
        at[offset[corner]] += uint32_t(low * weight[corner] + 0.5f);
        at[offset[corner] + 1] += uint32_t(high * weight[corner] + 0.5f);
    }
}

/// One strand of P points and widths.
inline void add_strand(const DensityGrid &grid, uint32_t *counts, const float *points, const float *widths, int P) {
    const float inverse = float(1 / grid.spacing);
    for (int j = 0; j + 1 < P; ++j) {
        const float *a = points + 3 * j, *b = a + 3;
        float e[3], g[3], length = 0;
        for (int i = 0; i < 3; ++i) {
            e[i] = b[i] - a[i];
            length += e[i] * e[i];
            g[i] = float((a[i] - grid.origin[i]) * inverse) - 0.5f;
        }
        length = std::sqrt(length);
        if (!(length > 0 && length < 1e3f)) continue; // a strand that broke casts no shadow
        const int steps = std::min(int(length * inverse) + 1, 4096);
        const float area = length / steps * 0.5f * (widths[j] + widths[j + 1]) / float(grid.quantum);
        for (int s = 0; s < steps; ++s) {
            const float f = (s + 0.5f) / steps * inverse;
            const float at[3] = {g[0] + f * e[0], g[1] + f * e[1], g[2] + f * e[2]};
            add_around(grid, counts, at, area);
        }
    }
}

/// The three taps of a Gaussian blur of 0.7 voxels, along rows that are `stride` apart; nothing outside.
inline void blur_row(float *values, int count, size_t stride, int width, std::vector<float> &before) {
    const float tap = std::exp(-0.5f / 0.49f), side = tap / (1 + 2 * tap), middle = 1 / (1 + 2 * tap);
    before.assign(width, 0.0f);
    for (int i = 0; i < count; ++i) {
        float *row = values + i * stride, *next = row + stride;
        for (int k = 0; k < width; ++k) {
            const float old = row[k], after = i + 1 < count ? next[k] : 0.0f;
            row[k] = side * (before[k] + after) + middle * old;
            before[k] = old;
        }
    }
}

/// Blurs (nx, ny, nz) in place along the axes.
inline void blur(float *values, const int n[3], int threads) {
    const size_t row = n[2], slab = row * n[1];
#pragma omp parallel num_threads(threads)
    {
        std::vector<float> before;
#pragma omp for schedule(static)
        for (int x = 0; x < n[0]; ++x) {
            float *at = values + x * slab;
            for (int y = 0; y < n[1]; ++y) blur_row(at + y * row, n[2], 1, 1, before);
            blur_row(at, n[1], row, n[2], before);
        }
#pragma omp for schedule(static)
        for (int y = 0; y < n[1]; ++y) blur_row(values + y * row, n[0], slab, n[2], before);
    }
}

/// The density [1/m] into (nx, ny, nz), not yet blurred.
inline void read_density(const DensityGrid &grid, float *density, int threads) {
    const size_t voxels = grid.voxels();
    const float unit = float(grid.quantum / (grid.spacing * grid.spacing * grid.spacing));
#pragma omp parallel for schedule(static) num_threads(threads)
    for (size_t i = 0; i < voxels; ++i) {
        uint32_t sum = 0;
        for (const auto &counts : grid.counts)
            if (!counts.empty()) sum += counts[i];
        density[i] = float(sum) * unit;
    }
}

} // namespace ringlet
