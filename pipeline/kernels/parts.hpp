// Signed distance to a shape of joined parts: ellipsoids, tubes and groups of them; a lane per point.
//
// Ellipsoid: k0 (k0 - 1) / k1 with k0 = |q/r|, k1 = |q/r^2|. Tube: nearest sample of its curve, then one Newton step on
// (c - p) . c' = 0. Smooth minimum: min(a, b) - k h^3 / 6 with h = max(k - |a - b|, 0) / k (Quilez, "Smooth minimum",
// 2013, cubic). Notation: p point, d distance so far, b distance to a part, k blend [m].
#pragma once

#include "simd.hpp"

#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

namespace ringlet {

enum class Join { add, cut, clip };

/// A sample of a tube: parameter, and the curve (x, y, z, radius) with its first two derivatives there.
struct TubeSample {
    double t, c[4], v[4], a[4];
};

class Shape {
  public:
    struct Part {
        Join join;
        double blend;
        double low[3], high[3]; // box that it lies in
        double center[3], turn[3][3], radii[3];
        std::vector<TubeSample> tube;      // a tube, or
        std::shared_ptr<const Shape> group; // a group, or else an ellipsoid
    };

    void add(Part part) { parts_.push_back(std::move(part)); }

    /// Distances of points, valid only within `reach` [m] of the surface: parts farther away are skipped.
    Lanes<double> distance(Vec3<double> p, double reach) const {
        Lanes<double> d = splat(1.0);
        for (size_t i = 0; i < parts_.size(); ++i) {
            double widest = 0;
            for (size_t j = i; j < parts_.size(); ++j) widest = parts_[j].blend > widest ? parts_[j].blend : widest;
            const Part &part = parts_[i];
            const Mask<double> near = inside(part, p, reach + widest);
            if (any<double>(near)) d = select<double>(near, joined(d, to(part, p), part), d);
        }
        return d;
    }

  private:
    static RINGLET_INLINE Lanes<double> size(Lanes<double> x, Lanes<double> y, Lanes<double> z) {
        return square_root<double>(x * x + y * y + z * z);
    }

    static Mask<double> inside(const Part &part, Vec3<double> p, double margin) {
        Mask<double> all = ~Mask<double>{};
        if (part.join == Join::clip || margin == std::numeric_limits<double>::infinity()) return all;
        const Lanes<double> x[3] = {p.x, p.y, p.z};
        for (int k = 0; k < 3; ++k) all &= (x[k] > part.low[k] - margin) & (x[k] < part.high[k] + margin);
        return all;
    }

    static Lanes<double> to(const Part &part, Vec3<double> p) {
        if (!part.tube.empty()) return to_tube(part.tube, p);
        const Vec3<double> e = p - broadcast<double>(part.center);
        Lanes<double> q[3];
        for (int k = 0; k < 3; ++k) q[k] = e.x * part.turn[0][k] + e.y * part.turn[1][k] + e.z * part.turn[2][k];
        if (part.group) return part.group->distance({q[0], q[1], q[2]}, std::numeric_limits<double>::infinity());
        for (int k = 0; k < 3; ++k) q[k] /= part.radii[k];
        const Lanes<double> k0 = size(q[0], q[1], q[2]) + 1e-9;
        return k0 * (k0 - 1) / (size(q[0] / part.radii[0], q[1] / part.radii[1], q[2] / part.radii[2]) + 1e-9);
    }

    static Lanes<double> to_tube(const std::vector<TubeSample> &tube, Vec3<double> p) {
        Lanes<double> least = splat(std::numeric_limits<double>::infinity());
        Mask<double> nearest{};
        for (size_t i = 0; i < tube.size(); ++i) {
            const double *c = tube[i].c;
            const Lanes<double> x = p.x - c[0], y = p.y - c[1], z = p.z - c[2], square = x * x + y * y + z * z;
            const Mask<double> nearer = square < least;
            least = select<double>(nearer, square, least);
            nearest = nearer ? Mask<double>{} + int64_t(i) : nearest;
        }
        Lanes<double> t, c[4], v[4], a[4];
        for (int lane = 0; lane < kLanes<double>; ++lane) {
            const TubeSample &sample = tube[size_t(nearest[lane])];
            t[lane] = sample.t;
            for (int k = 0; k < 4; ++k) c[k][lane] = sample.c[k], v[k][lane] = sample.v[k], a[k][lane] = sample.a[k];
        }
        const Vec3<double> e = Vec3<double>{c[0], c[1], c[2]} - p, speed{v[0], v[1], v[2]};
        const Lanes<double> vv = dot(speed, speed), ea = dot(e, Vec3<double>{a[0], a[1], a[2]});
        Lanes<double> s = -dot(e, speed) / maximum<double>(vv + ea, 0.3 * vv);
        s = minimum<double>(maximum<double>(s, tube.front().t - t), tube.back().t - t);
        for (int k = 0; k < 4; ++k) c[k] += s * (v[k] + (0.5 * s) * a[k]);
        return size(p.x - c[0], p.y - c[1], p.z - c[2]) - c[3];
    }

    static Lanes<double> smooth_minimum(Lanes<double> a, Lanes<double> b, double k) {
        if (k <= 0) return minimum<double>(a, b);
        const Lanes<double> apart = a - b, h = maximum<double>(k - (apart < 0 ? -apart : apart), Lanes<double>{}) / k;
        return minimum<double>(a, b) - (k / 6) * (h * h * h);
    }

    static Lanes<double> joined(Lanes<double> d, Lanes<double> b, const Part &part) {
        switch (part.join) {
        case Join::add: return smooth_minimum(d, b, part.blend);
        case Join::cut: return -smooth_minimum(-d, b, part.blend);
        default: return -smooth_minimum(-d, -b, part.blend);
        }
    }

    std::vector<Part> parts_;
};

} // namespace ringlet
