// Strands as tubes: corners around every point, and the triangles that face the eye; a lane per strand.
//
// The tubes are those of VTK's tube filter: a polygon of K corners around each point, across the mean direction of both
// segments, which turns from point to point by no more than the strand does (its frame slides along). A tube is closed,
// so that an eye outside sees only the sides that face it: those behind them are left out, half of all triangles. Of a
// tube narrower than a sample of the picture no more is seen than its outline, one pair of triangles a segment; that
// covers the same samples, at most a radius farther away.
//
// Notation: x points, t unit direction of a segment, c their unit mean at a point, n the frame's normal, q unit axis
// about which a strand turns at a point, r radius, K corners.
#pragma once

#include "block.hpp"

#include <cstring>
#include <vector>

namespace ringlet {

struct TubeStrands {
    const float *points;  // (S, P, 3) [m]
    const float *widths;  // (S, P) [m]
    const uint8_t *drawn; // (S, P-1): the other segments have no sides
    int S, P;
};

struct TubeView {
    const double *eye; // (3,) [m]
    double fine;       // [rad] a tube that is narrower as seen from the eye is drawn as its outline
};

using Triangles = std::vector<int32_t>;

class Tubes {
    using Real = double;
    using Lane = Lanes<double>;
    using Point = Vec3<double>;

  public:
    static constexpr int kStrands = kLanes<double>;
    static constexpr int kMostSides = 32;

    Tubes(const TubeStrands &strands, int sides, const TubeView &view)
        : strands_(strands), K_(sides), eye_(broadcast<double>(view.eye)), fine_(view.fine) {
        for (int k = 0; k < K_; ++k) {
            cosine_[k] = std::cos(2 * M_PI * k / K_);
            sine_[k] = std::sin(2 * M_PI * k / K_);
        }
    }

    /// Corners (S, P, K, 3) of the strands from `first` on, a block of them, and the triangles of each.
    void block(int first, float *corners, Triangles *triangles) const {
        const int P = strands_.P;
        std::vector<Point> ring(2 * size_t(K_));
        Point x = point(first, 0), t = direction(first, 0), n = first_normal(first);
        for (int j = 0; j < P; ++j) {
            const Point before = t;
            if (j + 1 < P) t = unit_or(point(first, j + 1) - x, before);
            if (j > 0) n = slide(n, before, t);
            Point *here = ring.data() + (j & 1) * K_, *last = ring.data() + (~j & 1) * K_;
            around(x, unit_or(before + t, t), n, radius(first, j), here);
            store(first, j, here, corners);
            if (j == 0) cap(first, j, here, -1, triangles);
            else sides(first, j - 1, last, here, triangles);
            if (j + 1 < P) x = point(first, j + 1);
            else cap(first, j, here, 1, triangles);
        }
    }

  private:
    const TubeStrands strands_;
    const int K_;
    const Point eye_;
    const Real fine_;
    Real cosine_[kMostSides], sine_[kMostSides];

    int next(int k) const { return k + 1 < K_ ? k + 1 : 0; }
    int strand(int first, int lane) const { return std::min(first + lane, strands_.S - 1); }

    Point point(int first, int j) const {
        Point x;
        for (int lane = 0; lane < kStrands; ++lane) {
            const float *from = strands_.points + 3 * (size_t(strand(first, lane)) * strands_.P + j);
            x.x[lane] = from[0], x.y[lane] = from[1], x.z[lane] = from[2];
        }
        return x;
    }

    Lane radius(int first, int j) const {
        Lane r;
        for (int lane = 0; lane < kStrands; ++lane) r[lane] = 0.5 * strands_.widths[size_t(strand(first, lane)) * strands_.P + j];
        return r;
    }

    /// The unit vector along v; `other` where v has no direction.
    static Point unit_or(const Point &v, const Point &other) {
        const Lane length = square_root<Real>(dot(v, v));
        const Mask<Real> is = length > 1e-20;
        return select(is, (1 / (is ? length : splat(1.0))) * v, other);
    }

