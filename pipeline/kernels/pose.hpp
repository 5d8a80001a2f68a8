// Rigid poses: in float64 where they are combined, in the precision of the strands where they move points.
#pragma once

#include "simd.hpp"

namespace ringlet {

/// x -> R x + t, R by rows.
struct Pose {
    double R[3][3], t[3];

    /// From a row-major 4x4 matrix.
    static Pose of(const double *matrix) {
        Pose pose;
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) pose.R[i][j] = matrix[4 * i + j];
            pose.t[i] = matrix[4 * i + 3];
        }
        return pose;
    }

    Pose inverse() const {
        Pose r{};
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) r.R[i][j] = R[j][i], r.t[i] -= R[j][i] * t[j];
        return r;
    }

    friend Pose operator*(const Pose &a, const Pose &b) {
        Pose r{};
        for (int i = 0; i < 3; ++i) {
            r.t[i] = a.t[i];
            for (int k = 0; k < 3; ++k) {
                r.t[i] += a.R[i][k] * b.t[k];
                for (int j = 0; j < 3; ++j) r.R[i][j] += a.R[i][k] * b.R[k][j];
            }
        }
        return r;
    }
};

/// The pose half way: the rotation nearest to the mean of both matrices (Newton iteration of the polar
/// decomposition, M <- (M + M^-T) / 2), the mean of both translations.
inline Pose halfway(const Pose &a, const Pose &b) {
    Pose m;
    for (int i = 0; i < 3; ++i) {
        m.t[i] = 0.5 * (a.t[i] + b.t[i]);
        for (int j = 0; j < 3; ++j) m.R[i][j] = 0.5 * (a.R[i][j] + b.R[i][j]);
    }
    for (int iteration = 0; iteration < 6; ++iteration) {
        double cofactor[3][3];
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
                cofactor[i][j] = m.R[i1][j1] * m.R[i2][j2] - m.R[i1][j2] * m.R[i2][j1];
            }
        double determinant = 0;
        for (int j = 0; j < 3; ++j) determinant += m.R[0][j] * cofactor[0][j];
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) m.R[i][j] = 0.5 * (m.R[i][j] + cofactor[i][j] / determinant);
    }
    return m;
}

/// A pose that moves a block's points.
template <class Real> struct Rigid {
    Real R[3][3], t[3];

    Rigid(const Pose &pose) {
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) R[i][j] = Real(pose.R[i][j]);
            t[i] = Real(pose.t[i]);
        }
    }

    RINGLET_INLINE Vec3<Real> turn(Vec3<Real> a) const {
        return {R[0][0] * a.x + R[0][1] * a.y + R[0][2] * a.z, R[1][0] * a.x + R[1][1] * a.y + R[1][2] * a.z,
                R[2][0] * a.x + R[2][1] * a.y + R[2][2] * a.z};
    }

    RINGLET_INLINE Vec3<Real> operator()(Vec3<Real> a) const {
        Vec3<Real> r = turn(a);
        return {r.x + t[0], r.y + t[1], r.z + t[2]};
    }
};

} // namespace ringlet
