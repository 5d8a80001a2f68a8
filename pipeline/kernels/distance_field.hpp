// Signed distance to the head on a grid: trilinear between nodes, clamped to the grid's box outside.
//
// The clamped value is a lower bound of the distance, because projection on a convex box does not lengthen distances.
#pragma once

#include "simd.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ringlet {

struct DistanceField {
    std::vector<float> values; // (nx, ny, nz) [m], negative inside
    int n[3];
    double origin[3], spacing;
    double steepest; // bound on the slope of the interpolated field: 1 for a true distance, a little more in cells

    static constexpr int kBrick = 2; // cells along each side of a brick
    std::vector<int8_t> least;       // least value of each brick in multiples of `step`, rounded down
    int bricks[3];
    float step;

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

    /// Fills `least`.
    void measure_bricks() {
        for (int axis = 0; axis < 3; ++axis) bricks[axis] = (n[axis] - 2) / kBrick + 1;
        const float lowest = *std::min_element(values.begin(), values.end());
        step = std::max(float(spacing) / 2, -lowest / 127); // so that the lowest has a place
        least.resize(size_t(bricks[0]) * bricks[1] * bricks[2] + 3); // `gather_bytes` reads a little further
        int8_t *to = least.data();
        for (int x = 0; x < bricks[0]; ++x)
            for (int y = 0; y < bricks[1]; ++y)
                for (int z = 0; z < bricks[2]; ++z) {
                    const float steps = std::floor(least_in(kBrick * x, kBrick * y, kBrick * z) / step);
                    *to++ = int8_t(std::min(std::max(steps, -128.0f), 127.0f));
                }
    }

  private:
    /// Least value of the nodes around the brick whose first node is (x, y, z).
    float least_in(int x, int y, int z) const {
        float lowest = values[(size_t(x) * n[1] + y) * n[2] + z];
        for (int i = x; i <= std::min(x + kBrick, n[0] - 1); ++i)
            for (int j = y; j <= std::min(y + kBrick, n[1] - 1); ++j)
                for (int k = z; k <= std::min(z + kBrick, n[2] - 1); ++k)
                    lowest = std::min(lowest, values[(size_t(i) * n[1] + j) * n[2] + k]);
        return lowest;
    }
};

/// The cells that points of the head's rest frame lie in: number of the first corner, and how far along each axis.
/// Not-a-number lies in the grid's first cell.
template <class Real> struct Cells {
    Mask<Real> at;
    Lanes<Real> along[3];

    RINGLET_INLINE Cells(const DistanceField &field, Vec3<Real> x) {
        const Real inverse = Real(1 / field.spacing);
        const Lanes<Real> zero = splat(Real(0)), part[3] = {x.x, x.y, x.z};
        Mask<Real> whole[3];
        for (int k = 0; k < 3; ++k) {
            const Lanes<Real> u = (part[k] - Real(field.origin[k])) * inverse;
            const Lanes<Real> inside = select<Real>(u >= zero, minimum<Real>(u, splat(field.n[k] - Real(1.001))), zero);
            whole[k] = __builtin_convertvector(inside, Mask<Real>);
            along[k] = inside - __builtin_convertvector(whole[k], Lanes<Real>);
        }
        at = (whole[0] * field.n[1] + whole[1]) * field.n[2] + whole[2];
    }
};

/// The distances at the eight corners of cells; the last axis goes fastest.
template <class Real> struct Corners {
    static constexpr int kFew = kLanes<Real> / 4;
    Lanes<Real> value[8];

    /// Reads those of cells, for lanes whose cell has changed: one by one where they are few.
    __attribute__((noinline)) void read(const DistanceField &field, Mask<Real> at, Mask<Real> changed) {
        const int nz = field.n[2], row = field.n[1] * nz;
        const float *values = field.values.data();
        uint32_t left = set_lanes<Real>(changed);
        if (__builtin_popcount(left) <= kFew) {
            for (; left; left &= left - 1) {
                const int lane = __builtin_ctz(left);
                const float *first = values + at[lane];
                for (int k = 0; k < 8; ++k) value[k][lane] = Real(first[(k >> 2) * row + (k >> 1 & 1) * nz + (k & 1)]);
            }
            return;
        }
        gather_pairs<Real>(values, at, value[0], value[1]);
        gather_pairs<Real>(values + nz, at, value[2], value[3]);
        gather_pairs<Real>(values + row, at, value[4], value[5]);
        gather_pairs<Real>(values + row + nz, at, value[6], value[7]);
    }

    /// Distance phi and its gradient (not normalised) in the cells: the derivative of the same interpolant.
    RINGLET_INLINE void interpolate(const Cells<Real> &cells, Lanes<Real> &phi, Vec3<Real> &gradient) const {
        using L = Lanes<Real>;
        const L *v = value, fa = cells.along[0], fb = cells.along[1], fc = cells.along[2];
        // along z, then y, then x
        const L d00 = v[1] - v[0], d01 = v[3] - v[2], d10 = v[5] - v[4], d11 = v[7] - v[6];
        const L z00 = v[0] + fc * d00, z01 = v[2] + fc * d01, z10 = v[4] + fc * d10, z11 = v[6] + fc * d11;
        const L e0 = z01 - z00, e1 = z11 - z10, y0 = z00 + fb * e0, y1 = z10 + fb * e1;
        const L d0 = d00 + fb * (d01 - d00), d1 = d10 + fb * (d11 - d10);
        phi = y0 + fa * (y1 - y0);
        gradient = {y1 - y0, e0 + fa * (e1 - e0), d0 + fa * (d1 - d0)};
    }
};

/// Distance phi and its gradient (not normalised) at points of the head's rest frame. Not-a-number gives the value at
/// the grid's first corner, never a read outside the grid.
template <class Real>
__attribute__((noinline)) void sample(const DistanceField &field, Vec3<Real> x, Lanes<Real> &phi, Vec3<Real> &gradient) {
    const Cells<Real> cells(field, x);
    Corners<Real> corners;
    corners.read(field, cells.at, Mask<Real>{} - 1);
    corners.interpolate(cells, phi, gradient);
}

/// A number that the distance at x, as `sample` gives it, is not below: one read of a table that stays near the
/// processor, where `sample` needs eight of the whole grid.
RINGLET_INLINE Lanes<float> lower_bound(const DistanceField &field, Vec3<float> x) {
    const float inverse = float(1 / field.spacing);
    const auto brick = [&](Lanes<float> u, int axis) RINGLET_ALWAYS {
        const Lanes<float> v = (u - float(field.origin[axis])) * inverse;
        const Lanes<float> kept = minimum<float>(select<float>(v >= 0, v, Lanes<float>{}), splat(field.n[axis] - 1.001f));
        return __builtin_convertvector(kept, Mask<float>) / DistanceField::kBrick;
    };
    const Mask<float> at = (brick(x.x, 0) * field.bricks[1] + brick(x.y, 1)) * field.bricks[2] + brick(x.z, 2);
    return __builtin_convertvector(gather_bytes(field.least.data(), at), Lanes<float>) * field.step;
}

} // namespace ringlet
