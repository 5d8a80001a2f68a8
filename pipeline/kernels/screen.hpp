// Strands on the screen: perspective, clipping at the near plane, tiles.
//
// Notation: x, y [px] from the top left corner of the picture, y downwards, pixel centres at +0.5; d depth, 0 at the
// near plane and 1 at the far one, as OpenGL keeps it (linear along a segment on the screen); h half width [px].
// A clip-space point c = M (x, y, z, 1) lies at x = (c.x / c.w + 1) W / 2, y = (1 - c.y / c.w) H / 2,
// d = (c.z / c.w + 1) / 2, and a radius r there is h = scale r / c.w wide.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ringlet {

inline constexpr int kTile = 16;          // [px] side of a tile
inline constexpr float kOutermost = 1e6f; // [px] a segment that reaches farther is not drawn: its direction is rounding

inline constexpr float kReach = 0.3f;     // [px] beyond its half width that a segment covers cells of pixels

/// The camera of a picture.
struct View {
    float M[4][4];     // world [m] to clip space
    int W, H;          // [px]
    float scale;       // [px]: half width of a unit radius at unit distance
    float near, far;   // [m] of the clipping planes

    int across() const { return (W + kTile - 1) / kTile; }
    int down() const { return (H + kTile - 1) / kTile; }
    int tiles() const { return across() * down(); }

    /// Depth of what is `distance` [m] away along the line of sight.
    float depth(float distance) const { return far / (far - near) * (1 - near / distance); }
};

/// A point of a strand: clip space, and what follows from it where it is in front of the near plane.
struct ScreenStrand {
    std::vector<float> cx, cy, cw, x, y, d, h;

    explicit ScreenStrand(int P) : cx(P), cy(P), cw(P), x(P), y(P), d(P), h(P) {}

    /// Projects points (P, 3) [m] of widths (P,) [m]; whether all are finite and in front of the near plane.
    bool project(const View &view, const float *points, const float *widths, int P) {
        // Copies and promises that nothing overlaps: without them no loop here goes 16 points at a time
        const View v = view;
        float *__restrict to_cx = cx.data(), *__restrict to_cy = cy.data(), *__restrict to_cw = cw.data();
        float *__restrict to_x = x.data(), *__restrict to_y = y.data(), *__restrict to_d = d.data(), *__restrict to_h = h.data();
        const float *__restrict p = points, *__restrict wide = widths;
        const float across = 0.5f * v.W, down = 0.5f * v.H, slope = v.far / (v.far - v.near), half = 0.5f * v.scale;
        int behind = 0;
#pragma omp simd reduction(| : behind)
        for (int j = 0; j < P; ++j) {
            const float a = p[3 * j], b = p[3 * j + 1], c = p[3 * j + 2];
            const float X = v.M[0][0] * a + v.M[0][1] * b + v.M[0][2] * c + v.M[0][3];
            const float Y = v.M[1][0] * a + v.M[1][1] * b + v.M[1][2] * c + v.M[1][3];
            const float w = v.M[3][0] * a + v.M[3][1] * b + v.M[3][2] * c + v.M[3][3], inverse = 1 / w;
            const float sx = (X * inverse + 1) * across, sy = (1 - Y * inverse) * down, sh = half * wide[j] * inverse;
            to_cx[j] = X, to_cy[j] = Y, to_cw[j] = w;
            to_x[j] = sx, to_y[j] = sy, to_d[j] = slope * (1 - v.near * inverse), to_h[j] = sh;
            behind |= !(w >= v.near) | !(0 * (sx + sy + sh) == 0); // also where something is not finite
        }
        return !behind;
    }
};

/// A segment on the screen, 64 bytes; colours are linear along it.
struct alignas(64) Segment {
    float x[2], y[2], d[2], h[2];
    float colour[2][3];
};

/// The part of segment j of a strand between the parameters t[0] and t[1] that is in front of the near plane.
/// False where nothing is.
inline bool clipped(const View &view, const ScreenStrand &s, const float *widths, int j, Segment &to, float t[2]) {
    const float w0 = s.cw[j], w1 = s.cw[j + 1];
    t[0] = w0 < view.near ? (view.near - w0) / (w1 - w0) : 0;
    t[1] = w1 < view.near ? (view.near - w0) / (w1 - w0) : 1;
    if (!(w0 >= view.near || w1 >= view.near)) return false;
    const float slope = view.far / (view.far - view.near);
    for (int end = 0; end < 2; ++end) {
        const auto between = [&](float a, float b) { return t[end] == 0 ? a : t[end] == 1 ? b : a + t[end] * (b - a); };
        const float w = std::max(between(w0, w1), view.near), inverse = 1 / w;
        to.x[end] = (between(s.cx[j], s.cx[j + 1]) * inverse + 1) * (0.5f * view.W);
        to.y[end] = (1 - between(s.cy[j], s.cy[j + 1]) * inverse) * (0.5f * view.H);
        to.d[end] = std::max(slope * (1 - view.near * inverse), 0.0f);
        to.h[end] = 0.5f * view.scale * between(widths[j], widths[j + 1]) * inverse;
    }
    return true;
}