    /// Of the first segment that has one.
    Point direction(int first, int j) const {
        Point t{};
        for (int i = strands_.P - 2; i >= j; --i) t = unit_or(point(first, i + 1) - point(first, i), t);
        return t;
    }

    /// Across the first segment and the first one that is not parallel to it; anything across where all are.
    Point first_normal(int first) const {
        constexpr Real kParallel = 1e-3;
        const Point t = direction(first, 0);
        const Lane zero{}, one = splat(1.0);
        const auto over = [](Lane a, Lane b) { return -a / (b != 0.0 ? b : splat(1.0)); };
        Point n = select(t.x != 0.0, Point{over(t.y, t.x), one, zero},
                         select(t.y != 0.0, Point{zero, over(t.z, t.y), one}, Point{one, zero, over(t.x, t.z)}));
        for (int j = strands_.P - 2; j > 0; --j) {
            const Point across = cross(t, unit_or(point(first, j + 1) - point(first, j), t));
            n = select(dot(across, across) > kParallel * kParallel, across, n);
        }
        return unit_or(n, n);
    }

    /// The normal where a strand turns from one direction to another: it keeps its part along the axis of the turn.
    static Point slide(const Point &n, const Point &before, const Point &after) {
        constexpr Real kTurn = 1e-9; // less is rounding
        const Point axis = cross(after, before), none{};
        const Point q = unit_or(axis, none), c = unit_or(before + after, none);
        const Lane along = dot(q, n), left = maximum<Real>(1 - along * along, Lane{});
        const Point w = cross(c, q), old = cross(before, q);
        const Lane size = square_root<Real>(left);
        const Lane across = dot(n, old) * dot(w, old) < 0.0 ? -size : size;
        return select(dot(axis, axis) > kTurn * kTurn, along * q + across * w, n);
    }

    /// The corners of a point.
    void around(const Point &x, const Point &c, const Point &n, Lane r, Point *ring) const {
        const Point w = unit_or(cross(c, n), Point{}), v = unit_or(cross(w, c), Point{});
        for (int k = 0; k < K_; ++k) ring[k] = x + (r * cosine_[k]) * w + (r * sine_[k]) * v;
    }

    void store(int first, int j, const Point *ring, float *corners) const {
        for (int lane = 0; lane < kStrands && first + lane < strands_.S; ++lane) {
            float *to = corners + (size_t(first + lane) * strands_.P + j) * K_ * 3;
            for (int k = 0; k < K_; ++k, to += 3) {
                to[0] = float(ring[k].x[lane]), to[1] = float(ring[k].y[lane]), to[2] = float(ring[k].z[lane]);
            }
        }
    }

    /// Which lanes see the triangle a, b, c from the side where it runs against the clock.
    uint32_t facing(const Point &a, const Point &b, const Point &c) const {
        return set_lanes<Real>(dot(cross(b - a, c - a), eye_ - a) > 0.0);
    }

    /// Lanes whose segment j is drawn, of strands that are not repeated.
    uint32_t drawn(int first, int j) const {
        uint32_t lanes = 0;
        for (int lane = 0; lane < kStrands && first + lane < strands_.S; ++lane)
            lanes |= uint32_t(strands_.drawn[size_t(first + lane) * (strands_.P - 1) + j] != 0) << lane;
        return lanes;
    }

    /// Adds a triangle of every lane: corners as they are counted from the first one of point j of a lane's strand.
    void add(int first, int j, uint32_t lanes, int a, int b, int c, Triangles *triangles) const {
        for (; lanes; lanes &= lanes - 1) {
            const int lane = __builtin_ctz(lanes), from = ((first + lane) * strands_.P + j) * K_;
            triangles[lane].insert(triangles[lane].end(), {from + a, from + b, from + c});
        }
    }

