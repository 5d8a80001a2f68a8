// A symmetric banded matrix per strand, and its solution by LDL^T: one lane each.
//
// Row r holds its diagonal and the Band - 1 entries to the right of it. 3 unknowns per point, so that a stencil of n
// points needs Band = 3 n. Rows past the last are zero: they spare the solver a special case at the end.
#pragma once

#include "block.hpp"

namespace ringlet {

template <class Real, int Band> struct Banded {
    using L = Lanes<Real>;
    int rows;
    L *entries, *right;

    Banded(Arena &arena, int P)
        : rows(3 * P), entries(arena.take<L>(size_t(rows + Band) * Band)), right(arena.take<L>(rows + Band)) {}

    L *row(int r) { return entries + size_t(r) * Band; }

    void clear() {
        for (int k = 0; k < rows * Band; ++k) entries[k] = L{};
        for (int k = 0; k < rows + Band; ++k) right[k] = L{};
    }

    /// Adds w g g^T, with g on `Points` consecutive points from point i.
    template <int Points> RINGLET_INLINE void add_square(int i, const Vec3<Real> *g, L w) {
        L a[3 * Points];
        for (int k = 0; k < Points; ++k) a[3 * k] = g[k].x, a[3 * k + 1] = g[k].y, a[3 * k + 2] = g[k].z;
        L *to = row(3 * i);
#pragma GCC unroll 16
        for (int r = 0; r < 3 * Points; ++r) {
            L wr = w * a[r];
#pragma GCC unroll 16
            for (int c = r; c < 3 * Points; ++c) to[r * Band + c - r] += wr * a[c];
        }
    }

    /// Adds w times the symmetric 3x3 block (xx, xy, xz, yy, yz, zz) at points i <= j.
    RINGLET_INLINE void add_block(int i, int j, L w, const L (&block)[6]) {
        constexpr int index[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
#pragma GCC unroll 3
        for (int a = 0; a < 3; ++a)
#pragma GCC unroll 3
            for (int c = i == j ? a : 0; c < 3; ++c) row(3 * i + a)[3 * (j - i) + c - a] += w * block[index[a][c]];
    }

    RINGLET_INLINE void add_right(int i, Vec3<Real> value) {
        right[3 * i] += value.x, right[3 * i + 1] += value.y, right[3 * i + 2] += value.z;
    }

    /// Solves rows from `first` on in place: the solution is in `right`. Right-looking LDL^T, fused with the forward
    /// substitution.
    void solve(int first) {
        for (int r = first; r < rows; ++r) {
            L *pivot = row(r), l[Band];
            L inverse = 1 / pivot[0], value = right[r];
#pragma GCC unroll 16
            for (int k = 1; k < Band; ++k) l[k] = pivot[k] * inverse;
#pragma GCC unroll 16
            for (int k = 1; k < Band; ++k) {
                L *below = row(r + k), factor = pivot[k];
#pragma GCC unroll 16
                for (int c = k; c < Band; ++c) below[c - k] -= factor * l[c];
                right[r + k] -= l[k] * value;
            }
#pragma GCC unroll 16
            for (int k = 1; k < Band; ++k) pivot[k] = l[k];
            right[r] = value * inverse;
        }
        for (int r = rows - 1; r >= first; --r) {
            L sum = right[r];
#pragma GCC unroll 16
            for (int k = 1; k < Band; ++k) sum -= row(r)[k] * right[r + k];
            right[r] = sum;
        }
    }

    /// Takes known values of point i out of the system where `held` is 1: its rows become those of the identity.
    void eliminate(int i, L held, Vec3<Real> known) {
        const L value[3] = {held * known.x, held * known.y, held * known.z}, keep = 1 - held;
        for (int a = 0; a < 3; ++a) {
            int r = 3 * i + a;
            for (int k = 1; k < Band; ++k) {
                if (r + k < rows) right[r + k] -= row(r)[k] * value[a];
                row(r)[k] *= keep;
                if (r - k < 0) continue;
                right[r - k] -= row(r - k)[k] * value[a];
                row(r - k)[k] *= keep;
            }
            row(r)[0] = select<Real>(held > 0, splat(Real(1)), row(r)[0]);
            right[r] = select<Real>(held > 0, value[a], right[r]);
        }
    }
};

} // namespace ringlet
