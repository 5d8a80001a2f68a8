// "kirchhoff": an inextensible elastic rod with material frames: its joints, energy, gradient and stiffness.
//
// Notation: segment j has the unit tangent t_j and one director m_j, unit and perpendicular to t_j; the second is
// n_j = t_j x m_j. Joint i joins segment i-1 (t, m, n) and segment i (t', m', n'); p = t.t', dl mean of both lengths.
//     A = (m.m' + n.n') / (1 + p),   S = (n.m' - m.n') / (1 + p)        cosine and sine of the twist
//     twist = atan2(S, A) + 2 pi w                                      w: nearest to the twist before
//     a1 = cos(twist/2) m + sin(twist/2) n,   a2 = cos(twist/2) n - sin(twist/2) m      mid frame, on segment i-1
//     k_a = 2 a_a.t' / (1 + p)   (|k| = 2 tan(bend/2)),   b_a = a_a - (k_a/2) (t + t')  mid frame, on segment i
//     E = sum_i [ B1 (k1 - r1)^2 + B2 (k2 - r2)^2 + C (twist - r3)^2 ] / (2 dl)
// theta_j turns director j about t_j; when points move at fixed theta the directors follow by parallel transport in
// time. The matrix has the unknowns x_0, s_0, x_1, s_1, ... with s = l theta, so that all have one unit.
// Source: Bergou et al., "Discrete elastic rods" (2008), "Discrete viscous threads" (2010). We differ: the twist comes
// from the directors themselves, without reference frame or parallel transport in space; and the curvature is seen in
// the mid frame instead of the mean of both directors, so that |k| does not depend on the twist and an isotropic
// straight rod has no bend-twist coupling (test_twist_of_an_isotropic_straight_rod_does_not_bend_it).
// The rod's stiffness is Gauss-Newton with other twist columns: see `rod_rows`.
#pragma once

#include "energy.hpp"

#include <initializer_list>

