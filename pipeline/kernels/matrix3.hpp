// 3x3 matrices, one of each strand of a block: a lane each.
#pragma once

#include "simd.hpp"

namespace ringlet {

template <class Real> struct Mat3 {
    Vec3<Real> row[3];

    friend RINGLET_INLINE Mat3 operator+(Mat3 a, Mat3 b) {
        return {{a.row[0] + b.row[0], a.row[1] + b.row[1], a.row[2] + b.row[2]}};
    }
    friend RINGLET_INLINE Mat3 operator-(Mat3 a, Mat3 b) {
        return {{a.row[0] - b.row[0], a.row[1] - b.row[1], a.row[2] - b.row[2]}};
    }
    friend RINGLET_INLINE Mat3 operator*(Lanes<Real> s, Mat3 a) { return {{s * a.row[0], s * a.row[1], s * a.row[2]}}; }
    friend RINGLET_INLINE Mat3 operator*(Mat3 a, Mat3 b) {
        Mat3 c;
        for (int i = 0; i < 3; ++i)
            c.row[i] = a.row[i].x * b.row[0] + (a.row[i].y * b.row[1] + a.row[i].z * b.row[2]);
        return c;
    }
    friend RINGLET_INLINE Mat3 transposed(Mat3 a) {
        return {{{a.row[0].x, a.row[1].x, a.row[2].x},
                 {a.row[0].y, a.row[1].y, a.row[2].y},
                 {a.row[0].z, a.row[1].z, a.row[2].z}}};
    }
    friend RINGLET_INLINE Mat3 symmetric(Mat3 a) { return splat(Real(0.5)) * (a + transposed(a)); }
};

/// a b^T.
template <class Real> RINGLET_INLINE Mat3<Real> outer(Vec3<Real> a, Vec3<Real> b) {
    return {{a.x * b, a.y * b, a.z * b}};
}

/// The matrix of v -> a x v.
template <class Real> RINGLET_INLINE Mat3<Real> crossing(Vec3<Real> a) {
    const Lanes<Real> none = splat(Real(0));
    return {{{none, -a.z, a.y}, {a.z, none, -a.x}, {-a.y, a.x, none}}};
}

template <class Real> RINGLET_INLINE Mat3<Real> diagonal(Lanes<Real> s) {
    const Lanes<Real> none = splat(Real(0));
    return {{{s, none, none}, {none, s, none}, {none, none, s}}};
}

/// L D L^T of a symmetric matrix.
template <class Real> struct Factored3 {
    using L = Lanes<Real>;
    L l10, l20, l21;    // of L
    L inverse[3];       // of D
    Mask<Real> positive; // lanes whose matrix is positive definite; the others must not be solved with

    RINGLET_INLINE explicit Factored3(Mat3<Real> a) {
        const L none = splat(Real(0)), one = splat(Real(1));
        L p0 = a.row[0].x;
        positive = p0 > none;
        inverse[0] = 1 / select<Real>(positive, p0, one);
        l10 = a.row[1].x * inverse[0], l20 = a.row[2].x * inverse[0];
        L p1 = a.row[1].y - l10 * a.row[1].x;
        positive &= p1 > none;
        inverse[1] = 1 / select<Real>(positive, p1, one);
        L below = a.row[2].y - l10 * a.row[2].x;
        l21 = below * inverse[1];
        L p2 = a.row[2].z - l20 * a.row[2].x - l21 * below;
        positive &= p2 > none;
        inverse[2] = 1 / select<Real>(positive, p2, one);
    }

    /// Inverse of the matrix times b.
    RINGLET_INLINE Mat3<Real> solve(Mat3<Real> b) const {
        Vec3<Real> y1 = b.row[1] - l10 * b.row[0], y2 = b.row[2] - l20 * b.row[0] - l21 * y1;
        Vec3<Real> z2 = inverse[2] * y2, z1 = inverse[1] * y1 - l21 * z2;
        return {{inverse[0] * b.row[0] - l10 * z1 - l20 * z2, z1, z2}};
    }
};

} // namespace ringlet
