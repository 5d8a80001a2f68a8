// Curvature and torsion of strands by the two forms of the lecture, as plain operators.
//
// Source: KIST lecture "Hair Simulation 2" (Physically Based Animation, 2008). "general" is for unequal spacing, "equal"
// what its "Simplification" slide leaves at equal spacing dl, with e = x_{i+1} - x_{i-1}, c = x_{i+1} - 2 x_i + x_{i-1}:
//     kappa = 2 |c| / (dl |e|),    tau = e.(c x q) / (2 dl |c|^2),    q = c_{i+1}/|e_{i+1}| - c_{i-1}/|e_{i-1}|
// General: unit edges t- and t+ beside the point, segment lengths h- and h+, dl = (h- + h+)/2,
//     k = 2 (t+ - t-) / (dl |t+ + t-|),    T = (t+ + t-)/|t+ + t-|,    kappa = |k|
//     tau = T.(k x k') / |k|^2,    k' = (k_{i+1} h-/h+ - k_{i-1} h+/h-) / (h- + h+)  + a multiple of k
// which is the equal form when h- = h+ (test_general_form_equals_the_simple_one_at_equal_spacing).
#pragma once

#include "rest.hpp"

namespace ringlet {

enum class Form { equal, general };

inline Vec point(const double *strand, int i) { return {strand[3 * i], strand[3 * i + 1], strand[3 * i + 2]}; }

/// Vector of curvature k at point i (at equal spacing dl for every point), and the unit tangent T.
inline Vec curvature_vector(const double *strand, int i, Form form, double dl, Vec *T) {
    Vec before = point(strand, i) - point(strand, i - 1), after = point(strand, i + 1) - point(strand, i);
    if (form == Form::general) {
        double h0 = norm(before), h1 = norm(after);
        before = (1 / h0) * before, after = (1 / h1) * after;
        dl = 0.5 * (h0 + h1);
    }
    Vec e = after + before;
    double length = norm(e);
    *T = (1 / length) * e;
    return (2 / (dl * length)) * (after - before);
}

inline double mean_spacing(const double *strand, int P) {
    double length = 0;
    for (int j = 0; j < P - 1; ++j) length += norm(point(strand, j + 1) - point(strand, j));
    return length / (P - 1);
}

/// kappa at points 1 .. P-2 of a strand.
inline void curvature(const double *strand, int P, Form form, double *kappa) {
    const double dl = mean_spacing(strand, P);
    Vec T;
    for (int i = 1; i < P - 1; ++i) kappa[i - 1] = norm(curvature_vector(strand, i, form, dl, &T));
}

/// tau at points 2 .. P-3 of a strand.
inline void torsion(const double *strand, int P, Form form, double *tau) {
    const double dl = mean_spacing(strand, P);
    for (int i = 2; i < P - 2; ++i) {
        Vec T, other;
        Vec k = curvature_vector(strand, i, form, dl, &T);
        Vec before = curvature_vector(strand, i - 1, form, dl, &other);
        Vec after = curvature_vector(strand, i + 1, form, dl, &other);
        double h0 = dl, h1 = dl;
        if (form == Form::general) {
            h0 = norm(point(strand, i) - point(strand, i - 1));
            h1 = norm(point(strand, i + 1) - point(strand, i));
        }
        Vec slope = (1 / (h0 + h1)) * ((h0 / h1) * after - (h1 / h0) * before);
        tau[i - 2] = dot(T, cross(k, slope)) / dot(k, k);
    }
}

} // namespace ringlet
