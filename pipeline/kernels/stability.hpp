// Whether strands in equilibrium are stable, and the smallest factor on their stiffness that makes them so.
//
// The second variation of the energy by rotations omega_j of the free segments is f H0 + Hg: H0 = sum g^T B g / dl grows
// with the stiffness, Hg (the stresses' and the loads' part) does not depend on it. The equilibrium is stable iff
// f H0 + Hg is positive definite, so that the critical factor is the largest eigenvalue of -Hg v = f H0 v; it is
// found by bisection. With K_i the symmetric part of the joint's 3x3 block and tau_i = sum s_a g_a
//     joint i:   +K on (i, i) and (i-1, i-1),  -K + [tau x] / 2 on (i-1, i)
//     segment j: l ((t.W) I - (t W^T + W t^T) / 2) on (j, j)
//     K = sum_a B_a f / dl g_a g_a^T + sym(v_1 g_1^T + v_2 g_2^T + v_3 g_3^T)
// with v_a the change of tau, at fixed s, by k_1, k_2 and by half the twist. Points that the head carries are held to
// its surface by a stiff spring rho n n^T, held points beyond the root by rho I; that couples all segments below the point; eliminated from tip to root as
// a chain with the state (omega_j, dx_{j+1}) this still costs a fixed amount a segment (a Riccati recursion): the
// matrix is positive definite iff all 3x3 pivots are.
// test_critical_factor_is_the_largest_eigenvalue_of_the_second_variation, test_upright_strand_buckles_at_greenhills_length prove it.
#pragma once

#include "statics.hpp"

namespace ringlet {

inline constexpr double kLeastFactor = 1e-4, kMostFactor = 1e4; // range of the bisection
inline constexpr int kTries = 20;                               // narrows it to 2e-5
inline constexpr double kSpring = 1e3;                          // rho, in max(B) / dl^3

struct Stability {
    int P;
    Matrix *elastic, *stressed, *loaded; // K of joint i: per factor, and the rest; segment j's block
    Vector *tau;                         // of joint i
    Matrix *hold;                        // of point i: n n^T where it can only move along the head, I where it is held
    Many rho;
    const StaticBlock *block = nullptr;

    Stability(Arena &arena, int points) : P(points), tau(arena.take<Vector>(points)) {
        for (auto **array : {&elastic, &stressed, &loaded, &hold}) *array = arena.take<Matrix>(P);
    }

    /// The blocks of the second variation at the balance of a block.
    void set(const StaticBlock &b) {
        block = &b;
        Many spacing = splat(0.0);
        for (int i = 1; i < P - 1; ++i) {
            set_joint(b.joint[i], b.B, i);
            spacing += b.joint[i].dl / double(P - 2);
        }
        for (int j = 1; j < P - 1; ++j) {
            Matrix tW = outer(b.t[j], b.W[j]);
            loaded[j] = b.l[j] * (diagonal<double>(dot(b.t[j], b.W[j])) - symmetric(tW));
        }
        rho = kSpring * maximum<double>(b.B[0], b.B[1]) / (spacing * spacing * spacing);
    }

    /// Lanes in which f H0 + Hg is positive definite.
    Mask<double> stable(Many f) const {
        Mask<double> positive = splat(0.0) < splat(1.0);
        Matrix ww{}, wx{}, xx = f * rho * hold[P - 1]; // of (omega_j, dx_{j+1}): all beyond segment j
        for (int j = P - 2; j >= 1; --j) {
            const Many turns = block->turns[j], fixed = 1 - turns;
            const Matrix K = block->joint[j].live * (f * elastic[j] + stressed[j]), arm = (-turns * block->l[j]) * crossing(block->t[j]);
            // dx_{j+1} = dx_j + arm omega_j
            const Matrix pulled = xx * arm, swung = wx * arm;
            const Matrix pivot = ww + K + turns * loaded[j] + transposed(arm) * pulled + swung + transposed(swung) +
                                 diagonal<double>(fixed);
            const Factored3<double> factored(pivot);
            positive &= factored.positive | (turns == splat(0.0));
            const Matrix N = turns * (splat(0.5) * crossing(tau[j]) - K), C = wx + transposed(pulled);
            const Matrix X = factored.solve(transposed(N)), Y = turns * factored.solve(C);
            ww = K - N * X;
            wx = splat(-1.0) * (N * Y);
            xx = xx - transposed(C) * Y + f * rho * hold[j];
        }
        return positive;
    }

    /// The critical factor of each lane, between kLeastFactor (stable at any stiffness) and kMostFactor.
    Many critical() const {
        Many low = splat(kLeastFactor), high = splat(kMostFactor);
        for (int k = 0; k < kTries; ++k) {
            Many middle = square_root<double>(low * high);
            Mask<double> enough = stable(middle);
            low = select<double>(enough, low, middle);
            high = select<double>(enough, middle, high);
        }
        return high;
    }

  private:
    RINGLET_INLINE void set_joint(const StaticJoint &joint, const Many (&B)[3], int i) {
        const Many k1 = joint.k1, k2 = joint.k2, s1 = joint.s[0], s2 = joint.s[1], s3 = joint.s[2];
        const Vector b1 = joint.b1, b2 = joint.b2, t = joint.t;
        tau[i] = s1 * joint.g[0] + (s2 * joint.g[1] + s3 * joint.g[2]);
        Vector v1 = (-0.25 * k2 * s1 - 0.5 * s3) * b1 + (0.5 * k1 * s1 + 0.25 * k2 * s2) * b2 - (0.5 * s2) * t;
        Vector v2 = (-0.25 * k1 * s1 - 0.5 * k2 * s2) * b1 + (0.25 * k1 * s2 - 0.5 * s3) * b2 + (0.5 * s1) * t;
        Vector v3 = splat(-0.5) * cross(t, tau[i]);
        elastic[i] = Matrix{};
        for (int a = 0; a < 3; ++a) elastic[i] = elastic[i] + (B[a] / joint.dl) * outer(joint.g[a], joint.g[a]);
        stressed[i] = symmetric(outer(v1, joint.g[0]) + outer(v2, joint.g[1]) + outer(v3, joint.g[2]));
    }
};

} // namespace ringlet
