// Blocks of 4 x 4 tiles, a lane for each tile: which of them a segment touches, and how deep.
//
// A segment of half width r that is no box is kept where none of the lines that could part it from the tile does: those
// along the tile's sides, and the segment's own (the theorem of separating axes, exact for convex shapes). Within a tile
// a lane is a row of pixels, or a column where the segment is flat.
#pragma once

#include "elementary.hpp"
#include "screen.hpp"

namespace ringlet {

using TileLanes = Lanes<float>; // the tiles of a block, row by row

/// The middles of a block's tiles [px], from the block's corner.
struct TileMiddles {
    TileLanes x, y;

    TileMiddles() {
        for (int k = 0; k < kSide * kSide; ++k) x[k] = (k % kSide + 0.5f) * kTile, y[k] = (k / kSide + 0.5f) * kTile;
    }
};

/// A segment in the tiles of a block.
struct Touch {
    Mask<float> tiles; // that it may touch
    TileLanes nearest; // its least depth in the tile, or less
    TileLanes depth;   // at its point nearest the tile's middle: tiles are composited in this order

    /// Of a segment so long [px]; the block's corner is at (left, top) [px].
    RINGLET_INLINE Touch(const Segment &s, float length, const TileMiddles &middle, float left, float top) {
        const float reach = s.reach(), dx = s.ux * length, dy = s.uy * length;
        const TileLanes x = middle.x + (left - s.x), y = middle.y + (top - s.y);
        const float wide = kTile * 0.5f * (std::abs(s.ux) + std::abs(s.uy)) + reach, far = kTile * 0.5f + reach;
        tiles = (magnitude(x * s.uy - y * s.ux) <= wide) & (magnitude(x - 0.5f * dx) <= far + 0.5f * std::abs(dx)) &
                (magnitude(y - 0.5f * dy) <= far + 0.5f * std::abs(dy));
        const TileLanes t = (x * s.ux + y * s.uy) * s.inverse;
        depth = s.d() + s.dd() * minimum<float>(maximum<float>(t, splat(0.0f)), splat(1.0f));
        const float spread = std::abs(s.dd()) * s.inverse * (0.75f * kTile);
        nearest = maximum<float>(depth - spread, splat(std::min(s.d(), s.d() + s.dd())));
    }
};

/// Calls visit(block, left, top) for the blocks that the box around a segment so long [px] touches.
template <class Visit> inline void visit_blocks(const View &view, const Segment &s, float length, Visit &&visit) {
    constexpr float side = kSide * kTile, per_block = 1 / side;
    const float reach = s.reach(), x1 = s.x + s.ux * length, y1 = s.y + s.uy * length;
    const float left = std::min(s.x, x1) - reach, right = std::max(s.x, x1) + reach;
    const float top = std::min(s.y, y1) - reach, bottom = std::max(s.y, y1) + reach;
    // Compared as numbers: what lies far outside must not wrap when it becomes an integer
    if (!(bottom >= 0 && top < view.H && right >= 0 && left < view.W)) return;
    const int first = int(std::max(top, 0.0f) * per_block), last = std::min(int(std::min(bottom, float(view.H)) * per_block), view.down() - 1);
    const int begin = int(std::max(left, 0.0f) * per_block), end = std::min(int(std::min(right, float(view.W)) * per_block), view.across() - 1);
    for (int row = first; row <= last; ++row)
        for (int column = begin; column <= end; ++column) visit(row * view.across() + column, column * side, row * side);
}

/// Pixels of a tile: a bit for each in each row, and in each column.
struct TilePixels {
    Words rows, columns;

    static TilePixels all() {
        const Words every = Words{} + ((1u << kTile) - 1);
        return {every, every};
    }
    static TilePixels none() { return {Words{}, Words{}}; }
    /// Those from column x and row y on, `side` of them each way.
    static TilePixels square(int x, int y, int side) {
        TilePixels pixels = none();
        for (int b = y; b < y + side; ++b)
            for (int a = x; a < x + side; ++a) pixels.add(a, b);
        return pixels;
    }

    bool has(int x, int y) const { return rows[y] >> x & 1; }
    bool some() const { return any<float>((Mask<float>)rows != 0); }
    void add(int x, int y) { rows[y] |= 1u << x, columns[x] |= 1u << y; }
    TilePixels operator&(const TilePixels &also) const { return {rows & also.rows, columns & also.columns}; }
    TilePixels operator|(const TilePixels &or_else) const { return {rows | or_else.rows, columns | or_else.columns}; }
    TilePixels without(const TilePixels &others) const { return {rows & ~others.rows, columns & ~others.columns}; }
};

/// A tile's rows, or columns: their numbers and middles.
struct TileSteps {
    Mask<float> line;
    Floats middle;

    TileSteps() {
        for (int k = 0; k < kTile; ++k) line[k] = k, middle[k] = float(k) + 0.5f;
    }
};

RINGLET_INLINE bool steep(const Segment &s) { return std::abs(s.uy) >= std::abs(s.ux); }

/// Which of some pixels of the tile with its corner at (left, top) a segment may cover: bits in each row of a steep
/// segment, in each column of a flat one.
RINGLET_INLINE Words crossed(const Segment &s, float left, float top, const TilePixels &of, const TileSteps &step) {
    constexpr float margin = 0.02f;
    const float x = s.x - left, y = s.y - top, half = std::max(s.h, s.h + s.dh);
    const bool rows = steep(s);
    const float p0 = rows ? y : x, q0 = rows ? x : y, up = rows ? s.uy : s.ux, uq = rows ? s.ux : s.uy;
    const float p1 = p0 + up * s.length(), reach = half * std::abs(uq) + 0.5f * margin + 0.5f, inverse = 1 / up;
    const float slope = uq * inverse, wide = (half + margin) * std::abs(inverse) + (0.5f - margin) * std::abs(slope);
    const Floats middle = q0 + (step.middle - p0) * slope;
    const Floats low = minimum<float>(maximum<float>(middle - wide, splat(0.0f)), splat(float(kTile)));
    const Floats high = minimum<float>(maximum<float>(middle + wide + 1.0f, splat(0.0f)), splat(float(kTile)));
    const Mask<float> spanned = (step.middle >= std::min(p0, p1) - reach) & (step.middle <= std::max(p0, p1) + reach) & (high > low);
    const Words one = Words{} + 1, begin = (Words)__builtin_convertvector(low, Mask<float>), end = (Words)__builtin_convertvector(high, Mask<float>);
    return (Words)spanned & ((one << end) - (one << begin)) & (rows ? of.rows : of.columns);
}

} // namespace ringlet
