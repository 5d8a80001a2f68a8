// Coverage of a pixel by a segment, exact to a thousandth: 4 x 4 cells, a lane each.
//
// A strip of half width h covers of a cell of side s = 1/4, whose centre lies v across and u along it from its start,
//     across = clamp((h + s/2 - |v|) / s, 0, min(1, 2h/s)),   along = clamp01((L - u)/s + 1/2) - clamp01(-u/s + 1/2),
// the product of both: the strip filtered by a box of the cell's variance from any angle. At the joints of a strand each
// cell is wholly the segment's in which its centre lies, `along` = [0 <= u < L]: parts of two segments in one cell would be
// composited as if one hid the other by chance, and each joint would lose s/6 of length. Measured against 64 x 64 samples:
// see the tests of the raster.
#pragma once

#include "screen.hpp"
#include "simd.hpp"

namespace ringlet {

using Cells = Lanes<float>; // 4 x 4 cells of a pixel, row by row

inline constexpr int kCells = 4;

/// Where the cells' centres lie in the pixel, from its centre.
struct CellCentres {
    Cells x, y;

    CellCentres() {
        for (int i = 0; i < kCells * kCells; ++i)
            x[i] = (i % kCells + 0.5f) / kCells - 0.5f, y[i] = (i / kCells + 0.5f) / kCells - 0.5f;
    }
};

RINGLET_INLINE Cells clamp_cells(Cells a, float low, float high) {
    return minimum<float>(maximum<float>(a, splat(low)), splat(high));
}

RINGLET_INLINE float sum_cells(Cells a) {
    typedef float Half __attribute__((vector_size(32)));
    typedef float Quarter __attribute__((vector_size(16)));
    const Half h = __builtin_shufflevector(a, a, 0, 1, 2, 3, 4, 5, 6, 7) + __builtin_shufflevector(a, a, 8, 9, 10, 11, 12, 13, 14, 15);
    const Quarter q = __builtin_shufflevector(h, h, 0, 1, 2, 3) + __builtin_shufflevector(h, h, 4, 5, 6, 7);
    const Quarter pairs = q + __builtin_shufflevector(q, q, 2, 3, 0, 1);
    return pairs[0] + pairs[1];
}

/// A segment where it crosses a pixel.
struct Crossing {
    float along, across; // of the pixel's centre [px], from the segment's beginning
    float t;             // part of the segment that lies before it

    RINGLET_INLINE Crossing(const Segment &s, float x, float y) {
        const float fx = x - s.x, fy = y - s.y;
        along = fx * s.ux + fy * s.uy, across = fy * s.ux - fx * s.uy;
        t = std::min(std::max(along * s.inverse, 0.0f), 1.0f);
    }
};

inline constexpr float kNearEnd = 0.75f; // [px] from the middle of a pixel to the farthest end of a segment that touches its cells

/// How far across a segment of this half width [px] cells are covered, and how much of them at most.
struct Band {
    Floats reach, most;

    Band(Floats reach, Floats most) : reach(reach), most(most) {}
    explicit RINGLET_INLINE Band(Floats half) : reach(half * kCells + 0.5f), most(minimum<float>(half * (2 * kCells), splat(1.0f))) {}
};

/// Part of each cell that a segment covers which passes the pixel's centre at this distance.
RINGLET_INLINE Cells across(const Segment &s, float centre, const Band &band, const CellCentres &cell) {
    const Cells v = centre + s.ux * cell.y - s.uy * cell.x;
    return minimum<float>(maximum<float>(band.reach - magnitude(v) * kCells, splat(0.0f)), band.most);
}

/// The same along the segment.
RINGLET_INLINE Cells along(const Segment &s, const Crossing &at, const CellCentres &cell) {
    constexpr float inverse = kCells;
    const Cells u = at.along + s.ux * cell.x + s.uy * cell.y, one = splat(1.0f), none{};
    const Cells past = s.ends & kLast ? clamp_cells((s.length() - u) * inverse + 0.5f, 0, 1) : select<float>(u * s.inverse < 1, one, none);
    const Cells before = s.ends & kFirst ? clamp_cells(u * -inverse + 0.5f, 0, 1) : select<float>(u < 0, one, none);
    return past - before;
}

} // namespace ringlet
