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

/// 16 voxels of a row while they are swept.
struct SweptPlace {
    size_t at;              // in rows across z if the direction goes along z most, in those across x and y if not
    int slice, line, first; // along the dominant axis, the next one and the last: of the first voxel

    operator size_t() const { return at; }
};

/// Some densities of the same shape on the way along a unit direction, slice by slice from the light on.
template <int count> class Sweep {
    static constexpr size_t kPad = 16;

    const SweptVoxels *voxels[count];
    int a, b, c; // axes: the dominant one, that of rows, that along them
    Rows rows;
    bool down; // the light is where the numbers of slices are largest
    Shift shift[2];
    float half_step;
    // tau + ds/2 rho of the slice before and of this one, within zeros
    size_t row;
    std::vector<float> before[count], here[count];
    Floats lane;

    RINGLET_INLINE static Floats read(const float *from) {
        Floats lanes;
        __builtin_memcpy(&lanes, from, sizeof lanes);
        return lanes;
    }

  public:
    Sweep(const SweptVoxels *const (&swept)[count], double spacing, const float direction[3])
        : a(dominant(direction)), b(a == 0 ? 1 : 0), c(a == 2 ? 1 : 2), rows(swept[0]->n, a == 2), down(direction[a] > 0),
          shift{Shift(direction[b] / std::abs(double(direction[a]))), Shift(direction[c] / std::abs(double(direction[a])))},
          half_step(float(spacing / std::abs(double(direction[a])) / 2)), row(rows.length + 2 * kPad) {
        for (int k = 0; k < count; ++k) {
            voxels[k] = swept[k];
            before[k].resize((rows.n[b] + 2) * row), here[k].resize((rows.n[b] + 2) * row);
        }
        for (int k = 0; k < 16; ++k) lane[k] = float(k);
    }

    int slices() const { return rows.n[a]; }
    int lines() const { return rows.n[b]; }
    size_t length() const { return rows.length; }

    /// 16 voxels of the k-th slice, from voxel j of a line on: of all of them, before `next`.
    RINGLET_INLINE SweptPlace step(int k, int line, size_t j, Floats (&tau)[count]) {
        const int number = down ? slices() - 1 - k : k;
        const size_t at = rows.stride(a) * number + rows.stride(b) * line + j, to = (line + 1) * row + kPad + j;
        const size_t low = to + shift[0].low * ptrdiff_t(row) + shift[1].low, high = low + row;
        const float u = shift[0].weight, v = shift[1].weight;
        const Ints valid = lane < float(rows.n[c] - int(j));
        for (int q = 0; q < count; ++q) {
            const float *from = before[q].data();
            const Floats own = half_step * read(voxels[q]->rows[a == 2].data() + at);
            tau[q] = (1 - u) * ((1 - v) * read(from + low) + v * read(from + low + 1)) +
                     u * ((1 - v) * read(from + high) + v * read(from + high + 1)) + own;
            const Floats after = valid ? tau[q] + own : splat(0.0f);
            __builtin_memcpy(here[q].data() + to, &after, sizeof after);
        }
        return {at, number, line, int(j)};
    }

    /// After the last of a slice.
    void next() {
        for (int q = 0; q < count; ++q) std::swap(before[q], here[q]);
    }
};

/// Sweeps all slices: visit(place, tau) for every 16 voxels of a row. Those beyond a row's end mean nothing.
template <int count, class Visit>
void sweep(const SweptVoxels *const (&voxels)[count], double spacing, const float direction[3], Visit &&visit) {
    Sweep<count> own(voxels, spacing, direction);
    for (int k = 0; k < own.slices(); ++k, own.next())
        for (int line = 0; line < own.lines(); ++line)
            for (size_t j = 0; j < own.length(); j += 16) {
                Floats tau[count];
                const SweptPlace at = own.step(k, line, j, tau);
                visit(at, tau);
            }
}

} // namespace ringlet
