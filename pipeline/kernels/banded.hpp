// A symmetric banded system per strand, added up and eliminated in one sweep from root to tip: one lane each.
//
// A point has 3 unknowns, its velocity, or 4 with one more of its own. `Assembly` adds up stiffness by edges instead of
// points (half of the work: n + 1 points have n edges between them), in a window of the `Span` edges from point i on
// that a term reaches, and makes the rows of point i from it: x_i moves edge i - 1 forwards and edge i backwards.
// `Window` holds what elimination has left for the points from i on. With that the rows of point i are complete: they
// are eliminated (Cholesky, right-looking) and kept as `Pivots`. So neither matrix nor band leaves the L1 cache; what is
// written is the factor, once, and the substitution from the tip reads it once.
#pragma once

#include "block.hpp"

namespace ringlet {

/// Where row `row` of an upper triangle with rows of n, n - 1, ... entries lies: add the column.
constexpr int triangle(int n, int row) { return row * n - row * (row + 1) / 2; }

/// Stiffness by the edges from point i on, `Unknowns` each, of which the first three are the edge's; and the gradient
/// of the energy by the same unknowns.
template <class Real, int Unknowns, int Span> class Assembly {
    using L = Lanes<Real>;

  public:
    static constexpr int Reach = Unknowns * Span, Band = Reach + 3;

    Assembly() {
        for (auto &window : windows_)
            for (L &entry : window) entry = L{};
    }

    /// Entry of the window at column >= row.
    RINGLET_INLINE L &at(int row, int column) { return now_[triangle(Reach, row) + column]; }

    /// The gradient by edge j of the window.
    RINGLET_INLINE Vec3<Real> &edge(int j) { return edge_[j + 1]; }

    /// The gradient by the fourth unknown of edge j of the window.
    RINGLET_INLINE L &fourth(int j) { return fourth_[j]; }

    /// Moves on to the next point.
    RINGLET_INLINE void open() {
        L *last = before_;
        before_ = now_, now_ = last;
        for (int j = 0; j < Span; ++j) edge_[j] = edge_[j + 1];
        edge_[Span] = Vec3<Real>{};
        for (int j = 0; j + 1 < Span; ++j) fourth_[j] = fourth_[j + 1];
        fourth_[Span - 1] = L{};
    }

    /// Adds the squares g g^T of rows over the whole window, and what `add(row, column, sum)` adds to each entry. Comes
    /// once for every point.
    template <int Count, class Add> RINGLET_INLINE void fill(const L (&g)[Count][Reach], const Add &add) {
#pragma GCC unroll 16
        for (int r = 0; r < Reach; ++r)
#pragma GCC unroll 16
            for (int c = r; c < Reach; ++c) {
                L sum = c + Unknowns < Reach ? before_[triangle(Reach, r + Unknowns) + c + Unknowns] : L{};
#pragma GCC unroll 4
                for (int k = 0; k < Count; ++k) sum += g[k][r] * g[k][c];
                add(r, c, sum);
                now_[triangle(Reach, r) + c] = sum;
            }
    }

    /// Row a of the window's first point, entries from the diagonal on; the edge before it is the first of the window
    /// before.
    RINGLET_INLINE void row(int a, L (&entries)[Band]) const {
        L moved[(Span + 1) * Unknowns]; // by the edges from i - 1 on
#pragma GCC unroll 20
        for (int c = 0; c < (Span + 1) * Unknowns; ++c) moved[c] = by_point(a, c);
#pragma GCC unroll 16
        for (int c = a; c < Band; ++c) {
            if (c % Unknowns == 3) entries[c] = moved[c + Unknowns];
            else if (c < Reach) entries[c] = moved[c] - moved[c + Unknowns];
            else entries[c] = moved[c];
        }
    }

    /// What the two edges beside the point pull: the gradient by its place, negative.
    RINGLET_INLINE Vec3<Real> pull() const { return edge_[1] - edge_[0]; }

  private:
    L windows_[2][Reach * (Reach + 1) / 2], *now_ = windows_[0], *before_ = windows_[1];
    Vec3<Real> edge_[Span + 1]{}; // from edge i - 1 on
    L fourth_[Span]{};

    /// Entry between unknowns of the edges from i - 1 on.
    RINGLET_INLINE L entry(int r, int c) const {
        const int row = r < c ? r : c, column = r < c ? c : r;
        if (row >= Unknowns) return now_[triangle(Reach, row - Unknowns) + column - Unknowns];
        return column < Reach ? before_[triangle(Reach, row) + column] : L{};
    }

    /// Row a of the point's matrix by the unknown c of the edges from i - 1 on.
    RINGLET_INLINE L by_point(int a, int c) const {
        if (a == 3) return entry(a + Unknowns, c);
        if (c >= Reach) return -entry(a + Unknowns, c);
        return entry(a, c) - entry(a + Unknowns, c);
    }
};

/// The eliminated rows of one point: entries of the factor above the diagonal, row after row; 1 over those on it; and
/// the right side.
template <class Real, int Unknowns, int Band> struct Pivots {
    using L = Lanes<Real>;

    L factor[triangle(Band - 1, Unknowns) + Unknowns], inverse[Unknowns], right[Unknowns];

    /// Entry at column > row.
    RINGLET_INLINE L &at(int row, int column) { return factor[triangle(Band - 1, row) + column - 1]; }

    /// The unknowns of this point, put before those of the points after it: `known` moves on by one point.
    RINGLET_INLINE void substitute(L (&known)[Band]) {
#pragma GCC unroll 16
        for (int k = Band - 1; k >= Unknowns; --k) known[k] = known[k - Unknowns];
#pragma GCC unroll 4
        for (int a = Unknowns - 1; a >= 0; --a) {
            L sum = right[a];
#pragma GCC unroll 16
            for (int k = Band - 1; k > a; --k) sum -= at(a, k) * known[k];
            known[a] = inverse[a] * sum;
        }
    }
};

/// The rows of one point.
template <class Real, int Unknowns, int Band> struct Rows {
    Lanes<Real> entries[Unknowns][Band], right[Unknowns];
};

/// What elimination has left of the system from point i on, and the rows of point i.
template <class Real, int Unknowns, int Band> class Window {
    using L = Lanes<Real>;
    static constexpr int Left = Band - Unknowns; // unknowns that the points before have touched

  public:
    Rows<Real, Unknowns, Band> rows; // of the point under work

    Window() {
        for (L &entry : left_) entry = L{};
        for (L &entry : right_) entry = L{};
    }

    /// Adds k n (n.x = gap) to the equations of the point.
    RINGLET_INLINE void add_row(Vec3<Real> n, L k, L gap) {
        const L a[3] = {n.x, n.y, n.z};
        for (int r = 0; r < 3; ++r) {
            const L kr = k * a[r];
            rows.right[r] += kr * gap;
            for (int c = r; c < 3; ++c) rows.entries[r][c] += kr * a[c];
        }
    }

    /// The point's rows are complete: adds what elimination has left for them.
    RINGLET_INLINE void complete() {
#pragma GCC unroll 4
        for (int a = 0; a < Unknowns; ++a) {
            rows.right[a] += right_[a];
#pragma GCC unroll 16
            for (int c = a; c < Left; ++c) rows.entries[a][c] += left(a, c);
        }
    }

    /// Takes known values of the point out of the system where `held` is 1: its rows become the identity's.
    RINGLET_INLINE void impose(const L (&held)[Unknowns], const L (&known)[Unknowns]) {
        for (int a = 0; a < Unknowns; ++a) {
            const L value = held[a] * known[a], keep = 1 - held[a];
            for (int k = 0; k < Band; ++k) {
                if (k == a) continue;
                L &entry = k < a ? rows.entries[k][a] : rows.entries[a][k];
                (k < Unknowns ? rows.right[k] : right_[k]) -= entry * value;
                entry *= keep;
            }
            rows.entries[a][a] = select<Real>(held[a] > 0, splat(Real(1)), rows.entries[a][a]);
            rows.right[a] = select<Real>(held[a] > 0, value, rows.right[a]);
        }
    }

    /// Moves on to the next point where every lane holds this one and those before it at known values.
    RINGLET_INLINE void pass(const L (&known)[Unknowns]) {
        for (int k = Unknowns; k < Band; ++k) {
            for (int a = 0; a < Unknowns; ++a) right_[k] -= rows.entries[a][k] * known[a];
            right_[k - Unknowns] = right_[k];
        }
        end();
    }

    /// Eliminates the point's rows and moves on to the next point.
    RINGLET_INLINE void eliminate(Pivots<Real, Unknowns, Band> &to) {
        L factor[Unknowns][Band], value[Unknowns];
#pragma GCC unroll 4
        for (int a = 0; a < Unknowns; ++a) {
            L sum = rows.right[a];
#pragma GCC unroll 4
            for (int b = 0; b < a; ++b) sum -= factor[b][a] * value[b];
#pragma GCC unroll 16
            for (int k = a; k < Band; ++k) {
                factor[a][k] = rows.entries[a][k];
#pragma GCC unroll 4
                for (int b = 0; b < a; ++b) factor[a][k] -= factor[b][a] * factor[b][k];
            }
            const L inverse = inverse_root<Real>(factor[a][a]);
            to.inverse[a] = inverse;
            to.right[a] = value[a] = sum * inverse;
#pragma GCC unroll 16
            for (int k = a + 1; k < Band; ++k) to.at(a, k) = factor[a][k] *= inverse;
        }
        // What is left, seen from the next point
#pragma GCC unroll 16
        for (int r = Unknowns; r < Band; ++r) {
            L sum = right_[r];
#pragma GCC unroll 4
            for (int a = 0; a < Unknowns; ++a) sum -= factor[a][r] * value[a];
            right_[r - Unknowns] = sum;
#pragma GCC unroll 16
            for (int c = r; c < Band; ++c) {
                L entry = c < Left ? left(r, c) : L{};
#pragma GCC unroll 4
                for (int a = 0; a < Unknowns; ++a) entry -= factor[a][r] * factor[a][c];
                left(r - Unknowns, c - Unknowns) = entry;
            }
        }
        end();
    }

  private:
    L left_[Left * (Left + 1) / 2], right_[Band];

    RINGLET_INLINE L &left(int row, int column) { return left_[triangle(Left, row) + column]; }

    /// The unknowns that come in at the end: nothing has touched them yet.
    RINGLET_INLINE void end() {
#pragma GCC unroll 4
        for (int k = Left; k < Band; ++k) right_[k] = L{};
    }
};

} // namespace ringlet
