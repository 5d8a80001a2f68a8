// Drawn hair in voxels, as integers: sums depend neither on threads nor on the order of strands.
//
// A sub-segment no longer than a voxel adds length * width trilinearly to 8 voxels.
#pragma once

#include "elementary.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
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

/// 16 segments side by side, each in so many steps.
struct GridSegments {
    Floats from[3], way[3]; // in voxels from the first voxel's middle
    Floats steps, area;     // area that each step adds, in counts

    /// Of a strand of P points and widths, from segment `first` on.
    GridSegments(const DensityGrid &grid, const float *points, const float *widths, int first, int P) {
        const float inverse = float(1 / grid.spacing);
        Floats wide;
        for (int k = 0; k < 16; ++k) {
            const int j = std::min(first + k, P - 2);
            for (int i = 0; i < 3; ++i) from[i][k] = points[3 * j + i], way[i][k] = points[3 * j + 3 + i];
            wide[k] = first + k == j ? widths[j] + widths[j + 1] : 0.0f;
        }
        Floats length = splat(0.0f);
        for (int i = 0; i < 3; ++i) {
            way[i] -= from[i];
            length += way[i] * way[i];
            from[i] = (from[i] - float(grid.origin[i])) * inverse - 0.5f;
            way[i] *= inverse;
        }
        length = square_root<float>(length);
        // A strand that broke casts no shadow
        const Ints sound = (length > 0.0f) & (length < 1e3f) & (wide > 0.0f);
        steps = sound ? minimum<float>(real(whole(length * inverse)) + 1.0f, splat(4096.0f)) : splat(0.0f);
        area = sound ? length / steps * 0.5f * wide / float(grid.quantum) : splat(0.0f);
    }

    /// Adds step s of all segments that have one to the 8 voxels around it.
    RINGLET_INLINE void add(const DensityGrid &grid, uint32_t *counts, float s) const {
        const Floats f = (s + 0.5f) / steps;
        const int row = grid.shape[2], slab = row * grid.shape[1];
        Ints inside = s < steps, at = Ints{};
        Floats part[3];
        for (int i = 0; i < 3; ++i) {
            const Floats g = from[i] + f * way[i];
            inside &= (g >= 0.0f) & (g < float(grid.shape[i] - 1));
            // Huge values do not wrap: outside, it is the first voxel
            const Ints voxel = whole(inside ? g : splat(0.0f));
            part[i] = (inside ? g : splat(0.0f)) - real(voxel);
            at = at * grid.shape[i] + voxel;
        }
        alignas(64) int32_t places[16], values[8][16];
        const Ints first = inside ? at : Ints{};
        std::memcpy(places, &first, sizeof places);
        for (int corner = 0; corner < 8; ++corner) {
            Floats weight = area;
            for (int i = 2; i >= 0; --i) weight *= corner >> (2 - i) & 1 ? part[i] : 1.0f - part[i];
            const Ints value = inside ? whole(weight + 0.5f) : Ints{};
            std::memcpy(values[corner], &value, sizeof value);
        }
        const int offset[8] = {0, 1, row, row + 1, slab, slab + 1, slab + row, slab + row + 1};
        for (uint32_t lanes = set_lanes<float>(inside); lanes; lanes &= lanes - 1) {
            const int k = __builtin_ctz(lanes);
            for (int corner = 0; corner < 8; ++corner) counts[places[k] + offset[corner]] += uint32_t(values[corner][k]);
        }
    }
};

/// One strand of P points and widths.
inline void add_strand(const DensityGrid &grid, uint32_t *counts, const float *points, const float *widths, int P) {
    for (int first = 0; first + 1 < P; first += 16) {
        const GridSegments segments(grid, points, widths, first, P);
        const float most = largest<float>(segments.steps);
        for (float s = 0; s < most; ++s) segments.add(grid, counts, s);
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

/// Mean of 2 x 2 x 2 voxels, of (nx, ny, nz).
inline std::vector<float> halve(const float *values, const int n[3], int threads) {
    const size_t row = n[2], slab = row * n[1];
    const int half[3] = {n[0] / 2, n[1] / 2, n[2] / 2};
    std::vector<float> halved(size_t(half[0]) * half[1] * half[2]);
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int x = 0; x < half[0]; ++x)
        for (int y = 0; y < half[1]; ++y) {
            const float *at = values + 2 * x * slab + 2 * y * row;
            float *to = halved.data() + (size_t(x) * half[1] + y) * half[2];
            for (int z = 0; z < half[2]; ++z) {
                float sum = 0;
                for (size_t corner : {size_t(0), row, slab, slab + row}) sum += at[corner + 2 * z] + at[corner + 2 * z + 1];
                to[z] = sum / 8;
            }
        }
    return halved;
}

} // namespace ringlet
