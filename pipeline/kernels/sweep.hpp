// Line integrals of densities from every voxel towards a light, slice by slice.
//
// Slices across the dominant axis of the direction, from the light on: with the density rho, the slice before shifted
// by where the ray came through it, and ds the length of the ray between two slices,
//
//     tau[a] = shifted(tau[a-1] + ds/2 rho[a-1]) + ds/2 rho[a].
//
// The shift is the same for a whole slice, so it is a stencil of four neighbours. Nothing lies outside the grid.
#pragma once

#include "simd.hpp"

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace ringlet {

/// How the ray through a voxel's middle meets the slice before: the lower neighbour (-1 or 0) and the upper's weight.
struct Shift {
    int low;
    float weight;

    explicit Shift(double shift) : low(shift < 0 ? -1 : 0), weight(float(shift - low)) {}
};

/// The axis that a direction goes along most.
inline int dominant(const float direction[3]) {
    int a = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(direction[i]) > std::abs(direction[a])) a = i;
    return a;
}

/// How voxels (nx, ny, nz) lie in memory while they are swept: in rows of whole vectors, zeros at their ends, along z; along
/// y where slices go across z, so that a row is always within a slice.
struct Rows {
    int n[3];
    bool across_z;
    size_t length; // of a row, a multiple of 16

    Rows(const int extents[3], bool across_z)
        : n{extents[0], extents[1], extents[2]}, across_z(across_z), length(size_t(extents[across_z ? 1 : 2] + 15) / 16 * 16) {}

    size_t size() const { return length * n[0] * (across_z ? n[2] : n[1]); }
    size_t stride(int axis) const {
        if (across_z) return axis == 2 ? length * n[0] : axis == 0 ? length : 1;
        return axis == 0 ? length * n[1] : axis == 1 ? length : 1;
    }

    /// Calls visit(place in rows, number in (nx, ny, nz)) for the voxels of slab x.
    template <class Visit> RINGLET_INLINE void each(int x, Visit &&visit) const {
        const size_t step = stride(2);
        for (int y = 0; y < n[1]; ++y) {
            const size_t at = x * stride(0) + y * stride(1), voxel = (size_t(x) * n[1] + y) * n[2];
            for (int z = 0; z < n[2]; ++z) visit(at + z * step, voxel + z);
        }
    }
};

/// Voxels in both kinds of rows.
struct SweptVoxels {
    int n[3];
    std::vector<float> rows[2]; // across x and y, across z

    /// Of values (nx, ny, nz).
    SweptVoxels(const float *values, const int extents[3], int threads) : n{extents[0], extents[1], extents[2]} {
        for (int across_z = 0; across_z < 2; ++across_z) {
            const Rows to(n, across_z);
            std::vector<float> &own = rows[across_z];
            own.resize(to.size());
#pragma omp parallel for schedule(static) num_threads(threads)
            for (int x = 0; x < n[0]; ++x) to.each(x, [&](size_t at, size_t voxel) RINGLET_ALWAYS { own[at] = values[voxel]; });
        }
    }
};

/// Sweeps some densities of the same shape along a unit direction: visit(at, tau) for every 16 voxels of a row, `at` their
/// place in rows across z if that is dominant, in those across x and y if not. Those beyond a row's end mean nothing.
template <int count, class Visit>
void sweep(const SweptVoxels *const (&voxels)[count], double spacing, const float direction[3], Visit &&visit) {
    const int a = dominant(direction), b = a == 0 ? 1 : 0, c = a == 2 ? 1 : 2;
    const Rows rows(voxels[0]->n, a == 2);
    const int *n = rows.n;
    const double along = std::abs(double(direction[a]));
    const Shift shift[2] = {Shift(direction[b] / along), Shift(direction[c] / along)};
    const float u = shift[0].weight, v = shift[1].weight, half_step = float(spacing / along / 2);
    // tau + ds/2 rho of the slice before and of this one, within zeros
    constexpr size_t pad = 16;
    const size_t row = rows.length + 2 * pad;
    std::vector<float> before[count], here[count];
    for (int k = 0; k < count; ++k) before[k].resize((n[b] + 2) * row), here[k].resize((n[b] + 2) * row);
    Floats lane;
    for (int k = 0; k < 16; ++k) lane[k] = float(k);
    const auto read = [](const float *from) RINGLET_ALWAYS {
        Floats lanes;
        __builtin_memcpy(&lanes, from, sizeof lanes);
        return lanes;
    };
    for (int slice = 0; slice < n[a]; ++slice) {
        const size_t first = rows.stride(a) * (direction[a] > 0 ? n[a] - 1 - slice : slice);
        for (int i = 0; i < n[b]; ++i)
            for (size_t j = 0; j < rows.length; j += 16) {
                const size_t at = first + rows.stride(b) * i + j, to = (i + 1) * row + pad + j;
                const size_t low = to + shift[0].low * ptrdiff_t(row) + shift[1].low, high = low + row;
                const Ints valid = lane < float(n[c] - int(j));
                Floats tau[count];
                for (int k = 0; k < count; ++k) {
                    const float *from = before[k].data();
                    const Floats own = half_step * read(voxels[k]->rows[a == 2].data() + at);
                    tau[k] = (1 - u) * ((1 - v) * read(from + low) + v * read(from + low + 1)) +
                             u * ((1 - v) * read(from + high) + v * read(from + high + 1)) + own;
                    const Floats after = valid ? tau[k] + own : splat(0.0f);
                    __builtin_memcpy(here[k].data() + to, &after, sizeof after);
                }
                visit(at, tau);
            }
        for (int k = 0; k < count; ++k) std::swap(before[k], here[k]);
    }
}

} // namespace ringlet
