// Shapes given to strands: a helix about each, sines across it, and a turn that stays; a lane per strand.
//
// A helix is an offset amplitude (cos U + minor sin V) in frames of least rotation (double reflection: Wang, Juettler,
// Zheng and Liu, "Computation of Rotation Minimizing Frames", 2008). Notation: x points, t unit tangent, U, V unit
// normals, s arc length [m].
#pragma once

#include "block.hpp"
#include "elementary64.hpp"

namespace ringlet {

/// 0 below 0, 1 above 1, cubic between.
template <class Real> RINGLET_INLINE Lanes<Real> smoothstep(Lanes<Real> t) {
    t = minimum<Real>(maximum<Real>(t, Lanes<Real>{}), splat(Real(1)));
    return t * t * (3 - 2 * t);
}

RINGLET_INLINE Vec3<double> mirrored(Vec3<double> v, Vec3<double> normal) {
    const Lanes<double> scale = 2 * dot(normal, v) / maximum<double>(dot(normal, normal), splat(1e-20));
    return v - scale * normal;
}

/// The unit vector along v; 0 of 0.
template <class Real> RINGLET_INLINE Vec3<Real> direction(Vec3<Real> v) {
    return inverse_root<Real>(maximum<Real>(dot(v, v), splat(Real(1e-24)))) * v;
}

/// Tangent at point j of P: central differences, one-sided at the ends.
RINGLET_INLINE Vec3<double> tangent(const Vec3<double> *x, int j, int P) {
    return direction(x[j + 1 < P ? j + 1 : j] - x[j > 0 ? j - 1 : j]);
}

struct Coil {
    Lanes<double> radius, pitch, phase, minor, onset, ramp; // [m], [m], [turns], -1 .. 1, [m], [m]
};

/// Points moved to a helix about the strand, the first frame's U towards `reference`.
inline void wind(const Vec3<double> *x, int P, Vec3<double> reference, Lanes<double> length, const Coil &coil, Vec3<double> *out) {
    const Lanes<double> step = length / double(P - 1);
    Vec3<double> t = tangent(x, 0, P), u = direction(reference - dot(reference, t) * t);
    for (int j = 0; j < P; ++j) {
        const Lanes<double> s = step * double(j);
        const SineCosine turn = of_turns(coil.phase + s / coil.pitch);
        const Lanes<double> amplitude = coil.radius * smoothstep<double>((s - coil.onset) / coil.ramp);
        out[j] = x[j] + (amplitude * turn.cosine) * u + (amplitude * coil.minor * turn.sine) * cross(t, u);
        if (j + 1 == P) break;
        const Vec3<double> chord = x[j + 1] - x[j], next = tangent(x, j + 1, P);
        u = mirrored(mirrored(u, chord), next - mirrored(t, chord));
        t = next;
    }
}

struct Sine {
    Lanes<double> period, phase; // [m], [turns]
    Vec3<double> amplitude;      // [m]
};

/// Adds K sines to the points, which grow over the arc length `rise`.
inline void shake(Vec3<double> *x, int P, Lanes<double> length, const Sine *sines, int K, Lanes<double> rise) {
    const Lanes<double> step = length / double(P - 1);
    for (int j = 1; j < P; ++j) {
        const Lanes<double> s = step * double(j);
        Vec3<double> sum{};
        for (int k = 0; k < K; ++k) sum = sum + of_turns(s / sines[k].period + sines[k].phase).sine * sines[k].amplitude;
        x[j] = x[j] + smoothstep<double>(s / rise) * sum;
    }
}

struct Turn {
    Vec3<double> axis;                // unit vector
    Lanes<double> begin, over, angle; // [m] of arc length, [m], [rad]
};

/// Segments turned about an axis, by angles that grow from 0 at `begin` to `angle` over the length `over`, by Rodrigues'
/// formula; none changes its length.
inline void turn_segments(const Vec3<double> *x, int P, Lanes<double> length, const Turn &turn, Vec3<double> *out) {
    constexpr double kTurn = 6.283185307179586;
    const Lanes<double> step = length / double(P - 1);
    out[0] = x[0];
    for (int j = 0; j + 1 < P; ++j) {
        const Lanes<double> part = smoothstep<double>((step * (j + 0.5) - turn.begin) / turn.over);
        const SineCosine by = of_turns(part * turn.angle / kTurn);
        const Vec3<double> v = x[j + 1] - x[j];
        out[j + 1] = out[j] + by.cosine * v + by.sine * cross(turn.axis, v) + ((1 - by.cosine) * dot(turn.axis, v)) * turn.axis;
    }
}

} // namespace ringlet
