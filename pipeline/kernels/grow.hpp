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

/// What strands grow over: the wall, and on a grid for each of several labels the flow of the combing.
struct Terrain {
    const DistanceField *wall;
    std::vector<float> flow; // (labels, 3, nx, ny, nz)
    int labels, n[3];
    double origin[3], spacing, step; // of the grid [m]; arc length [m] of a segment

    /// The flow of each lane's label, trilinear, clamped to the grid's box.
    Vec3<double> flow_at(Vec3<double> x, Mask<double> label) const {
        const Lanes<double> at[3] = {x.x - origin[0], x.y - origin[1], x.z - origin[2]};
        Mask<double> cell[3];
        Lanes<double> part[3];
        for (int k = 0; k < 3; ++k) {
            const Lanes<double> u = at[k] / spacing, last = splat(n[k] - 1.001);
            const Lanes<double> inside = select<double>(u >= 0, minimum<double>(u, last), Lanes<double>{});
            cell[k] = __builtin_convertvector(inside, Mask<double>);
            part[k] = inside - __builtin_convertvector(cell[k], Lanes<double>);
        }
        const int row = n[1] * n[2], volume = n[0] * row;
        const Mask<double> corner = label * (3 * volume) + (cell[0] * n[1] + cell[1]) * n[2] + cell[2];
        Lanes<double> v[3];
        for (int k = 0; k < 3; ++k) {
            const float *values = flow.data() + size_t(k) * volume;
            Lanes<double> y[2];
            for (int i = 0; i < 2; ++i) {
                Lanes<double> a, b, c, d;
                gather_pairs<double>(values + i * row, corner, a, b);
                gather_pairs<double>(values + i * row + n[2], corner, c, d);
                const Lanes<double> low = a + part[2] * (b - a), high = c + part[2] * (d - c);
                y[i] = low + part[1] * (high - low);
            }
            v[k] = y[0] + part[0] * (y[1] - y[0]);
        }
        return {v[0], v[1], v[2]};
    }
};

/// How the strands of a block grow.
struct Growth {
    Lanes<double> height, over, bend, comb; // [m]: of the layer, arc length to reach it, see above
    Vec3<double> sweep;                     // added to the flow
    Lanes<double> length;                   // [m]: what lies beyond goes straight on
};

class Grower {
  public:
    Grower(const Terrain &terrain, const Growth &growth, Mask<double> label) : terrain_(terrain), growth_(growth), label_(label) {
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
        const Vec3<double> combed = direction(tangential(terrain_.flow_at(x, label_), m));
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
    Mask<double> label_;
    Lanes<double> decay_;
    int longest_;
};

} // namespace ringlet
