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

    Vec3<float> flow_at(Vec3<float> x, const Lanes<float> (&standoff)[2]) const {
        const Vec3<float> p = x - broadcast<float>(center);
        Lanes<float> q[3];
        for (int k = 0; k < 3; ++k) q[k] = p.x * float(axes[k][0]) + p.y * float(axes[k][1]) + p.z * float(axes[k][2]);
        const Lanes<float> squares = dot(p, p) + 1e-20f, length = squares * inverse_root<float>(squares);
        // The direction against the whorl has no place in the chart
        const Lanes<float> half = inverse_root<float>(2 * maximum<float>(squares + length * q[2], 1e-6f * squares));
        Mask<float> cell[2];
        Lanes<float> part[2];
        for (int k = 0; k < 2; ++k) {
            const Lanes<float> place = (q[k] * half + standoff[k] + 1) * (0.5f * (n - 1));
            const Lanes<float> inside = place > 0 ? minimum<float>(place, splat(n - 1.001f)) : Lanes<float>{};
            cell[k] = __builtin_convertvector(inside, Mask<float>);
            part[k] = inside - __builtin_convertvector(cell[k], Lanes<float>);
        }
        const Mask<float> node = cell[0] * n + cell[1];
        Vec3<float> flow;
        for (int lane = 0; lane < kLanes<float>; ++lane) {
            const float *corner = grid.data() + 4 * size_t(node[lane]);
            const Quad low = quad(corner) + part[1][lane] * (quad(corner + 4) - quad(corner));
            corner += 4 * n;
            const Quad high = quad(corner) + part[1][lane] * (quad(corner + 4) - quad(corner));
            const Quad v = low + part[0][lane] * (high - low);
            flow.x[lane] = v[0], flow.y[lane] = v[1], flow.z[lane] = v[2];
        }
        return flow;
    }

  private:
    typedef float Quad __attribute__((vector_size(16)));

    static RINGLET_INLINE Quad quad(const float *from) {
        Quad values;
        __builtin_memcpy(&values, from, sizeof values);
        return values;
    }
};

/// How the strands of a block grow.
struct Growth {
    Lanes<float> height, over, bend, comb; // [m]: of the layer, arc length to reach it, see above
    Vec3<float> sweep;                     // added to the flow
    Lanes<float> standoff[2];              // in the chart
    Lanes<float> length;                   // [m]: what lies beyond goes straight on
};

class Grower {
  public:
    Grower(const Terrain &terrain, const Growth &growth) : terrain_(terrain), growth_(growth), step_(float(terrain.step)) {
        for (int lane = 0; lane < kLanes<float>; ++lane) decay_[lane] = std::exp(-step_ / growth.comb[lane]);
        rise_ = 1 / growth.over, hurry_ = 1 / growth.bend, turn_ = minimum<float>(step_ * hurry_, splat(1.0f));
        longest_ = int(std::ceil(largest<float>(growth.length) / step_));
    }

    /// Points x[1 .. K-1] after the root x[0], from the first direction; `noise` is a row of vectors, each of which lasts
    /// `kStretch` steps.
    void grow(Vec3<float> *x, int K, Vec3<float> t, const Vec3<float> *noise) const {
        Lanes<float> fade = decay_;
        Place here{{}, {}, ~Mask<float>{}};
        for (int k = 1; k < K; ++k, fade *= decay_) {
            if (k <= longest_) t = turned(x[k - 1], here, t, k * step_, fade, noise[(k - 1) / kStretch]);
            x[k] = x[k - 1] + splat(step_) * t;
        }
    }

    static constexpr int kStretch = 8;

  private:
    static constexpr float kClearance = 0.8e-3f;      // [m] of the lowest layer
    static constexpr float kJaw = -0.07f, kSink = 0.05f; // [m] height below which layers sink, and over which

    RINGLET_INLINE void wall(Vec3<float> x, Lanes<float> &d, Vec3<float> &m) const {
        sample<float>(*terrain_.wall, x, d, m);
        m = inverse_root<float>(dot(m, m) + 1e-30f) * m;
    }

    static RINGLET_INLINE Vec3<float> tangential(Vec3<float> v, Vec3<float> m) { return v - dot(v, m) * m; }

    /// What is known of the wall at a point: lanes that are `unknown` are still to be looked up.
    struct Place {
        Lanes<float> d;
        Vec3<float> m;
        Mask<float> unknown;
    };

    /// The direction of the step from x that follows direction t; `here` becomes the place where it ends.
    Vec3<float> turned(Vec3<float> x, Place &here, Vec3<float> t, float s, Lanes<float> fade, Vec3<float> noise) const {
        const Lanes<float> none{};
        const Growth &g = growth_;
        if (any<float>(here.unknown)) {
            Lanes<float> d;
            Vec3<float> m;
            wall(x, d, m);
            here.d = here.unknown ? d : here.d, here.m = select(here.unknown, m, here.m);
        }
        const Lanes<float> d = here.d;
        const Vec3<float> m = here.m;
        const Lanes<float> sunk = smoothstep<float>((kJaw - x.y) * (1 / kSink));
        const Lanes<float> layer = kClearance + g.height * smoothstep<float>(s * rise_) * (1 - 0.9f * sunk);
        const Vec3<float> combed = direction(tangential(terrain_.flow_at(x, g.standoff), m));
        const Vec3<float> flow = direction(combed + tangential(g.sweep, m));
        Vec3<float> target = fade * flow + noise;
        target.y -= 1 - fade;
        target = direction(target);
        // No diving below the layer, and out again from too deep
        const Lanes<float> dive = minimum<float>(dot(target, m), none) * smoothstep<float>(1.5f - (d - layer) * (1 / 0.006f));
        const Lanes<float> pull = minimum<float>(maximum<float>((layer - d) * hurry_, none), splat(0.8f));
        target = direction(target + (pull - dive) * m);
        t = direction(t + turn_ * (target - t));
        // Lift what would end too low
        wall(x + splat(step_) * t, here.d, here.m);
        const Lanes<float> lowest = minimum<float>(layer, splat(kClearance + 0.25f * s));
        const Lanes<float> lift = 0.6f * maximum<float>(lowest - here.d, none);
        here.unknown = lift > 0;
        return select(here.unknown, direction(splat(step_) * t + lift * here.m), t);
    }

    const Terrain &terrain_;
    const Growth &growth_;
    float step_;
    Lanes<float> decay_, rise_, hurry_, turn_; // of a step; 1 / over, 1 / bend; part of the turn in a step
    int longest_;
};

} // namespace ringlet