/// Whether a segment can be drawn: all of it finite, and not endless.
inline bool drawable(const Segment &s) {
    float most = 0, sum = 0;
    for (int end = 0; end < 2; ++end) {
        most = std::max({most, std::abs(s.x[end]), std::abs(s.y[end]), s.h[end]});
        sum += s.x[end] + s.y[end] + s.d[end] + s.h[end];
    }
    return most < kOutermost && std::isfinite(sum);
}

/// Pixels of a tile, a bit for each in each row.
struct TilePixels {
    uint32_t row[kTile];

    static TilePixels all() {
        TilePixels pixels;
        std::fill(pixels.row, pixels.row + kTile, (1u << kTile) - 1);
        return pixels;
    }

    /// Whether a segment of half width `reach` [px], with the tile's corner at (left, top), may touch any of them.
    bool touched(const Segment &s, float reach, float left, float top) const {
        const float x0 = s.x[0] - left, y0 = s.y[0] - top, dx = s.x[1] - s.x[0], dy = s.y[1] - s.y[0];
        const float slope = std::abs(dy) > 1e-3f ? 1 / dy : 0;
        const float low = std::max(std::min(y0, y0 + dy) - reach, 0.0f), high = std::min(std::max(y0, y0 + dy) + reach, kTile - 1.0f);
        for (int y = int(low); y <= int(high); ++y) {
            if (!row[y]) continue;
            float from = 0, to = 1; // the part of the segment in the row
            if (slope != 0) {
                const float a = (y - reach - y0) * slope, b = (y + 1 + reach - y0) * slope;
                from = std::max(0.0f, std::min(a, b)), to = std::min(1.0f, std::max(a, b));
                if (from > to) continue;
            }
            const float a = x0 + dx * from, b = x0 + dx * to;
            const int begin = int(std::min(std::max(std::min(a, b) - reach, 0.0f), float(kTile)));
            const int end = int(std::max(std::min(std::max(a, b) + reach, kTile - 1.0f), -1.0f));
            if (begin <= end && (row[y] & ((2u << end) - (1u << begin)))) return true;
        }
        return false;
    }
};

/// Calls visit(tile column, tile row) for the tiles that a segment of half width `reach` [px] touches.
template <class Visit> inline void visit_tiles(const View &view, const Segment &s, float reach, Visit &&visit) {
    constexpr float per_tile = 1.0f / kTile;
    const float dx = s.x[1] - s.x[0], dy = s.y[1] - s.y[0], slope = std::abs(dy) > 1e-6f ? 1 / dy : 0;
    const float top = std::min(s.y[0], s.y[1]) - reach, bottom = std::max(s.y[0], s.y[1]) + reach;
    const float W = view.across() - 1, H = view.down() - 1;
    const float left = std::min(s.x[0], s.x[1]) - reach, right = std::max(s.x[0], s.x[1]) + reach;
    // Compared as numbers: what lies far outside must not wrap when it becomes an integer
    if (!(bottom >= 0 && top < view.H && right >= 0 && left < view.W)) return;
    const int first = int(std::max(std::floor(top * per_tile), 0.0f)), last = int(std::min(std::floor(bottom * per_tile), H));
    for (int row = first; row <= last; ++row) {
        float from = 0, to = 1; // the part of the segment in the row
        if (slope != 0) {
            const float a = (row * kTile - reach - s.y[0]) * slope, b = ((row + 1) * kTile + reach - s.y[0]) * slope;
            from = std::max(0.0f, std::min(a, b)), to = std::min(1.0f, std::max(a, b));
            if (from > to) continue;
        }
        const float a = s.x[0] + dx * from, b = s.x[0] + dx * to;
        const float begin = std::max(std::floor((std::min(a, b) - reach) * per_tile), 0.0f);
        const float end = std::min(std::floor((std::max(a, b) + reach) * per_tile), W);
        for (int column = int(std::min(begin, W + 1)); column <= int(std::max(end, -1.0f)); ++column) visit(column, row);
    }
}

} // namespace ringlet