namespace ringlet {

/// 1 + p counts at least this much: a fold sharper than 180 - 0.1 degrees (168 in float32).
template <class Real> inline constexpr Real kFold = sizeof(Real) == 4 ? Real(1e-2) : Real(1e-6);
/// Nothing may hold the directors of a free rod: this part of their stiffness does, in every matrix, and where there is
/// none either this part of a point's mass. (As inertia it would brake a strand that turns, the more the shorter the
/// step: test_a_free_curl_keeps_its_angular_momentum.)
template <class Real> inline constexpr Real kLeastTwisting = sizeof(Real) == 4 ? Real(1e-5) : Real(1e-9);
inline constexpr double kLeastSpin = 1e-9;

/// arctan(u) to 4e-16, or 2e-8 in float32, for |u| <= tan(pi/8).
template <class Real> RINGLET_INLINE Lanes<Real> arc_tangent(Lanes<Real> u) {
    const Lanes<Real> z = u * u;
    Lanes<Real> sum;
    if constexpr (sizeof(Real) == 4) {
        sum = splat(Real(0.07986736483424821));
        for (double c : {-0.13852088449070227, 0.19974470416206225, -0.33332799198938495, 0.9999999819952706})
            sum = sum * z + Real(c);
    } else {
        sum = splat(Real(0.010755414220443175));
        for (double c : {-0.034523517295154654, 0.053578965944593965, -0.065721909989094551, 0.076813917746464122,
                         -0.090900955891864366, 0.11111072759544678, -0.14285713198350578, 0.1999999998327863,
                         -0.33333333333222487, 0.99999999999999856})
            sum = sum * z + Real(c);
    }
    return u * sum;
}

/// The angle in (-pi, pi] with cosine A and sine S, and cosine and sine of its half; no trigonometry.
template <class Real> struct HalfAngle {
    Lanes<Real> angle, cosine, sine;

    RINGLET_INLINE HalfAngle(Lanes<Real> A, Lanes<Real> S) {
        const Lanes<Real> zero = splat(Real(0)), one = splat(Real(1));
        const Lanes<Real> scale = inverse_root<Real>(A * A + S * S + Real(1e-30));
        A = A * scale, S = S * scale; // both are off only where 1 + p is clamped
        const Lanes<Real> sign = select<Real>(S < zero, -one, one);
        const Mask<Real> acute = A > zero;
        const Lanes<Real> square = Real(0.5) * (1 + maximum<Real>(A, -A)), inverse = inverse_root<Real>(square);
        const Lanes<Real> big = square * inverse, small = Real(0.5) * sign * S * inverse;
        const Lanes<Real> least = 4 * arc_tangent<Real>(small * reciprocal<Real>(1 + big)); // of the angle to 0 or to pi
        angle = sign * select<Real>(acute, least, Real(3.14159265358979323846) - least);
        cosine = select<Real>(acute, big, small);
        sine = sign * select<Real>(acute, small, big);
    }
};

/// Kinematics of one joint.
template <class Real> struct Joint {
    using L = Lanes<Real>;
    Vec3<Real> a1, a2; // mid frame on the segment before
    L k1, k2, twist;

    Joint() = default;

    /// Of two unit tangents and their directors; of all windings the one nearest to the twist `before`. An odd number
    /// of turns turns the mid frame by half a turn.
    RINGLET_INLINE Joint(Vec3<Real> t0, Vec3<Real> t1, Vec3<Real> m0, Vec3<Real> m1, L before) {
        constexpr Real turn = Real(6.28318530717958647692);
        const Vec3<Real> n0 = cross(t0, m0), n1 = cross(t1, m1);
        const L inverse = reciprocal<Real>(maximum<Real>(1 + dot(t0, t1), splat(kFold<Real>)));
        const HalfAngle<Real> half(inverse * (dot(m0, m1) + dot(n0, n1)), inverse * (dot(n0, m1) - dot(m0, n1)));
        const L turns = nearest<Real>((before - half.angle) * (1 / turn));
        const Mask<Real> even = turns == 2 * nearest<Real>(Real(0.5) * turns);
        const L c = select<Real>(even, half.cosine, -half.cosine), s = select<Real>(even, half.sine, -half.sine);
        twist = half.angle + turn * turns;
        a1 = c * m0 + s * n0, a2 = c * n0 - s * m0;
        k1 = 2 * inverse * dot(a1, t1), k2 = 2 * inverse * dot(a2, t1);
    }

    /// The joint whose two directors turn by the angles 2 u and 2 v, of which c and s are cosine and sine of u + v and
    /// `more` is 2 (v - u): the mid frame turns by their mean.
    RINGLET_INLINE void turn(L c, L s, L more) {
        const Vec3<Real> a = a1;
        const L k = k1;
        a1 = c * a + s * a2, a2 = c * a2 - s * a;
        k1 = c * k + s * k2, k2 = c * k2 - s * k;
        twist += more;
    }

    /// Curvature binormal k1 a2 - k2 a1.
    RINGLET_INLINE Vec3<Real> binormal() const { return k1 * a2 - k2 * a1; }
};

/// What a joint's strains deviate from rest, as moments: M_a = B_a (k_a - r_a) / dl, Q = C (twist - r3) / dl.
template <class Real> struct Moments {
    Lanes<Real> M1, M2, Q;

    RINGLET_INLINE Moments(const Block<Real> &b, int i, const Joint<Real> &joint) {
        const Lanes<Real> per_length = b.inverse_dl[i];
        M1 = b.k_kappa * per_length * (joint.k1 - b.strain[i].x);
        M2 = b.k_kappa_2 * per_length * (joint.k2 - b.strain[i].y);
        Q = b.k_tau * per_length * (joint.twist - b.strain[i].z);
    }
};

/// Adds the gradient of a joint's energy by the two edges beside it, F[0] and F[1], and by their directors. With h = (M1 k1 + M2 k2) / 4 and the binormal kb:
///     dE/dt  = -(M1 + h k1) a1 - (M2 + h k2) a2 + (Q/2) kb,    dE/dtheta_{i-1} = (M1 k2 - M2 k1) / 2 - Q
///     dE/dt' = +(M1 + h k1) b1 + (M2 + h k2) b2 + (Q/2) kb,    dE/dtheta_i     = (M1 k2 - M2 k1) / 2 + Q
template <class Real>
RINGLET_INLINE void add_joint_gradient(const Moments<Real> &at, const Joint<Real> &q, const Edges<Real> &edges, int i,
                                       Vec3<Real> *F, Lanes<Real> *F_theta) {
    const Lanes<Real> h = Real(0.25) * (at.M1 * q.k1 + at.M2 * q.k2), u1 = at.M1 + h * q.k1, u2 = at.M2 + h * q.k2;
    const Vec3<Real> across = u1 * q.a1 + u2 * q.a2, twisted = (Real(0.5) * at.Q) * q.binormal();
    const Lanes<Real> along = Real(0.5) * (u1 * q.k1 + u2 * q.k2), both = Real(0.5) * (at.M1 * q.k2 - at.M2 * q.k1);
    F[0] = F[0] + edges.il[i - 1] * (twisted - across);
    F[1] = F[1] + edges.il[i] * (twisted + across - along * (edges.d[i - 1] + edges.d[i]));
    F_theta[0] += both - at.Q;
    F_theta[1] += both + at.Q;
}

template <class Real> struct RodEnergy {
    Lanes<Real> bending{}, twisting{};
};

/// Adds the gradient of the whole rod with directors m; the twist of point i is the one nearest to twist[i].
template <class Real>
RodEnergy<Real> add_rod(const Block<Real> &b, const Vec3<Real> *m, const Lanes<Real> *twist, Edges<Real> &edges) {
    RodEnergy<Real> energy;
    for (int i = 1; i < b.P - 1; ++i) {
        const Joint<Real> q(edges.d[i - 1], edges.d[i], m[i - 1], m[i], twist[i]);
        const Moments<Real> at(b, i, q);
        energy.bending += Real(0.5) * (at.M1 * (q.k1 - b.strain[i].x) + at.M2 * (q.k2 - b.strain[i].y));
        energy.twisting += Real(0.5) * at.Q * (q.twist - b.strain[i].z);
        add_joint_gradient(at, q, edges, i, edges.F + i - 1, edges.D_theta + i - 1);
    }
    return energy;
}

/// Exact second derivative of a joint's bending energy by a common turn of its two directors, times dl.
template <class Real>
RINGLET_INLINE Lanes<Real> turning_stiffness(const Block<Real> &b, int i, const Joint<Real> &q) {
    const Lanes<Real> B1 = b.k_kappa, B2 = b.k_kappa_2;
    return (B1 - B2) * (q.k2 * q.k2 - q.k1 * q.k1) + B1 * b.strain[i].x * q.k1 + B2 * b.strain[i].y * q.k2;
}

/// The three Gauss-Newton rows of a joint: derivatives of k1, k2 and twist by edge i-1, s_{i-1}, edge i, s_i.
/// The twist columns of k1 and k2 are not the exact ones, k2/2 and -k1/2: with
///     (k2 - f1 (k2 - r2)) / 2,  (f2 (k1 - r1) - k1) / 2,      f1 = min(1, B2/B1), f2 = min(1, B1/B2)
/// K stays positive, the block of points and twist is exact for B1 = B2, and turning an isotropic section costs nothing.
template <class Real> struct RodRows {
    using L = Lanes<Real>;
    static constexpr int Count = 3, Reach = 8;
    L g[Count][Reach];
    L turning[2]; // a fourth row that has s only: what the exact stiffness of a common turn has on top
    L least[2];   // on the diagonal of s

    /// Of joint i.
    RINGLET_INLINE void derive(const Block<Real> &b, const Edges<Real> &edges, int i, const Joint<Real> &q,
                               const Scale<Real> &scale) {
        const L root = scale.root * b.root_dl[i] * b.inverse_dl[i];
        const L weight[3] = {root * b.root_kappa, root * b.root_kappa_2, root * b.root_tau};
        const L il0 = edges.il[i - 1], il1 = edges.il[i], B1 = b.k_kappa, B2 = b.k_kappa_2, one = splat(Real(1));
        const Vec3<Real> tt = edges.d[i - 1] + edges.d[i], kb = splat(Real(0.5)) * q.binormal();
        const L f1 = minimum<Real>(one, b.k_ratio), f2 = minimum<Real>(one, b.inverse_ratio);
        const L c1 = Real(0.5) * (q.k2 - f1 * (q.k2 - b.strain[i].y));
        const L c2 = Real(0.5) * (f2 * (q.k1 - b.strain[i].x) - q.k1);
        const Vec3<Real> qa = q.k1 * q.a1 + q.k2 * q.a2;
        const Vec3<Real> qb = qa - (Real(0.5) * (q.k1 * q.k1 + q.k2 * q.k2)) * tt;
        const L before[3] = {weight[0] * il0, weight[1] * il0, weight[2] * il0};
        const L after[3] = {weight[0] * il1, weight[1] * il1, weight[2] * il1};
        set(0, -before[0] * (q.a1 + (Real(0.25) * q.k1) * qa),
            after[0] * (q.a1 - (Real(0.5) * q.k1) * tt + (Real(0.25) * q.k1) * qb), c1 * before[0], c1 * after[0]);
        set(1, -before[1] * (q.a2 + (Real(0.25) * q.k2) * qa),
            after[1] * (q.a2 - (Real(0.5) * q.k2) * tt + (Real(0.25) * q.k2) * qb), c2 * before[1], c2 * after[1]);
        set(2, before[2] * kb, after[2] * kb, -before[2], after[2]);
        const L more = turning_stiffness(b, i, q) - 4 * (B1 * c1 * c1 + B2 * c2 * c2);
        const L square = scale.undamped * maximum<Real>(more, splat(Real(0)));
        const L common = Real(0.5) * root * square * inverse_root<Real>(square + Real(1e-30));
        turning[0] = common * il0, turning[1] = common * il1;
        const L held = kLeastTwisting<Real> * (weight[0] * weight[0] + weight[2] * weight[2]);
        least[0] = held * il0 * il0, least[1] = held * il1 * il1;
    }

    /// What the stiffness adds to the gradient by the two edges, F, and by turns, extrapolated back to the step's start.
    RINGLET_INLINE void look_back(const Edges<Real> &edges, int i, const Scale<Real> &scale, Vec3<Real> *F,
                                  L *D_theta) const {
        if (!edges.ahead) return;
        for (const L(&row)[Reach] : g) {
            const Vec3<Real> g0 = {row[0], row[1], row[2]}, g1 = {row[4], row[5], row[6]};
            const L moment = scale.inverse * (dot(g0, edges.ahead[i]) + dot(g1, edges.ahead[i + 1]) +
                                              row[3] * edges.ahead_s[i] + row[7] * edges.ahead_s[i + 1]);
            F[0] = F[0] - moment * g0, F[1] = F[1] - moment * g1;
            D_theta[0] -= moment * row[3] * reciprocal<Real>(edges.il[i]);
            D_theta[1] -= moment * row[7] * reciprocal<Real>(edges.il[i + 1]);
        }
        const L common = scale.inverse / scale.undamped *
                         (turning[0] * edges.ahead_s[i] + turning[1] * edges.ahead_s[i + 1]);
        D_theta[0] -= common * turning[0] * reciprocal<Real>(edges.il[i]);
        D_theta[1] -= common * turning[1] * reciprocal<Real>(edges.il[i + 1]);
    }

  private:
    RINGLET_INLINE void set(int r, Vec3<Real> D0, Vec3<Real> D1, L s0, L s1) {
        L *row = g[r];
        row[0] = D0.x, row[1] = D0.y, row[2] = D0.z, row[3] = s0;
        row[4] = D1.x, row[5] = D1.y, row[6] = D1.z, row[7] = s1;
    }
};

} // namespace ringlet
