// Statics of strands in the "kirchhoff" model: what moments the joints must supply at given points, and the rest
// strains that supply them. The inverse problem: the shape is known, the rest shape is sought.
//
// Source: discrete rods with material frames (Bergou et al., Discrete Elastic Rods, 2008). For an inextensible rod
// whose root is clamped the forces follow from the loads alone, and each joint has one 3x3 system, exactly solvable:
//     W_j = sum of the loads F_k over the points k > j          force through segment j; tension T_j = t_j . W_j
//     M_i = sum_{j >= i} e_j x W_j + C_j                        moment at joint i; C_j couples on held segments
//     [g_1 g_2 g_3] s = M_i,  u_r = u - dl s / (B f)            B = (B1, B2, C), f a factor on the stiffness
// Notation: t, m tangent and director of a segment, joint i between segments i-1 and i; u = (k_1, k_2, twist)
// integrated strains; g_a gradient of strain a when the outer segment turns (the inner one feels the opposite);
// b_1, b_2 the mid frame carried to the outer segment (see kirchhoff.hpp), in which with t
//     g_1 = (-k1 k2 / 4, 1 + k1^2 / 4, k2 / 2), g_2 = (-1 - k2^2 / 4, k1 k2 / 4, -k1 / 2), g_3 = (-k1 / 2, -k2 / 2, 1)
// test_the_groom_is_in_equilibrium proves them: the force of the energy, which is tested by complex steps, balances.
#pragma once

#include "kirchhoff.hpp"
#include "matrix3.hpp"

namespace ringlet {

using Many = Lanes<double>;
using Vector = Vec3<double>;
using Matrix = Mat3<double>;

/// A joint as it is groomed.
struct StaticJoint {
    Many k1, k2, twist;  // strains
    Vector b1, b2, t;    // mid frame on the outer segment, and its tangent
    Vector g[3];         // gradients of the three strains
    Vector dual[3];      // s_a = dual_a . M
    Many s[3];           // what the joint supplies [N m]
    Many dl, live;       // mean length of both segments; 1 where one of them can turn

    StaticJoint() = default;

    StaticJoint(Vector t0, Vector t1, Vector m0, Vector m1) : t(t1) {
        const Joint<double> joint(t0, t1, m0, m1, splat(0.0));
        k1 = joint.k1, k2 = joint.k2, twist = joint.twist;
        b1 = joint.a1 - (0.5 * k1) * (t0 + t1), b2 = joint.a2 - (0.5 * k2) * (t0 + t1);
        g[0] = (-0.25 * k1 * k2) * b1 + (1 + 0.25 * k1 * k1) * b2 + (0.5 * k2) * t;
        g[1] = (-1 - 0.25 * k2 * k2) * b1 + (0.25 * k1 * k2) * b2 - (0.5 * k1) * t;
        g[2] = t - (0.5 * k1) * b1 - (0.5 * k2) * b2;
        const Many inverse = 1 / dot(g[0], cross(g[1], g[2]));
        for (int a = 0; a < 3; ++a) dual[a] = inverse * cross(g[(a + 1) % 3], g[(a + 2) % 3]);
    }
};

/// A block of strands at the groomed points.
struct StaticBlock {
    int P;
    Vector *x, *director, *t;         // points, directors, tangents
    Vector *F, *couple, *W;           // loads of points and couples on segments; forces through segments
    Many *l, *turns, *held;           // length of a segment, 1 where it can turn; 1 where a point is held
    StaticJoint *joint;               // 1 .. P-2
    Many B[3];                        // B1, B2, C

    StaticBlock(Arena &arena, int points) : P(points), joint(arena.take<StaticJoint>(P)) {
        for (auto **array : {&x, &director, &t, &F, &couple, &W}) *array = arena.take<Vector>(P);
        for (auto **array : {&l, &turns, &held}) *array = arena.take<Many>(P);
    }

    /// Tangents and joints, from points, directors and what is held.
    void set_joints() {
        for (int j = 0; j < P - 1; ++j) {
            const Vector edge = x[j + 1] - x[j];
            t[j] = (1 / square_root<double>(dot(edge, edge))) * edge;
        }
        for (int i = 1; i < P - 1; ++i) {
            joint[i] = StaticJoint(t[i - 1], t[i], director[i - 1], director[i]);
            joint[i].dl = 0.5 * (l[i - 1] + l[i]);
            joint[i].live = maximum<double>(turns[i - 1], turns[i]);
        }
    }

    /// Forces through segments and what the joints supply, from the loads.
    void balance() {
        Vector force{}, moment{};
        for (int j = P - 2; j >= 0; --j) {
            force = force + F[j + 1];
            W[j] = force;
            if (j == 0) break;
            moment = moment + couple[j] + l[j] * cross(t[j], force);
            for (int a = 0; a < 3; ++a) joint[j].s[a] = joint[j].live * dot(joint[j].dual[a], moment);
        }
    }

    /// Largest change of a rest strain that the balance asks for at the true stiffness.
    Many largest_change() const {
        Many most = splat(0.0);
        for (int i = 1; i < P - 1; ++i)
            for (int a = 0; a < 3; ++a) {
                Many change = joint[i].dl * joint[i].s[a] / B[a];
                most = maximum<double>(most, maximum<double>(change, -change));
            }
        return most;
    }
};

} // namespace ringlet
