// Length relaxation: moves points until every segment has its rest length ("rectify the length every time step").
//
// Source: KIST lecture "Hair Simulation 2" (2008) for "sweep", successive relaxation from root to tip; step d3 of
// docs/physics.md for "newton", one Newton step of C_j = (|d|^2 / l^2 - 1) / 2 = 0 at a time, a
// tridiagonal system per strand. Both move a point through its mobility w P, P = I - a n n^T where it touches the head,
// and so conserve the momentum of the free points. Notation: d edges (not unit) here, lambda multipliers.
#pragma once

#include "block.hpp"
#include "contact.hpp"

namespace ringlet {

inline constexpr int kNewtonRounds = 10, kSweepRounds = 5000;
inline constexpr double kShrink = 0.98; // in the matrix P takes 0.98 a: an edge along n would make it singular
/// A pivot below this part of its diagonal has no meaning: the strand is straight between two held points (bow.hpp).
inline constexpr double kSingular = 1e-5;

template <class Real> struct Lengths {
    using L = Lanes<Real>;
    const L none = splat(Real(0)), one = splat(Real(1));
    Vec3<Real> *d;
    L *inverse, *upper, *right; // of the eliminated tridiagonal matrix
    L *lambda;                  // multipliers of all rounds: x_{j+1} += w lambda d / l^2

    Lengths(Arena &arena, int P) : d(arena.take<Vec3<Real>>(P)) {
        for (auto **array : {&inverse, &upper, &right, &lambda}) *array = arena.take<L>(P);
    }

    void clear(int P) {
        for (int j = 0; j < P; ++j) lambda[j] = none;
    }

    /// Edges, and the worst relative length error of each lane. Segments between held points do not count.
    L strain(const Block<Real> &b, const Vec3<Real> *x) {
        L worst = none;
        for (int j = std::max(b.first - 1, 0); j < b.P - 1; ++j) {
            d[j] = x[j + 1] - x[j];
            L C = Real(0.5) * (dot(d[j], d[j]) * (b.inverse_l[j] * b.inverse_l[j]) - 1);
            C = select<Real>(b.w[j] + b.w[j + 1] > none, C, none);
            worst = maximum<Real>(maximum<Real>(C, -C), worst);
        }
        return worst;
    }

    /// One Newton step for the busy lanes, from the edges of `strain`.
    void newton(const Block<Real> &b, Contacts<Real> &contacts, Mask<Real> busy, Vec3<Real> *x) {
        const int begin = std::max(b.first - 1, 0), end = b.P - 1;
        // Eliminate from the root
        L across = contacts.a[begin] * dot(contacts.n[begin], d[begin]); // n.d of edge j at its root end
        L coupling = none;                                               // entry (j-1, j)
        for (int j = begin; j < end; ++j) {
            L il2 = b.inverse_l[j] * b.inverse_l[j], dd = dot(d[j], d[j]);
            L ahead = contacts.a[j + 1] * dot(contacts.n[j + 1], d[j]);
            L diagonal = il2 * il2 * (b.w[j] * (dd - Real(kShrink) * across * across) +
                                      b.w[j + 1] * (dd - Real(kShrink) * ahead * ahead));
            right[j] = Real(0.5) * (1 - dd * il2);
            const L least = Real(kSingular) * diagonal;
            if (j > begin) {
                L factor = coupling * inverse[j - 1];
                diagonal -= factor * coupling;
                right[j] -= factor * right[j - 1];
            }
            Mask<Real> fixed = ~(diagonal > least); // 0 between two held points
            inverse[j] = select<Real>(fixed, none, reciprocal<Real>(diagonal));
            if (j + 1 == end) break;
            across = contacts.a[j + 1] * dot(contacts.n[j + 1], d[j + 1]);
            coupling = -b.w[j + 1] * il2 * (b.inverse_l[j + 1] * b.inverse_l[j + 1]) *
                       (dot(d[j], d[j + 1]) - Real(kShrink) * ahead * across);
            upper[j] = coupling;
        }
        // Substitute from the tip, moving points as their two multipliers become known
        L after = none;
        Vec3<Real> pull{};
        for (int j = end - 1; j >= begin; --j) {
            L value = right[j];
            if (j + 1 < end) value -= upper[j] * after;
            after = value * inverse[j];
            L applied = select<Real>(busy, after, none);
            lambda[j] += applied;
            Vec3<Real> push = (applied * (b.inverse_l[j] * b.inverse_l[j])) * d[j];
            move(b, contacts, j + 1, push - pull, x);
            pull = push;
        }
        if (begin == 0) move(b, contacts, 0, -pull, x);
    }

    /// One sweep from root to tip for the busy lanes: each segment in turn takes its length by moving its two ends.
    void sweep(const Block<Real> &b, Contacts<Real> &contacts, Mask<Real> busy, Vec3<Real> *x) {
        for (int j = std::max(b.first - 1, 0); j < b.P - 1; ++j) {
            Vec3<Real> edge = x[j + 1] - x[j];
            L ll = dot(edge, edge), l = square_root<Real>(ll);
            L n0 = contacts.a[j] * dot(contacts.n[j], edge), n1 = contacts.a[j + 1] * dot(contacts.n[j + 1], edge);
            L mobility = b.w[j] * (1 - Real(kShrink) * n0 * n0 / ll) + b.w[j + 1] * (1 - Real(kShrink) * n1 * n1 / ll);
            L part = select<Real>(busy & (mobility > none), (b.l[j] / l - 1) / mobility, none);
            lambda[j] += part * b.l[j] * b.l[j];
            move(b, contacts, j, -part * edge, x);
            move(b, contacts, j + 1, part * edge, x);
        }
    }

  private:
    /// Moves point i by w P D; where that would pull the contact open beyond what it is worth, the contact lets go.
    RINGLET_INLINE void move(const Block<Real> &b, Contacts<Real> &contacts, int i, Vec3<Real> D, Vec3<Real> *x) {
        L &a = contacts.a[i], &s = contacts.s[i];
        D = b.w[i] * D;
        L removed = a * dot(D, contacts.n[i]);
        s -= removed;
        Mask<Real> pulls = (s < none) & (a > none);
        L returned = select<Real>(pulls, -s, none);
        s += returned;
        a = select<Real>(pulls, none, a);
        x[i] = x[i] + D - (removed - returned) * contacts.n[i];
    }
};

} // namespace ringlet
