// A skin that moves against the head's frame: how it carries roots, and the distance to it between two frames.
//
// Between two frames of a body the distance is phi = (1 - w) phi_0 + w phi_1 on one grid, w the blend, 0 .. 1. The drift
// is how far the skin moves from the first to the second, at the foot of each node. Every root has a rigid map of its
// own, from the rest pose into the head's frame, at the beginning and at the end of a step; a part of a step takes the
// linear blend of the two, which differs from a rotation by the square of the turn in one step.
#pragma once

#include "distance_field.hpp"
#include "pose.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace ringlet {

/// The skin between two frames; the first frame's distance is the `field` of the step.
struct Deformation {
    DistanceField after;
    DistanceField drift[3]; // x, y, z [m]
    double fastest = 0;     // bound of |d phi / dw| [m]

    /// From the difference of the two frames, node by node: between nodes both are interpolated alike.
    void measure_speed(const DistanceField &before) {
        for (size_t k = 0; k < after.values.size(); ++k)
            fastest = std::max(fastest, std::abs(double(after.values[k]) - before.values[k]));
    }
};

/// A rigid map for each lane: rows of its matrix, then its translation.
template <class Real> struct RootPose {
    Vec3<Real> row[3], t;
};

/// The skin during a step or a part of one; without roots and deformation it is rigid.
template <class Real> struct SkinStep {
    const Deformation *deformation = nullptr;
    const RootPose<Real> *roots = nullptr; // 2: at the beginning and the end of the whole step
    double blend[2] = {0, 0};              // at the beginning and the end of the whole step
    double part[2] = {0, 1};               // where in the step this is

    SkinStep halved(bool second) const {
        SkinStep half = *this;
        half.part[second ? 0 : 1] = 0.5 * (part[0] + part[1]);
        return half;
    }

    /// Blend at the beginning (0) or the end (1) of the part.
    double blend_at(int end) const { return blend[0] + (blend[1] - blend[0]) * part[end]; }

    /// A rest point or a rest direction of each lane's root, at the end of the part, in the head's frame.
    Vec3<Real> place(Vec3<Real> x) const { return roots ? turned(x) + between(roots[0].t, roots[1].t) : x; }
    Vec3<Real> turn(Vec3<Real> x) const { return roots ? turned(x) : x; }

  private:
    Vec3<Real> between(Vec3<Real> a, Vec3<Real> b) const { return a + splat(Real(part[1])) * (b - a); }

    Vec3<Real> turned(Vec3<Real> x) const {
        const auto along = [&](int k) { return dot(between(roots[0].row[k], roots[1].row[k]), x); };
        return {along(0), along(1), along(2)};
    }
};

} // namespace ringlet
