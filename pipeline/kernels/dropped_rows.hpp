// Rows of contacts taken out of a system that is solved already, without eliminating it again.
//
// Source: Woodbury's formula (Hager, "Updating the inverse of a matrix", 1989). A row is k n n^T in the matrix A and
// beta n in the right side, beta = k (n.v - gap/dt), k = theta kRow. With N the normals n of the dropped rows, at their
// points, and u0 the solution with them,
//     u = u0 + A^-1 N c,   (1/k - N^T A^-1 N) c = N^T u0 - beta/k
// A = L L^T is eliminated from the root on: L^-1 N begins at the first dropped row, N^T A^-1 N are products of its columns,
// and one substitution from the eliminated right side plus L^-1 N c gives u. That is a fifth of a solve for one row.
// Rows are numbered from the root in every lane, those of a second release after those of the first; a lane with fewer
// has zeros for the others, which change nothing in it.
#pragma once

#include "banded.hpp"
#include "contact.hpp"

namespace ringlet {

template <class Real, int Unknowns, int Reach> class DroppedRows {
    using L = Lanes<Real>;
    using M = Mask<Real>;
    static constexpr int Most = kReleases * kDroppedMost, R = Reach - Unknowns;

  public:
    Vec3<Real> *solved; // the solution with all rows

    DroppedRows(Arena &arena, int P)
        : solved(arena.take<Vec3<Real>>(P)), columns_(arena.take<Columns>(P)), state_(arena.take<State>(P > 0 ? 1 : 0)) {}

    /// Finds c for the rows that these lanes have dropped, of which those of release `release` (1, 2, ...) are new.
    void reduce(const Block<Real> &b, const Contacts<Real> &contacts, const Vec3<Real> *v, Real dt, int release, M lanes,
                Pivots<Real, Unknowns, Reach> *pivots) {
        if (release == 1) count_ = 0;
        const int known = count_;
        L numbers = splat(Real(known));
        for (int i = b.first; i < b.P; ++i) {
            const M here = lanes & (contacts.dropped[i] == Real(release));
            if (any<Real>(here))
                open(i, contacts.n[i], dot(contacts.n[i], solved[i] - v[i]) + Real(1 / dt) * contacts.gap[i], here, numbers);
            if (count_ > known) pass(b, i, known, pivots[i]);
        }
        solve(1 / (b.theta * Real(kRow)));
    }

    /// The eliminated right side at point i: that of the solution with all rows, and what takes the dropped ones out.
    RINGLET_INLINE void add(int i, const L (&before)[Unknowns], L (&right)[Unknowns]) const {
        for (int a = 0; a < Unknowns; ++a) right[a] = before[a];
        for (int q = 0; q < count_; ++q)
            if (i >= first_[q])
                for (int a = 0; a < Unknowns; ++a) right[a] += state_->c[q] * columns_[i].of[q][a];
    }

  private:
    struct Columns {
        L of[Most][Unknowns]; // L^-1 N at a point
    };
    struct State {
        L point[Most][3], edges[Most][R];                // what is left of N by the next point and the edges
        L products[Most][Most], right[Most];             // N^T A^-1 N; the right side of c
        L factor[Most][Most], c[Most];
    };

    Columns *columns_;
    State *state_;
    int count_ = 0, first_[Most]; // columns in use; their first points that are not 0 in all lanes

    /// Begins a column at point i in the lanes `here`, with n and its right side.
    void open(int i, Vec3<Real> n, L value, M here, L &numbers) {
        State &s = *state_;
        for (int q = 0; q < Most; ++q) {
            const M mine = here & (numbers == Real(q));
            if (!any<Real>(mine)) continue;
            if (q == count_) {
                first_[count_++] = i;
                for (L &entry : s.point[q]) entry = L{};
                for (L &entry : s.edges[q]) entry = L{};
                for (L &entry : s.products[q]) entry = L{};
                s.right[q] = L{};
            }
            const L entries[3] = {n.x, n.y, n.z};
            for (int k = 0; k < 3; ++k) s.point[q][k] += select<Real>(mine, entries[k], L{});
            s.right[q] = select<Real>(mine, value, s.right[q]);
        }
        numbers = select<Real>(here, numbers + 1, numbers);
    }

    /// Takes the columns from `begin` on past point i.
    RINGLET_INLINE void pass(const Block<Real> &b, int i, int begin, Pivots<Real, Unknowns, Reach> &pivots) {
        M held{}, fixed{};
        if (b.held_inside) {
            held = ~(b.free[i] > 0);
            if (i + 1 < b.P) fixed = ~(b.turns[i] > 0);
        }
        State &s = *state_;
        auto &of = columns_[i].of;
        for (int q = begin; q < count_; ++q) {
            pivots.reduce(held, fixed, s.point[q], s.edges[q], of[q]);
            for (int p = 0; p <= q; ++p) {
                if (i < first_[p]) continue;
                L sum = s.products[q][p];
                for (int a = 0; a < Unknowns; ++a) sum += of[p][a] * of[q][a];
                s.products[q][p] = sum;
            }
        }
    }

    /// Solves for c by Cholesky's factor; 1/k is `diagonal`.
    void solve(L diagonal) {
        const L least = Real(0.25) * diagonal * diagonal; // below the smallest mass of a point, which only rounding does
        State &s = *state_;
        for (int q = 0; q < count_; ++q) {
            L value = s.right[q];
            for (int p = 0; p <= q; ++p) {
                L entry = (p == q ? diagonal : L{}) - s.products[q][p];
                for (int k = 0; k < p; ++k) entry -= s.factor[q][k] * s.factor[p][k];
                if (p == q) s.factor[q][q] = inverse_root<Real>(maximum<Real>(entry, least)); // 1 over the diagonal
                else s.factor[q][p] = entry * s.factor[p][p], value -= s.factor[q][p] * s.c[p];
            }
            s.c[q] = value * s.factor[q][q];
        }
        for (int q = count_ - 1; q >= 0; --q) {
            for (int p = q + 1; p < count_; ++p) s.c[q] -= s.factor[p][q] * s.c[p];
            s.c[q] = s.c[q] * s.factor[q][q];
        }
    }
};

} // namespace ringlet
