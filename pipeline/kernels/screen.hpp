// Strands on the screen: perspective, clipping at the near plane, tiles.
//
// Notation: x, y [px] from the top left corner of the picture, y downwards, pixel centres at +0.5; d depth, 0 at the
// near plane and 1 at the far one, as OpenGL keeps it (linear along a segment on the screen); h half width [px].
// A clip-space point c = M (x, y, z, 1) lies at x = (c.x / c.w + 1) W / 2, y = (1 - c.y / c.w) H / 2,
// d = (c.z / c.w + 1) / 2, and a radius r there is h = scale r / c.w wide.
#pragma once

#include "elementary.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace ringlet {

inline constexpr int kTile = 16;          // [px] side of a tile
inline constexpr int kSide = 4;           // tiles along a side of a block: one lane for each tile
inline constexpr float kOutermost = 1e6f; // [px] a segment that reaches farther is not drawn: its direction is rounding

inline constexpr float kShortest = 1e-4f;  // [px] a shorter segment is not drawn: it has no direction
inline constexpr float kReach = 0.3f;     // [px] beyond its half width that a segment covers cells of pixels

/// The camera of a picture.
struct View {
    float M[4][4];     // world [m] to clip space
    int W, H;          // [px]
    float scale;       // [px]: half width of a unit radius at unit distance
    float near, far;   // [m] of the clipping planes

    // Tiles of a block follow one another, row by row; those outside the picture have numbers too
    int across() const { return (W + kSide * kTile - 1) / (kSide * kTile); } // blocks
    int down() const { return (H + kSide * kTile - 1) / (kSide * kTile); }
    int tiles() const { return across() * down() * kSide * kSide; }
    int tile(int column, int row) const {
        return ((row / kSide * across() + column / kSide) * kSide + row % kSide) * kSide + column % kSide;
    }
    int left(int tile) const { return (tile / (kSide * kSide) % across() * kSide + tile % kSide) * kTile; } // [px]
    int top(int tile) const { return (tile / (kSide * kSide) / across() * kSide + tile / kSide % kSide) * kTile; }

    /// Depth of what is `distance` [m] away along the line of sight.
    float depth(float distance) const { return far / (far - near) * (1 - near / distance); }

    /// How much depth grows by a step of distance [m] from a depth on, to first order.
    float deeper(float depth, float step) const {
        const float inverse = (far - depth * (far - near)) / (near * far); // of the distance there
        return step * near * far / (far - near) * inverse * inverse;
    }
};

/// 16 points (x, y, z) in a row.
RINGLET_INLINE Vec3<float> read_points(const float *from) {
    Floats v[3];
    std::memcpy(v, from, sizeof v);
    const Floats x = __builtin_shufflevector(v[0], v[1], 0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, 0, 0, 0, 0, 0);
    const Floats y = __builtin_shufflevector(v[0], v[1], 1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 31, 0, 0, 0, 0, 0);
    const Floats z = __builtin_shufflevector(v[0], v[1], 2, 5, 8, 11, 14, 17, 20, 23, 26, 29, 0, 0, 0, 0, 0, 0);
    return {__builtin_shufflevector(x, v[2], 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 17, 20, 23, 26, 29),
            __builtin_shufflevector(y, v[2], 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 18, 21, 24, 27, 30),
            __builtin_shufflevector(z, v[2], 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 31)};
}

/// A strand in clip space, and what follows from it where it is in front of the near plane. Arrays are longer than the
/// strand by at least one and at most 16 lanes, so that no loop ends with points one by one.
struct ScreenStrand {
    static constexpr int kStep = kLanes<float>;

    std::vector<float> cx, cy, cw, x, y, d, h;

    explicit ScreenStrand(int P) {
        for (auto *array : {&cx, &cy, &cw, &x, &y, &d, &h}) array->resize((P / kStep + 1) * kStep + 1);
    }

    /// Projects points (P, 3) [m] of widths (P,) [m]; whether all are finite and in front of the near plane.
    bool project(const View &v, const float *points, const float *widths, int P) {
        Mask<float> whole = ~Mask<float>{};
        for (int j = 0; j < P; j += kStep) {
            Floats wide;
            if (P - j >= kStep) {
                std::memcpy(&wide, widths + j, sizeof wide);
                whole &= project(v, read_points(points + 3 * j), wide, j);
                continue;
            }
            float last[3 * kStep], last_wide[kStep];
            for (int k = 0; k < kStep; ++k) {
                const int from = std::min(j + k, P - 1);
                std::copy(points + 3 * from, points + 3 * from + 3, last + 3 * k), last_wide[k] = widths[from];
            }
            std::memcpy(&wide, last_wide, sizeof wide);
            whole &= project(v, read_points(last), wide, j);
        }
        return !any<float>(~whole);
    }

