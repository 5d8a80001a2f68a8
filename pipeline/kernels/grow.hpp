// Strands grown over the head by integrating a direction field; a lane per strand.
//
// A strand turns, over the length `bend`, from its first direction towards a target that passes from the combed flow in
// the tangent plane to gravity over the length `comb`. The part of the target that dives below the strand's layer is
// removed. Layers rise over `over` to a height of the strand's own, so that hair has volume, and sink below the jaw.
// Notation: x point, t unit direction, s arc length, d distance to the wall, m its normal.
#pragma once

#include "block.hpp"
#include "coil.hpp"
#include "distance_field.hpp"

#include <cmath>
#include <vector>

namespace ringlet {

/// What strands grow over: the wall, and the flow of the combing on a grid over the scalp's chart.
///
/// Chart: Lambert's equal-area projection, (u, v) = (q1, q2) / sqrt(2 (1 + q3)) of the direction q from the centre in
/// axes e1, e2, w; a strand looks the flow up at its chart point plus a standoff of its own. Node i, j of the grid is
/// chart point -1 + 2 (i, j) / (n - 1).
struct Terrain {
    const DistanceField *wall;
    double center[3], axes[3][3];
    std::vector<float> grid; // (n, n, 4), the first three of four numbers a vector
    int n;
    double step; // arc length [m] of a segment

    Vec3<double> flow_at(Vec3<double> x, const Lanes<double> (&standoff)[2]) const {
        const Vec3<double> p = x - broadcast<double>(center);
        Lanes<double> q[3];
        for (int k = 0; k < 3; ++k) q[k] = p.x * axes[k][0] + p.y * axes[k][1] + p.z * axes[k][2];
        const Lanes<double> squares = dot(p, p), length = square_root<double>(squares);
        // The direction against the whorl has no place in the chart
        const Lanes<double> half = inverse_root<double>(2 * maximum<double>(squares + length * q[2], 1e-12 * squares + 1e-300));
        Mask<double> cell[2];
        Lanes<double> part[2];
        for (int k = 0; k < 2; ++k) {
            const Lanes<double> place = (q[k] * half + standoff[k] + 1) * (0.5 * (n - 1));
            const Lanes<double> inside = place > 0 ? minimum<double>(place, splat(n - 1 - 1e-9)) : Lanes<double>{};
            cell[k] = __builtin_convertvector(inside, Mask<double>);
            part[k] = inside - __builtin_convertvector(cell[k], Lanes<double>);
        }
        const Mask<double> node = cell[0] * n + cell[1];
        Vec3<double> flow;
        for (int lane = 0; lane < kLanes<double>; ++lane) {
            const float *corner = grid.data() + 4 * node[lane];
            const Quad low = quad(corner) + part[1][lane] * (quad(corner + 4) - quad(corner));
            corner += 4 * n;
            const Quad high = quad(corner) + part[1][lane] * (quad(corner + 4) - quad(corner));
            const Quad v = low + part[0][lane] * (high - low);
            flow.x[lane] = v[0], flow.y[lane] = v[1], flow.z[lane] = v[2];
        }
        return flow;
    }

  private:
    typedef double Quad __attribute__((vector_size(32)));
    typedef float FloatQuad __attribute__((vector_size(16)));

    static RINGLET_INLINE Quad quad(const float *from) {
        FloatQuad values;
        __builtin_memcpy(&values, from, sizeof values);
        return __builtin_convertvector(values, Quad);
    }
};

/// How the strands of a block grow.
struct Growth {
    Lanes<double> height, over, bend, comb; // [m]: of the layer, arc length to reach it, see above
    Vec3<double> sweep;                     // added to the flow
    Lanes<double> standoff[2];              // in the chart
    Lanes<double> length;                   // [m]: what lies beyond goes straight on
};

class Grower {
  public:
    Grower(const Terrain &terrain, const Growth &growth) : terrain_(terrain), growth_(growth) {
        for (int lane = 0; lane < kLanes<double>; ++lane) decay_[lane] = std::exp(-terrain.step / growth.comb[lane]);
        longest_ = int(std::ceil(largest<double>(growth.length) / terrain.step));
    }

    /// Points x[1 .. K-1] after the root x[0], from the first direction; `noise` is a row of vectors, each of which lasts
    /// `kStretch` steps.
    void grow(Vec3<double> *x, int K, Vec3<double> t, const Vec3<double> *noise) const {
        Lanes<double> fade = decay_;
        for (int k = 1; k < K; ++k, fade *= decay_) {
            if (k <= longest_) t = turned(x[k - 1], t, k * terrain_.step, fade, noise[(k - 1) / kStretch]);
            x[k] = x[k - 1] + splat(terrain_.step) * t;
        }
    }

    static constexpr int kStretch = 8;

  private:
    static constexpr double kClearance = 0.8e-3;       // [m] of the lowest layer
    static constexpr double kJaw = -0.07, kSink = 0.05; // [m] height below which layers sink, and over which

    RINGLET_INLINE void wall(Vec3<double> x, Lanes<double> &d, Vec3<double> &m) const {
        sample<double>(*terrain_.wall, x, d, m);
        m = inverse_root<double>(dot(m, m) + 1e-300) * m;
    }

    static RINGLET_INLINE Vec3<double> tangential(Vec3<double> v, Vec3<double> m) { return v - dot(v, m) * m; }

    /// The direction of the step from x that follows direction t.
    Vec3<double> turned(Vec3<double> x, Vec3<double> t, double s, Lanes<double> fade, Vec3<double> noise) const {
        const Lanes<double> none{};
        const Growth &g = growth_;
        Lanes<double> d, ahead;
        Vec3<double> m, n;
        wall(x, d, m);
        const Lanes<double> sunk = smoothstep((kJaw - x.y) / kSink);
        const Lanes<double> layer = kClearance + g.height * smoothstep(s / g.over) * (1 - 0.9 * sunk);
        const Vec3<double> combed = direction(tangential(terrain_.flow_at(x, g.standoff), m));
        const Vec3<double> flow = direction(combed + tangential(g.sweep, m));
        Vec3<double> target = fade * flow + noise;
        target.y -= 1 - fade;
        target = direction(target);
        // No diving below the layer, and out again from too deep
        const Lanes<double> dive = minimum<double>(dot(target, m), none) * smoothstep(1.5 - (d - layer) / 0.006);
        const Lanes<double> pull = minimum<double>(maximum<double>((layer - d) / g.bend, none), splat(0.8));
        target = direction(target + (pull - dive) * m);
        t = direction(t + minimum<double>(terrain_.step / g.bend, splat(1.0)) * (target - t));
        // Lift what would end too low
        wall(x + splat(terrain_.step) * t, ahead, n);
        const Lanes<double> lowest = minimum<double>(layer, splat(kClearance + 0.25 * s));
        const Lanes<double> lift = 0.6 * maximum<double>(lowest - ahead, none);
        return direction(splat(terrain_.step) * t + lift * n);
    }

    const Terrain &terrain_;
    const Growth &growth_;
    Lanes<double> decay_;
    int longest_;
};

} // namespace ringlet
