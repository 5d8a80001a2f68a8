// The way of a point during a step, seen from the head, and where it first leads into the head.
//
// Sphere tracing (Hart, "Sphere Tracing", 1996) along the parabola through the point's places at the beginning, in the
// middle and at the end of the step: a point that is still while the head turns goes round it, not through it. The
// distance is a bound of how far one may go; below half a cell, and in long ways, steps have a least length.
#pragma once

#include "distance_field.hpp"

namespace ringlet {

inline constexpr int kWaySteps = 256; // the least step is this part of the way

/// p(u) = a + u (b + u c), 0 <= u <= 1, through three places.
template <class Real> struct Way {
    Vec3<Real> a, b, c;
    Lanes<Real> longest; // bound of |dp/du|

    Way(Vec3<Real> begin, Vec3<Real> middle, Vec3<Real> end) : a(begin) {
        const Lanes<Real> two = splat(Real(2));
        c = two * ((begin + end) - two * middle);
        b = (end - begin) - c;
        const Vec3<Real> late = b + two * c;
        longest = square_root<Real>(maximum<Real>(dot(b, b), dot(late, late)) + Real(1e-30));
    }

    Vec3<Real> at(Lanes<Real> u) const { return a + u * (b + u * c); }
    Vec3<Real> end() const { return a + (b + c); }
};

/// Lanes that have come through the head, or beyond its middle, take the plane on which they went in: its distance and
/// its gradient instead of those at the way's end. Lanes that begin inside keep what they have.
/// `head` measures the distance at the end of the step.
template <class Real, class Head>
__attribute__((noinline)) void follow(const Head &head, const Way<Real> &way, Mask<Real> far, Lanes<Real> &distance,
                                      Vec3<Real> &gradient) {
    const Lanes<Real> none = splat(Real(0)), per_way = 1 / way.longest;
    const Lanes<Real> least = maximum<Real>(splat(Real(0.5 * head.field->spacing)), way.longest * Real(1.0 / kWaySteps));
    const Vec3<Real> end = way.end();
    Lanes<Real> u = none, plane = none;
    Vec3<Real> outwards{none, none, none};
    Mask<Real> open = far, entered{}, begun_outside{};
    for (int step = 0; step <= kWaySteps && any<Real>(open); ++step) {
        Lanes<Real> phi;
        Vec3<Real> slope;
        const Vec3<Real> here = way.at(u);
        head.measure(here, phi, slope);
        const Mask<Real> outside = open & (phi >= none);
        begun_outside |= outside;
        slope = (1 / square_root<Real>(dot(slope, slope) + Real(1e-20))) * slope;
        plane = select<Real>(outside, phi + dot(slope, end - here), plane);
        outwards = select(outside, slope, outwards);
        entered |= open & begun_outside & ~outside;
        open = outside;
        u += maximum<Real>(phi * Real(1 / head.steepest), least) * per_way;
        open &= u < Real(1);
    }
    const Mask<Real> through = entered & (plane < distance) & ((distance >= none) | (dot(outwards, gradient) < none));
    distance = select<Real>(through, plane, distance);
    gradient = select(through, outwards, gradient);
}

} // namespace ringlet
