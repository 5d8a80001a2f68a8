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

/// Distance phi and its gradient (not normalised) at points of the head's rest frame. Not-a-number gives the value at
/// the grid's first corner, never a read outside the grid.
template <class Real>
__attribute__((noinline)) void sample(const DistanceField &field, Vec3<Real> x, Lanes<Real> &phi,
                                      Vec3<Real> &gradient) {
    using L = Lanes<Real>;
    const int ny = field.n[1], nz = field.n[2], row = ny * nz;
    const Real inverse = Real(1 / field.spacing);
    const L zero = splat(Real(0));
    const auto clamped = [&](L u, int n) RINGLET_ALWAYS {
        return select<Real>(u >= zero, minimum<Real>(u, splat(n - Real(1.001))), zero);
    };
    const L a = clamped((x.x - Real(field.origin[0])) * inverse, field.n[0]);
    const L b = clamped((x.y - Real(field.origin[1])) * inverse, ny);
    const L c = clamped((x.z - Real(field.origin[2])) * inverse, nz);
    const Mask<Real> ia = __builtin_convertvector(a, Mask<Real>), ib = __builtin_convertvector(b, Mask<Real>),
                     ic = __builtin_convertvector(c, Mask<Real>);
    const Mask<Real> at = (ia * ny + ib) * nz + ic;
    const L fa = a - __builtin_convertvector(ia, L), fb = b - __builtin_convertvector(ib, L),
            fc = c - __builtin_convertvector(ic, L);
    const float *values = field.values.data();
    L v000, v001, v010, v011, v100, v101, v110, v111;
    gather_pairs<Real>(values, at, v000, v001);
    gather_pairs<Real>(values + nz, at, v010, v011);
    gather_pairs<Real>(values + row, at, v100, v101);
    gather_pairs<Real>(values + row + nz, at, v110, v111);
    // along z, then y, then x; the gradient is the derivative of the same interpolant
    const L d00 = v001 - v000, d01 = v011 - v010, d10 = v101 - v100, d11 = v111 - v110;
    const L z00 = v000 + fc * d00, z01 = v010 + fc * d01, z10 = v100 + fc * d10, z11 = v110 + fc * d11;
    const L e0 = z01 - z00, e1 = z11 - z10, y0 = z00 + fb * e0, y1 = z10 + fb * e1;
    const L d0 = d00 + fb * (d01 - d00), d1 = d10 + fb * (d11 - d10);
    phi = y0 + fa * (y1 - y0);
    gradient = {y1 - y0, e0 + fa * (e1 - e0), d0 + fa * (d1 - d0)};
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
