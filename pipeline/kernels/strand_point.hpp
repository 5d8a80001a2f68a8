// A point of a strand, wherever the strand lies in memory, and who shades it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ringlet {

struct StrandPoint {
    const float *root;       // (P, 3) [m] the strand's points
    const float *variation; // (3,) how the strand differs from others; see pipeline/render/pigment.py
    uint32_t key;            // of the strand
    int j;                   // number of the point
};

struct PointShader {
    virtual ~PointShader() = default;

    /// Linear RGB (count, 3) of points of strands of P points; called from many threads, on one thread each time.
    virtual void shade(const StrandPoint *points, size_t count, int P, float *radiance) const = 0;
};

} // namespace ringlet
