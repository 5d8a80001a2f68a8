// The rest shape of strands: lengths, masses, stiffness, and the curvature and torsion that a groomed strand keeps.
//
// Notation: d unit edges, b = |d x d| sine of a bend, phi dihedral angle about an edge, l segment lengths,
// dl mean length of the two segments beside a point.
// "rotor" weight about edge i, with k0 = kappa_0 dl:
//     G = k_tau / dl  b_i b_{i+1} / ((b_i^2 + k0^2) (b_{i+1}^2 + k0^2)),      rho = b_{i+1} / b_i
// The plain form is k_tau / (dl (b_i b_{i+1} + k0^2)): the same for curls. Ours fades to 0 at a straight joint, where
// torsion has no meaning, and bounds the stiffness G rho and G / rho beside one
// (test_rotor_weight_fades_on_straight_hair).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ringlet {

struct RestShape {
    int S = 0, P = 0;
    std::vector<double> points;              // (S, P, 3) [m]
    std::vector<double> length;              // (S, P-1) [m]
    std::vector<double> mass;                // (S, P) [kg]
    std::vector<double> bending, twisting;   // (S,) [N m^2]
    std::vector<double> bending_2;           // (S,) [N m^2] towards the second director, "kirchhoff"
    std::vector<double> curvature, torsion;  // (S, P-2), (S, P-4) [1/m]
    std::vector<double> dihedral;            // (S, P-3) [rad]
    std::vector<double> ratio, weight;       // (S, P-3) [1], [N m]
    std::vector<double> root_weight;         // (S,) [N m], see root.hpp
    std::vector<double> root_shift;          // (S, 2): u at rest against the groom's
    std::vector<uint8_t> held;               // (S, P): 0 free, 1 by the head, 2 by the hand
    std::vector<double> offset;              // (S, P) [m]
    std::vector<double> directors, strain;   // (S, P-1, 3); (S, P-2, 3) [1, 1, rad], "kirchhoff"
    std::vector<double> load;                // (S, P, 3) [N]
};

/// Below this sine a bend has no direction, and its torsion no meaning.
inline constexpr double kNoBend = 1e-9;
/// "frenet" takes |c|^2 + (0.3 dl)^2 for |c|^2; here c is made of unit edges.
inline constexpr double kFrenetSquare = 0.3 * 0.3;

struct Vec {
    double x, y, z;
    friend Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Vec operator*(double s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
    friend double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
    friend Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
    friend double norm(Vec a) { return std::sqrt(dot(a, a)); }
};

/// kappa = 2 |c| / (dl |e|) of two unit edges.
inline double bend_curvature(Vec d0, Vec d1, double dl) { return 2 * norm(d1 - d0) / (dl * norm(d1 + d0)); }

/// tau = e.(c x q) / (2 dl |c|^2) of four unit edges of lengths l, the lecture's general form (energy.hpp); 0 where the
/// strand is straight.
inline double stencil_torsion(const Vec *d, const double *l) {
    const double dl = 0.5 * (l[1] + l[2]), dl0 = 0.5 * (l[0] + l[1]), dl3 = 0.5 * (l[2] + l[3]);
    Vec before = d[1] - d[0], c = d[2] - d[1], after = d[3] - d[2];
    Vec q = (l[1] / l[2] * dl / dl3 / norm(d[3] + d[2])) * after - (l[2] / l[1] * dl / dl0 / norm(d[1] + d[0])) * before;
    double cc = dot(c, c);
    return cc < kNoBend * kNoBend ? 0 : dot(d[2] + d[1], cross(c, q)) / (2 * dl * cc);
}

/// Dihedral angle, ratio of bends and weight about the edge d[1].
inline void rotor_rest(const Vec *d, double dl, double k_tau, double kappa_0, double *dihedral, double *ratio,
                       double *weight) {
    Vec before = cross(d[0], d[1]), after = cross(d[1], d[2]);
    double b0 = norm(before), b1 = norm(after), k0 = kappa_0 * dl;
    bool bent = b0 > kNoBend && b1 > kNoBend;
    *dihedral = bent ? std::atan2(dot(d[1], cross(before, after)), dot(before, after)) : 0;
    *ratio = bent ? b1 / b0 : 1;
    *weight = bent ? k_tau / dl * b0 * b1 / ((b0 * b0 + k0 * k0) * (b1 * b1 + k0 * k0)) : 0;
}

/// Weight of "rotor" about a segment of length l between two bends of the same sine b.
inline double rotor_weight(double b, double l, double k_tau, double kappa_0) {
    double fading = b * b + kappa_0 * l * kappa_0 * l;
    return b > kNoBend ? k_tau / l * b * b / (fading * fading) : 0;
}

/// Fills what follows from one strand's points: lengths, masses, curvature, torsion.
inline void derive_strand(RestShape &rest, int s, double mass_per_length, double kappa_0) {
    const int P = rest.P;
    const double *at = &rest.points[size_t(s) * P * 3];
    double *l = &rest.length[size_t(s) * (P - 1)], *m = &rest.mass[size_t(s) * P];
    std::vector<Vec> d(P - 1);
    for (int j = 0; j < P - 1; ++j, at += 3) {
        d[j] = Vec{at[3], at[4], at[5]} - Vec{at[0], at[1], at[2]};
        l[j] = norm(d[j]);
        d[j] = (1 / l[j]) * d[j];
        m[j] += 0.5 * mass_per_length * l[j];
        m[j + 1] += 0.5 * mass_per_length * l[j];
    }
    for (int i = 1; i < P - 1; ++i) {
        double dl = 0.5 * (l[i - 1] + l[i]);
        rest.curvature[size_t(s) * (P - 2) + i - 1] = bend_curvature(d[i - 1], d[i], dl);
        if (i > 1 && i < P - 2) rest.torsion[size_t(s) * (P - 4) + i - 2] = stencil_torsion(&d[i - 2], &l[i - 2]);
    }
    rest.root_weight[s] = rotor_weight(norm(cross(d[0], d[1])), l[0], rest.twisting[s], kappa_0);
    for (int j = 1; j < P - 2; ++j) {
        size_t k = size_t(s) * (P - 3) + j - 1;
        rotor_rest(&d[j - 1], l[j], rest.twisting[s], kappa_0, &rest.dihedral[k], &rest.ratio[k], &rest.weight[k]);
    }
}

} // namespace ringlet
