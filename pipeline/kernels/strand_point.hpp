// A point of a strand, wherever the strand lies in memory, and who shades it.
#pragma once

#include "simd.hpp"

#include <cstddef>
#include <cstdint>

namespace ringlet {

struct StrandPoint {
    const float *root;       // (P, 3) [m] the strand's points
    const float *variation; // (3,) how the strand differs from others; see pipeline/render/pigment.py
    uint32_t key;            // of the strand
    int j;                   // number of the point
};

/// Colours at a point of a strand, linear RGB: in the mean over its width and, less that, at places across it; see across.hpp.
struct Across {
    static constexpr int kPlaces = 16;

    Lanes<float> aside[3], sum[3]; // at each place, and their integral up to there from the first one, in steps from one to the next
    float mean[3];
};

struct PointShader {
    virtual ~PointShader() = default;

    /// Linear RGB (count, 3) of points of strands of P points; called from many threads, on one thread each time.
    virtual void shade(const StrandPoint *points, size_t count, int P, float *radiance) const = 0;

    /// Whether colours vary across strands, as `shade_across` tells.
    virtual bool varies_across() const { return false; }
    virtual void shade_across(const StrandPoint *, size_t, int, Across *) const {}
};

} // namespace ringlet
