// Line integrals of a density from every voxel towards a light, slice by slice.
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

/// One slice (B, C): `before` and `here` are padded by one all around and hold tau + ds/2 rho.
template <bool contiguous>
void sweep_slice(const float *rho, float *tau, const size_t stride[2], const int extent[2], const Shift shift[2],
                 float half_step, std::pair<const float *, float *> padded) {
    const size_t row = extent[1] + 2, step = contiguous ? 1 : stride[1];
    const float u = shift[0].weight, v = shift[1].weight;
    for (int b = 0; b < extent[0]; ++b) {
        const float *low = padded.first + (b + 1 + shift[0].low) * row + 1 + shift[1].low, *high = low + row;
        float *here = padded.second + (b + 1) * row + 1;
        const float *density = rho + b * stride[0];
        float *depth = tau + b * stride[0];
#pragma omp simd
        for (int c = 0; c < extent[1]; ++c) {
            const float own = half_step * density[c * step];
            const float from = (1 - u) * ((1 - v) * low[c] + v * low[c + 1]) + u * ((1 - v) * high[c] + v * high[c + 1]);
            depth[c * step] = from + own;
            here[c] = from + own + own;
        }
    }
}

/// Fills tau (nx, ny, nz) from rho (nx, ny, nz) along a unit direction.
inline void sweep(const float *rho, float *tau, const int n[3], double spacing, const float direction[3]) {
    int a = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(direction[i]) > std::abs(direction[a])) a = i;
    const int b = a == 0 ? 1 : 0, c = a == 2 ? 1 : 2;
    const size_t strides[3] = {size_t(n[1]) * n[2], size_t(n[2]), 1};
    const double along = std::abs(double(direction[a]));
    const Shift shift[2] = {Shift(direction[b] / along), Shift(direction[c] / along)};
    const size_t stride[2] = {strides[b], strides[c]};
    const int extent[2] = {n[b], n[c]};
    std::vector<float> before(size_t(n[b] + 2) * (n[c] + 2)), here(before.size());
    for (int i = 0; i < n[a]; ++i) {
        const size_t at = strides[a] * (direction[a] > 0 ? n[a] - 1 - i : i);
        auto slice = stride[1] == 1 ? sweep_slice<true> : sweep_slice<false>;
        slice(rho + at, tau + at, stride, extent, shift, float(spacing / along / 2), {before.data(), here.data()});
        std::swap(before, here);
    }
}

} // namespace ringlet