  private:
    RINGLET_INLINE Mask<float> project(const View &v, const Vec3<float> &p, Floats wide, int j) {
        const Floats X = v.M[0][0] * p.x + v.M[0][1] * p.y + v.M[0][2] * p.z + v.M[0][3];
        const Floats Y = v.M[1][0] * p.x + v.M[1][1] * p.y + v.M[1][2] * p.z + v.M[1][3];
        const Floats w = v.M[3][0] * p.x + v.M[3][1] * p.y + v.M[3][2] * p.z + v.M[3][3], inverse = 1 / w;
        const Floats sx = (X * inverse + 1) * (0.5f * v.W), sy = (1 - Y * inverse) * (0.5f * v.H), sh = 0.5f * v.scale * wide * inverse;
        const Floats depth = maximum<float>(v.far / (v.far - v.near) * (1 - v.near * inverse), splat(0.0f));
        for (const auto &[to, value] : {std::pair(&cx, X), {&cy, Y}, {&cw, w}, {&x, sx}, {&y, sy}, {&d, depth}, {&h, sh}})
            std::memcpy(to->data() + j, &value, sizeof value);
        return (w >= v.near) & (0 * (sx + sy + sh) == 0); // false, too, where something is not finite
    }
};

/// A point as tiles need it.
struct ScreenPoint {
    float x, y, d;
    float h; // negative where the strand ends

    void end() { h = -h; }
};

/// How far apart two points are on the screen [px].
RINGLET_INLINE float distance(const ScreenPoint &a, const ScreenPoint &b) {
    const float dx = b.x - a.x, dy = b.y - a.y;
    return std::sqrt(dx * dx + dy * dy);
}

/// The part of segment j of a strand of P points that is in front of the near plane, where the strand ends. False where nothing is.
inline bool clipped(const View &view, const ScreenStrand &s, const float *widths, int P, int j, ScreenPoint to[2]) {
    const float w0 = s.cw[j], w1 = s.cw[j + 1];
    if (!(w0 >= view.near || w1 >= view.near)) return false;
    const float t[2] = {w0 < view.near ? (view.near - w0) / (w1 - w0) : 0, w1 < view.near ? (view.near - w0) / (w1 - w0) : 1};
    const float slope = view.far / (view.far - view.near);
    for (int end = 0; end < 2; ++end) {
        const auto between = [&](float a, float b) { return t[end] == 0 ? a : t[end] == 1 ? b : a + t[end] * (b - a); };
        const float w = std::max(between(w0, w1), view.near), inverse = 1 / w;
        to[end].x = (between(s.cx[j], s.cx[j + 1]) * inverse + 1) * (0.5f * view.W);
        to[end].y = (1 - between(s.cy[j], s.cy[j + 1]) * inverse) * (0.5f * view.H);
        to[end].d = std::max(slope * (1 - view.near * inverse), 0.0f);
        to[end].h = 0.5f * view.scale * between(widths[j], widths[j + 1]) * inverse;
        const bool last = end == 0 ? j == 0 : j + 2 == P;
        if (t[end] != float(end) || last) to[end].end();
    }
    return true;
}

/// Linear RGB and depth.
typedef float Shown __attribute__((vector_size(16)));

/// Which ends of a segment are the strand's, too.
enum Ends : uint32_t { kJoints = 0, kFirst = 1, kLast = 2 };

/// A segment on the screen; depth, half width and colour are linear along it.
struct alignas(64) Segment {
    float x, y;        // where it begins
    float ux, uy;      // unit direction
    float inverse;     // [1/px] of its length
    uint32_t ends;     // of Ends
    float h, dh;       // half width at the beginning, and what it gains up to the end
    Shown shown, gain; // the same of colour and depth

    Segment() = default;

    Segment(const ScreenPoint &a, const ScreenPoint &b)
        : x(a.x), y(a.y), ends((a.h < 0 ? kFirst : kJoints) | (b.h < 0 ? kLast : kJoints)), h(std::abs(a.h)), dh(std::abs(b.h) - std::abs(a.h)),
          shown{0, 0, 0, a.d}, gain{0, 0, 0, b.d - a.d} {
        const float dx = b.x - a.x, dy = b.y - a.y;
        inverse = 1 / distance(a, b);
        ux = dx * inverse, uy = dy * inverse;
    }

    float length() const { return 1 / inverse; } // [px]
    float d() const { return shown[3]; }
    float dd() const { return gain[3]; }

    /// Whether it can be drawn: all of it finite, and neither endless nor a point. `length` [px] is its own.
    bool drawable(float length) const {
        const float most = std::max({std::abs(x), std::abs(y), std::abs(x + ux * length), std::abs(y + uy * length), h, h + dh});
        return most < kOutermost && length >= kShortest && std::isfinite(x + y + d() + dd() + h + dh + length);
    }

    /// Half width [px] at most, with the cells that it covers beyond.
    float reach() const { return kReach + std::max(h, h + dh); }
};

} // namespace ringlet
