// How the segments of guides have turned since rest: the rotations A_j that strands inherit.
//
// Notation: t_j unit tangent of segment j at rest, s_j now, seen from the head (a guide that is carried rigidly has not
// turned); m(a, b) the minimal rotation taking a to b. A Bishop frame, carried along a guide by minimal rotations, turns
// by m(s_{j-1}, s_j) A_{j-1} m(t_{j-1}, t_j)^-1. That is right for straight hair. On a curl whose torsion changes it
// turns ever further about the guide's own tangent, which strands with curls of another phase would take for a motion.
// There the segments beside say how the hair has turned: A_j is the rotation that best takes the t to the s around j,
//     sum_i g_{i-j} s_i . A t_i + lambda (A, Bishop's)^2  largest,
// followed by the minimal rotation that takes t_j to s_j exactly. Errors of strands against their own simulation, in
// per cent of the length, Bishop's / this: straight 1.8 / 1.8, curly 4.0 / 2.3, curly of random phase 19 / 8.
// Sources: Bergou et al., "Discrete Elastic Rods" (2008), section 4.2.2 (Bishop); Markley, "Attitude Determination using
// Vector Observations: a Fast Optimal Matrix Algorithm" (1993) (Davenport's matrix). Ours: that the two are combined.
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

/// Davenport's matrix: q K q is the sum over added pairs of weight s . (q t q^-1), for a unit quaternion q.
struct Davenport {
    double K[4][4] = {};

    void add(double weight, Direction t, Direction s) {
        const double xx = t.x * s.x, yy = t.y * s.y, zz = t.z * s.z;
        const double half[4][4] = {{0.5 * (xx + yy + zz), t.y * s.z - t.z * s.y, t.z * s.x - t.x * s.z, t.x * s.y - t.y * s.x},
                                   {0, 0.5 * (xx - yy - zz), t.x * s.y + t.y * s.x, t.x * s.z + t.z * s.x},
                                   {0, 0, 0.5 * (yy - xx - zz), t.y * s.z + t.z * s.y},
                                   {0, 0, 0, 0.5 * (zz - xx - yy)}};
        for (int i = 0; i < 4; ++i)
            for (int j = i; j < 4; ++j) K[i][j] += weight * half[i][j], K[j][i] += weight * half[i][j];
    }

    /// Adds weight (q . prior)^2 and the multiple of 1 that makes every eigenvalue positive.
    void lean(double weight, Quaternion prior, double total) {
        const double p[4] = {prior.w, prior.x, prior.y, prior.z};
        for (int i = 0; i < 4; ++i) {
            K[i][i] += total;
            for (int j = 0; j < 4; ++j) K[i][j] += weight * p[i] * p[j];
        }
    }

    /// K^256 q: next to the largest eigenvector, and next to q where the others are as large.
    Quaternion largest(Quaternion q) {
        for (int squaring = 0; squaring < 8; ++squaring) {
            double square[4][4] = {};
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 4; ++j)
                    for (int k = 0; k < 4; ++k) square[i][j] += K[i][k] * K[k][j];
            std::copy_n(&square[0][0], 16, &K[0][0]);
        }
        const double v[4] = {q.w, q.x, q.y, q.z};
        double r[4] = {};
        for (int i = 0; i < 4; ++i)
            for (int k = 0; k < 4; ++k) r[i] += K[i][k] * v[k];
        return normalised({r[0], r[1], r[2], r[3]});
    }
};

inline Direction turned(Quaternion q, Direction a) {
    const Quaternion r = q * Quaternion{0, a.x, a.y, a.z} * q.inverse();
    return {r.x, r.y, r.z};
}

/// Tangents of one guide, at rest and now.
struct Tangents {
    std::vector<Direction> t, s;

    Tangents(const float *rest, const float *now, int Q, const Pose &to_head) {
        static constexpr double unturned[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        for (int j = 0; j + 1 < Q; ++j) {
            t.push_back(tangent(rest, j, unturned, j ? t.back() : Direction{0, 0, 1}));
            s.push_back(tangent(now, j, to_head.R, j ? s.back() : Direction{0, 0, 1}));
        }
    }

    /// A_j, from A_{j-1}.
    Quaternion next(int j, Quaternion before) const {
        static constexpr double g[] = {1, 0.8825, 0.6065, 0.3247, 0.1353}; // a Gaussian of two segments
        static constexpr double lambda = 0.1;
        const Quaternion bishop =
            normalised(minimal_rotation(s[j - 1], s[j]) * before * minimal_rotation(t[j - 1], t[j]).inverse());
        double total = 0;
        const int first = std::max(0, j - 4), last = std::min(int(t.size()) - 1, j + 4);
        for (int i = first; i <= last; ++i) total += g[std::abs(i - j)];
        Davenport around;
        for (int i = first; i <= last; ++i) around.add(g[std::abs(i - j)] / total, t[i], s[i]);
        around.lean(lambda, bishop, 1);
        const Quaternion fitted = around.largest(bishop);
        return normalised(minimal_rotation(turned(fitted, t[j]), s[j]) * fitted);
    }
};

/// Rotations of one guide; neighbours on the guide have the same sign, so that they may be interpolated.
inline void turn_guide(const Tangents &of, float *rotation) {
    Quaternion A = minimal_rotation(of.t[0], of.s[0]);
    for (size_t j = 0; j < of.t.size(); ++j) {
        if (j > 0) {
            const Quaternion next = of.next(int(j), A);
            A = dot(A, next) < 0 ? Quaternion{-next.w, -next.x, -next.y, -next.z} : next;
        }
        // A guide at rest has turned by nothing but rounding: products of that are slow to multiply with
        for (double part : {A.w, A.x, A.y, A.z}) *rotation++ = std::abs(part) < 1e-12 ? 0.0f : float(part);
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
        turn_guide(Tangents(rest + at, points + at, Q, to_head), &motion.rotations[size_t(g) * (Q - 1) * 4]);
        motion.spacing[g] = guide_spacing(rest + at, Q);
    }
    return motion;
}

} // namespace ringlet
