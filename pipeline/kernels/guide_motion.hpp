// How the segments of guides have turned since rest: the rotations that strands inherit.
//
// Notation: t_j unit tangent of segment j, at rest and now (now: seen from the head, so that a guide that is carried
// rigidly has not turned); m(a, b) the minimal rotation taking a to b. A Bishop frame is carried along a guide by
// m(t_{j-1}, t_j); its rotation since rest is therefore
//     A_0 = m(t_0, t_0'),    A_j = m(t'_{j-1}, t'_j) A_{j-1} m(t_{j-1}, t_j)^-1.
// Source: Bergou et al., "Discrete Elastic Rods" (2008), section 4.2.2 (parallel transport along a polyline).
#pragma once

#include "pose.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace ringlet {

struct Direction {
    double x, y, z;
};

struct Quaternion {
    double w, x, y, z;

    Quaternion inverse() const { return {w, -x, -y, -z}; }

    friend Quaternion operator*(const Quaternion &a, const Quaternion &b) {
        return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
    }

    friend double dot(const Quaternion &a, const Quaternion &b) {
        return a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
    }
};

inline Quaternion normalised(Quaternion q) {
    const double s = 1 / std::sqrt(dot(q, q));
    return {s * q.w, s * q.x, s * q.y, s * q.z};
}

/// The minimal rotation taking unit vector a to b. Where b = -a any half turn does: about the axis of coordinates
/// that is farthest from a, made perpendicular to it.
inline Quaternion minimal_rotation(Direction a, Direction b) {
    const double w = 1 + a.x * b.x + a.y * b.y + a.z * b.z;
    if (w > 1e-12) return normalised({w, a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x});
    if (std::abs(a.x) < 0.6) return normalised({0, 1 - a.x * a.x, -a.x * a.y, -a.x * a.z});
    return normalised({0, -a.y * a.x, 1 - a.y * a.y, -a.y * a.z});
}

struct GuideMotion {
    int G, Q;                     // guides, points of each
    std::vector<float> rotations; // (G, Q-1, 4) w, x, y, z
    std::vector<float> spacing;   // (G,) [m], at rest
    Pose pose;                    // head's rest frame -> world
};

/// Unit tangent of segment j of a guide, turned by R; that of the segment before it where it has no length.
inline Direction tangent(const float *guide, int j, const double (&R)[3][3], Direction before) {
    double d[3], t[3] = {0, 0, 0}, length = 0;
    for (int axis = 0; axis < 3; ++axis) d[axis] = double(guide[3 * j + 3 + axis]) - guide[3 * j + axis];
    for (int i = 0; i < 3; ++i) {
        for (int axis = 0; axis < 3; ++axis) t[i] += R[i][axis] * d[axis];
        length += t[i] * t[i];
    }
    length = std::sqrt(length);
    return length > 0 ? Direction{t[0] / length, t[1] / length, t[2] / length} : before;
}

/// Rotations of one guide; neighbours on the guide have the same sign, so that they may be interpolated.
inline void turn_guide(const float *rest, const float *now, int Q, const Pose &to_head, float *rotation) {
    static constexpr double unturned[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    Direction t_before{0, 0, 1}, now_before{0, 0, 1};
    Quaternion A{1, 0, 0, 0}, last = A;
    for (int j = 0; j + 1 < Q; ++j) {
        const Direction t = tangent(rest, j, unturned, t_before), t_now = tangent(now, j, to_head.R, now_before);
        A = j == 0 ? minimal_rotation(t, t_now)
                   : normalised(minimal_rotation(now_before, t_now) * A * minimal_rotation(t_before, t).inverse());
        if (dot(A, last) < 0) A = {-A.w, -A.x, -A.y, -A.z};
        for (double part : {A.w, A.x, A.y, A.z}) *rotation++ = float(part);
        t_before = t, now_before = t_now, last = A;
    }
}

/// Mean length of a guide's segments.
inline float guide_spacing(const float *guide, int Q) {
    double length = 0;
    for (int i = 0; i < 3 * (Q - 1); i += 3)
        length += std::hypot(double(guide[i + 3]) - guide[i], double(guide[i + 4]) - guide[i + 1],
                             double(guide[i + 5]) - guide[i + 2]);
    return float(length / (Q - 1));
}

inline GuideMotion guide_motion(const float *rest, const float *points, int G, int Q, const Pose &pose, int threads) {
    GuideMotion motion{G, Q, std::vector<float>(size_t(G) * (Q - 1) * 4), std::vector<float>(G), pose};
    const Pose to_head = pose.inverse();
#pragma omp parallel for num_threads(threads)
    for (int g = 0; g < G; ++g) {
        const size_t at = size_t(g) * Q * 3;
        turn_guide(rest + at, points + at, Q, to_head, &motion.rotations[size_t(g) * (Q - 1) * 4]);
        motion.spacing[g] = guide_spacing(rest + at, Q);
    }
    return motion;
}

} // namespace ringlet
