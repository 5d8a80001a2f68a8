// A symmetric banded system per strand, added up and eliminated in one sweep from root to tip: one lane each.
//
// `Window` holds the part of the matrix that is under work: `Band` unknowns, those of point i first, then those of the
// points after it as far as a term that begins at point i can reach; `Unknowns` of them belong to one point. When every
// term that touches point i has been added, its rows are complete: they are eliminated (LDL^T, right-looking), kept as
// `Pivots`, and what is left becomes the window of point i + 1. So the matrix itself never leaves the L1 cache: what is
// written is the factor, once, and the substitution from the tip reads it once.
#pragma once

#include "block.hpp"

namespace ringlet {

/// The eliminated rows of one point: L above the diagonal, row after row, and the right side over the pivots.
template <class Real, int Unknowns, int Band> struct Pivots {
    using L = Lanes<Real>;
    static constexpr int start(int a) { return a * Band - a * (a + 1) / 2 - a - 1; } // + column: where row a lies

    L factor[Unknowns * Band - Unknowns * (Unknowns + 1) / 2], right[Unknowns];

    RINGLET_INLINE L &at(int a, int column) { return factor[start(a) + column]; }

    /// The unknowns of this point, put before those of the points after it: `known` moves on by one point.
    RINGLET_INLINE void substitute(L (&known)[Band]) {
#pragma GCC unroll 16
        for (int k = Band - 1; k >= Unknowns; --k) known[k] = known[k - Unknowns];
#pragma GCC unroll 4
        for (int a = Unknowns - 1; a >= 0; --a) {
            L sum = right[a];
#pragma GCC unroll 16
            for (int k = Band - 1; k > a; --k) sum -= at(a, k) * known[k];
            known[a] = sum;
        }
    }
};

template <class Real, int Unknowns_, int Band_> struct Window {
    using L = Lanes<Real>;
    static constexpr int Unknowns = Unknowns_, Band = Band_;
    static constexpr int start(int row) { return row * Band - row * (row + 1) / 2; } // + column: where the row lies

    L entries[Band * (Band + 1) / 2], right[Band]; // the upper triangle, row after row

    RINGLET_INLINE L &at(int row, int column) { return entries[start(row) + column]; }

    void clear() {
        for (L &entry : entries) entry = L{};
        for (L &entry : right) entry = L{};
    }

    /// Adds g (w g)^T, with g on the first `Count` unknowns.
    template <int Count> RINGLET_INLINE void add_square(const L (&g)[Count], L w) {
#pragma GCC unroll 16
        for (int r = 0; r < Count; ++r) {
            L wr = w * g[r];
#pragma GCC unroll 16
            for (int c = r; c < Count; ++c) at(r, c) += wr * g[c];
        }
    }

    /// Adds w (g g^T + h h^T), with g and h on the first `Count` unknowns.
    template <int Count> RINGLET_INLINE void add_squares(const L (&g)[Count], const L (&h)[Count], L w) {
#pragma GCC unroll 16
        for (int r = 0; r < Count; ++r) {
            L wg = w * g[r], wh = w * h[r];
#pragma GCC unroll 16
            for (int c = r; c < Count; ++c) at(r, c) += wg * g[c] + wh * h[c];
        }
    }

    /// Adds w times the symmetric 3x3 block (xx, xy, xz, yy, yz, zz) at points p <= q, counted from the window's first.
    template <int p, int q> RINGLET_INLINE void add_block(L w, const L (&block)[6]) {
        constexpr int index[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
#pragma GCC unroll 3
        for (int a = 0; a < 3; ++a)
#pragma GCC unroll 3
            for (int c = p == q ? a : 0; c < 3; ++c) at(Unknowns * p + a, Unknowns * q + c) += w * block[index[a][c]];
    }

    /// Adds to the right side of the first point.
    RINGLET_INLINE void add_right(Vec3<Real> value) { right[0] += value.x, right[1] += value.y, right[2] += value.z; }

    /// Takes known values of the first point out of the system where `held` is 1: its rows become the identity's.
    void impose(const L (&held)[Unknowns], const L (&known)[Unknowns]) {
        for (int a = 0; a < Unknowns; ++a) {
            const L value = select<Real>(held[a] > 0, known[a], L{}), keep = 1 - held[a];
            for (int k = 0; k < Band; ++k) {
                if (k == a) continue;
                L &entry = k < a ? at(k, a) : at(a, k);
                right[k] -= entry * value;
                entry *= keep;
            }
            at(a, a) = select<Real>(held[a] > 0, splat(Real(1)), at(a, a));
            right[a] = select<Real>(held[a] > 0, value, right[a]);
        }
    }

    /// Moves on to the next point where every lane holds the first one at known values: nothing to eliminate.
    void pass(const L (&known)[Unknowns]) {
        for (int a = 0; a < Unknowns; ++a)
            for (int k = Unknowns; k < Band; ++k) right[k] -= at(a, k) * known[a];
        for (int r = Unknowns; r < Band; ++r) {
            for (int c = r; c < Band; ++c) at(r - Unknowns, c - Unknowns) = at(r, c);
            right[r - Unknowns] = right[r];
        }
        open();
    }

    /// Eliminates the first point's rows and moves on to the next point.
    RINGLET_INLINE void eliminate(Pivots<Real, Unknowns, Band> &to) {
        L d[Unknowns][Band], value[Unknowns];
#pragma GCC unroll 4
        for (int a = 0; a < Unknowns; ++a) {
            value[a] = right[a];
#pragma GCC unroll 4
            for (int b = 0; b < a; ++b) value[a] -= to.at(b, a) * value[b];
#pragma GCC unroll 16
            for (int k = a; k < Band; ++k) {
                d[a][k] = at(a, k);
#pragma GCC unroll 4
                for (int b = 0; b < a; ++b) d[a][k] -= d[b][a] * to.at(b, k);
            }
            const L inverse = reciprocal<Real>(d[a][a]);
            to.right[a] = value[a] * inverse;
#pragma GCC unroll 16
            for (int k = a + 1; k < Band; ++k) to.at(a, k) = d[a][k] * inverse;
        }
        // What is left, moved to the window of the next point
#pragma GCC unroll 16
        for (int r = Unknowns; r < Band; ++r) {
            L sum = right[r];
#pragma GCC unroll 4
            for (int a = 0; a < Unknowns; ++a) sum -= to.at(a, r) * value[a];
            right[r - Unknowns] = sum;
#pragma GCC unroll 16
            for (int c = r; c < Band; ++c) {
                L entry = at(r, c);
#pragma GCC unroll 4
                for (int a = 0; a < Unknowns; ++a) entry -= d[a][r] * to.at(a, c);
                at(r - Unknowns, c - Unknowns) = entry;
            }
        }
        open();
    }

  private:
    /// The unknowns that enter the window at its end: nothing has been added to them yet.
    RINGLET_INLINE void open() {
#pragma GCC unroll 16
        for (int r = 0; r < Band; ++r)
#pragma GCC unroll 4
            for (int c = r < Band - Unknowns ? Band - Unknowns : r; c < Band; ++c) at(r, c) = L{};
#pragma GCC unroll 4
        for (int r = Band - Unknowns; r < Band; ++r) right[r] = L{};
    }
};

} // namespace ringlet
