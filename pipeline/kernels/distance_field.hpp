// Signed distance to the head on a grid: trilinear between nodes, clamped to the grid's box outside.
//
// The clamped value is a lower bound of the distance, because projection on a convex box does not lengthen distances.
#pragma once

#include "simd.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace ringlet {

struct DistanceField {
    std::vector<float> values; // (nx, ny, nz) [m], negative inside
    int n[3];
    double origin[3], spacing;
    double steepest; // bound on the slope of the interpolated field: 1 for a true distance, a little more in cells

    /// Largest slope over all cells, from the differences along their edges.
    void measure_slope() {
        const size_t stride[3] = {size_t(n[1]) * n[2], size_t(n[2]), 1};
        double worst = 0;
        for (int x = 0; x + 1 < n[0]; ++x)
            for (int y = 0; y + 1 < n[1]; ++y)
                for (int z = 0; z + 1 < n[2]; ++z) {
                    const float *cell = &values[x * stride[0] + y * stride[1] + z];
                    double square = 0;
                    for (int axis = 0; axis < 3; ++axis) {
                        size_t s = stride[axis], u = stride[(axis + 1) % 3], v = stride[(axis + 2) % 3];
                        double rise = 0;
                        for (size_t corner : {size_t(0), u, v, u + v})
                            rise = std::max(rise, std::abs(double(cell[corner + s]) - cell[corner]));
                        square += rise * rise;
                    }
                    worst = std::max(worst, square);
                }
        steepest = std::max(1.0, std::sqrt(worst) / spacing);
    }
};

/// Distance phi and its gradient (not normalised) at points of the head's rest frame. Not-a-number gives the value at
/// the grid's first corner, never a read outside the grid.
template <class Real>
__attribute__((noinline)) void sample(const DistanceField &field, Vec3<Real> x, Lanes<Real> &phi,
                                      Vec3<Real> &gradient) {
    constexpr int W = kLanes<Real>;
    const int ny = field.n[1], nz = field.n[2], row = ny * nz;
    const Real inverse = Real(1 / field.spacing);
    const Lanes<Real> ux = (x.x - Real(field.origin[0])) * inverse, uy = (x.y - Real(field.origin[1])) * inverse,
                      uz = (x.z - Real(field.origin[2])) * inverse;
    const Real last[3] = {field.n[0] - Real(1.001), ny - Real(1.001), nz - Real(1.001)};
    const float *values = field.values.data();
    Real out[4][W], u[3][W];
    __builtin_memcpy(u[0], &ux, sizeof ux);
    __builtin_memcpy(u[1], &uy, sizeof uy);
    __builtin_memcpy(u[2], &uz, sizeof uz);
#pragma omp simd
    for (int k = 0; k < W; ++k) {
        const Real a = u[0][k] >= 0 ? (u[0][k] < last[0] ? u[0][k] : last[0]) : Real(0);
        const Real b = u[1][k] >= 0 ? (u[1][k] < last[1] ? u[1][k] : last[1]) : Real(0);
        const Real c = u[2][k] >= 0 ? (u[2][k] < last[2] ? u[2][k] : last[2]) : Real(0);
        const int ia = int(a), ib = int(b), ic = int(c), at = (ia * ny + ib) * nz + ic;
        const Real fa = a - ia, fb = b - ib, fc = c - ic;
        const Real v000 = values[at], v001 = values[at + 1], v010 = values[at + nz], v011 = values[at + nz + 1];
        const Real v100 = values[at + row], v101 = values[at + row + 1];
        const Real v110 = values[at + row + nz], v111 = values[at + row + nz + 1];
        // along z, then y, then x; the gradient is the derivative of the same interpolant
        const Real z00 = v000 + fc * (v001 - v000), z01 = v010 + fc * (v011 - v010);
        const Real z10 = v100 + fc * (v101 - v100), z11 = v110 + fc * (v111 - v110);
        const Real y0 = z00 + fb * (z01 - z00), y1 = z10 + fb * (z11 - z10);
        const Real d0 = (1 - fb) * (v001 - v000) + fb * (v011 - v010);
        const Real d1 = (1 - fb) * (v101 - v100) + fb * (v111 - v110);
        out[0][k] = y0 + fa * (y1 - y0);
        out[1][k] = y1 - y0;
        out[2][k] = (1 - fa) * (z01 - z00) + fa * (z11 - z10);
        out[3][k] = (1 - fa) * d0 + fa * d1;
    }
    __builtin_memcpy(&phi, out[0], sizeof phi);
    __builtin_memcpy(&gradient.x, out[1], sizeof phi);
    __builtin_memcpy(&gradient.y, out[2], sizeof phi);
    __builtin_memcpy(&gradient.z, out[3], sizeof phi);
}

} // namespace ringlet
