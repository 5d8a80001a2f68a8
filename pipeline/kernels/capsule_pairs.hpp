// Two soft rods that meet: closest points of segments, and the law of their contact. 16 pairs at a time, in float32.
//
// Notation: a segment is its middle c and half h, its points are c + s h with s in -1 .. 1; n unit vector from the
// second closest point to the first, d their distance, D the distance that is let pass, u relative velocity.
//     f = min(k (D - d) - c_n n.u, c_p (v_p - n.u)) n - g u_t,    f.n >= 0,    g = mu f.n / max(|u_t|, v_0)
// The second branch keeps rods from parting faster than v_p; c_p is such that it never weakens a contact at rest.
// D is one number for two strands: the push is then the gradient of an energy of distances, and hair comes to rest.
// What looks better, counting joints once or blending the contacts of parallel rods, feeds energy in
// (measured: 12 mm/s for ever without friction, instead of 0.05).
// (Closest points: "Real-time collision detection", Ericson 2004, 5.1.9; all cases are selects.)
#pragma once

#include "rod_data.hpp"

namespace ringlet {

RINGLET_INLINE Floats clamp_one(Floats s) { return maximum<float>(minimum<float>(s, splat(1.0f)), splat(-1.0f)); }

/// Where two segments are closest; parallel ones in the middle of where they lie side by side.
struct Closest {
    Floats s, t; // on the first segment and on the second
    Points gap;  // from the second point to the first

    Closest(Points c1, Points h1, Points c2, Points h2) {
        const Points r = c1 - c2;
        const Floats a = dot(h1, h1), e = dot(h2, h2), b = dot(h1, h2), c = dot(h1, r), f = dot(h2, r);
        const Floats per_a = reciprocal<float>(a), per_e = reciprocal<float>(e), den = a * e - b * b;
        const Floats one = (-c - b) * per_a, other = (b - c) * per_a; // ends of the second, on the first
        const Floats beside = 0.5f * (clamp_one(minimum<float>(one, other)) + clamp_one(maximum<float>(one, other)));
        const Floats crossing = clamp_one((b * f - c * e) * reciprocal<float>(maximum<float>(den, 1e-6f * a * e)));
        const Floats first = select<float>(den > kParallel * a * e, crossing, beside);
        t = clamp_one((b * first + f) * per_e);
        s = clamp_one((b * t - c) * per_a);
        gap = r + s * h1 - t * h2;
    }

    static constexpr float kParallel = 1e-4f; // square of the sine
};

/// Parameters of the contact, see above.
struct RodLaw {
    float k, c_n, c_p, v_p, mu, reach, theta_dt; // reach = 2 r

    static constexpr float kSlow = 5e-3f; // [m/s] v_0
};

/// Force on the first rod and the matrix C that softens it: C = normal n n^T + along (1 - n n^T).
struct RodForce {
    Points force, n;
    Floats normal, along;

    RodForce(const RodLaw &law, Points gap, Floats distance, Floats allowed, Points u) {
        const Floats none = splat(0.0f), per_distance = reciprocal<float>(distance);
        n = per_distance * gap;
        const Floats parting = dot(n, u), spring = law.k * (allowed - distance) - law.c_n * parting;
        const Floats slow = law.c_p * (law.v_p - parting);
        const Floats push = maximum<float>(minimum<float>(spring, slow), none);
        const Points sliding = u - parting * n;
        const Floats speed = square_root<float>(dot(sliding, sliding));
        const Mask<float> touching = (allowed > distance) & (push > none);
        const Floats grip = law.mu * push * reciprocal<float>(maximum<float>(speed, splat(RodLaw::kSlow)));
        force = select(touching, push * n - grip * sliding, Points{});
        // The slope of the law, or of its chord to where the push ends: rods do not shoot out of each other in a step.
        // Twice the own part of the exact matrix: stable though the other rod's motion is not known to the solve.
        const Floats left = maximum<float>(law.v_p - parting, splat(1e-3f * law.v_p));
        const Floats slope = maximum<float>(splat(law.k * law.theta_dt + law.c_n), push * reciprocal<float>(left));
        normal = select<float>(touching, 2 * slope, none);
        along = select<float>(touching, 2 * grip, none);
    }
};

} // namespace ringlet