    /// The sides of segment j that face the eye, or the outline of a fine one.
    void sides(int first, int j, const Point *a, const Point *b, Triangles *triangles) const {
        uint32_t lanes = drawn(first, j);
        if (!lanes) return;
        lanes = outlines(first, j, lanes, a, b, triangles);
        for (int k = 0; lanes && k < K_; ++k) {
            const int l = next(k);
            add(first, j, lanes & facing(a[k], b[k], a[l]), k, K_ + k, l, triangles);
            add(first, j, lanes & facing(a[l], b[k], b[l]), l, K_ + k, K_ + l, triangles);
        }
    }

    /// Adds the outline of segment j to those lanes where it is fine and has one, and gives the other lanes.
    uint32_t outlines(int first, int j, uint32_t lanes, const Point *a, const Point *b, Triangles *triangles) const {
        uint32_t fine = lanes & this->fine(first, j, a[0], b[0]);
        if (!fine) return lanes;
        uint32_t sides[kStrands] = {};
        for (int k = 0; k < K_; ++k) {
            const Point across = cross(b[next(k)] - a[k], a[next(k)] - b[k]); // of both triangles
            const uint32_t faces = set_lanes<Real>(dot(across, eye_ - a[k]) > 0.0);
            for (int lane = 0; lane < kStrands; ++lane) sides[lane] |= (faces >> lane & 1) << k;
        }
        for (; fine; fine &= fine - 1) {
            const int lane = __builtin_ctz(fine);
            const uint32_t facing = sides[lane], begins = facing & ~(facing << 1 | facing >> (K_ - 1));
            if (__builtin_popcount(begins) != 1) continue; // seen along itself
            const int from = __builtin_ctz(begins), to = (from + __builtin_popcount(facing)) % K_;
            add(first, j, 1u << lane, from, K_ + from, to, triangles);
            add(first, j, 1u << lane, to, K_ + from, K_ + to, triangles);
            lanes &= ~(1u << lane);
        }
        return lanes;
    }

    /// Lanes whose segment j is narrower than what a sample of the picture shows.
    uint32_t fine(int first, int j, const Point &a, const Point &b) const {
        const auto narrow = [&](int at, const Point &corner) {
            const Point way = eye_ - corner;
            return 2 * radius(first, at) < fine_ * square_root<Real>(dot(way, way));
        };
        return set_lanes<Real>(narrow(j, a) & narrow(j + 1, b));
    }

    /// The end of a strand, seen against its direction (-1) or along it (1), where its segment is drawn.
    void cap(int first, int j, const Point *ring, int side, Triangles *triangles) const {
        const uint32_t lanes = drawn(first, j > 0 ? j - 1 : 0);
        for (int k = 2; lanes && k < K_; ++k) {
            const int l = side > 0 ? k : k - 1, m = side > 0 ? k - 1 : k; // corners run with the clock about the direction
            add(first, j, lanes & facing(ring[0], ring[l], ring[m]), 0, l, m, triangles);
        }
    }
};

/// Corners (S, P, K, 3) of all strands, and their triangles, three corners each, strand by strand.
inline Triangles make_tubes(const TubeStrands &strands, int sides, const TubeView &view, float *corners, int threads) {
    const Tubes tubes(strands, sides, view);
    const int blocks = (strands.S + Tubes::kStrands - 1) / Tubes::kStrands;
    std::vector<Triangles> own(size_t(blocks) * Tubes::kStrands);
#pragma omp parallel for schedule(dynamic, 16) num_threads(threads)
    for (int i = 0; i < blocks; ++i) tubes.block(i * Tubes::kStrands, corners, own.data() + i * Tubes::kStrands);
    size_t count = 0;
    for (const Triangles &part : own) count += part.size();
    Triangles triangles;
    triangles.reserve(count);
    for (const Triangles &part : own) triangles.insert(triangles.end(), part.begin(), part.end());
    return triangles;
}

} // namespace ringlet
