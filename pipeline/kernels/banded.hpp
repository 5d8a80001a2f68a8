// The system of a step per strand, added up and eliminated in one sweep from root to tip: one lane each.
//
// Unknowns are, at point i on the way: x_i, and from there on edges, E_j = e_j = x_{j+1} - x_j and perhaps one more
// unknown of the edge. All stiffness is by edges; masses, air and contacts are by points. `Window` holds what is left of
// the system by x_i and by the edges that terms before have reached. One step of the sweep
//     adds what begins at point i:  mass M by x_i, rows g (stiffness g g^T) and blocks by the edges from E_i on,
//     puts x_i = x_{i+1} - e_i:     (e, e) += M - X - X^T,  (x', e) = X - M,  (x', x') = M,     X the part (x, e)
//     eliminates E_i:               Cholesky, right-looking; its rows, the factors f, are kept as `Pivots`
// so that every entry is read and written once: W <- W + sum g g^T - sum f f^T. By points a term would reach one point
// more, half as many entries again, and stiff edges would be differences of large numbers.
// The window and the rows lie in memory on purpose: they are more than the processor has registers, and every spill would
// be a store. What is read for a column serves several rows.
#pragma once

#include "block.hpp"

namespace ringlet {

/// Where row `row` of an upper triangle with rows of n, n - 1, ... entries lies: add the column.
constexpr int triangle(int n, int row) { return row * n - row * (row + 1) / 2; }

/// The eliminated rows of one edge, over its own unknowns, x_{i+1} and the edges after it: entries of the factor above the
/// diagonal, row after row; 1 over those on it; and the right side.
template <class Real, int Unknowns, int Reach> struct Pivots {
    using L = Lanes<Real>;
    static constexpr int Band = Reach + 3;

    L factor[triangle(Band - 1, Unknowns) + Unknowns], inverse[Unknowns], right[Unknowns];

    /// Entry at column > row.
    RINGLET_INLINE L &at(int row, int column) { return factor[triangle(Band - 1, row) + column - 1]; }

    /// Of the unknowns `known` = (x_{i+1}, E_{i+1}, ...) makes (x_i, E_i, ...), for the eliminated right side `from`.
    RINGLET_INLINE void substitute(const L (&from)[Unknowns], L (&known)[Reach + 3 - Unknowns]) {
        constexpr int rest = Reach + 3 - Unknowns;
        L own[Unknowns];
#pragma GCC unroll 4
        for (int a = Unknowns - 1; a >= 0; --a) {
            L sum = from[a];
#pragma GCC unroll 16
            for (int k = rest - 1; k >= 0; --k) sum -= at(a, Unknowns + k) * known[k];
#pragma GCC unroll 4
            for (int k = Unknowns - 1; k > a; --k) sum -= at(a, k) * own[k];
            own[a] = inverse[a] * sum;
        }
#pragma GCC unroll 16
        for (int k = rest - 1; k >= 3 + Unknowns; --k) known[k] = known[k - Unknowns];
#pragma GCC unroll 4
        for (int k = 0; k < Unknowns && 3 + k < rest; ++k) known[3 + k] = own[k];
#pragma GCC unroll 4
        for (int k = 0; k < 3; ++k) known[k] -= own[k];
    }

    /// Eliminates E_i from another right side, `point` by x_i and `edges` by E_i and those after it: gives its part of the
    /// eliminated right side, and leaves what is seen from the next point. `held`, `fixed`: the point and the edge's
    /// fourth unknown are known.
    RINGLET_INLINE void reduce(Mask<Real> held, Mask<Real> fixed, L (&point)[3], L (&edges)[Reach - Unknowns],
                               L (&own)[Unknowns]) {
        constexpr int R = Reach - Unknowns;
#pragma GCC unroll 4
        for (int a = 0; a < Unknowns; ++a) {
            L value = a < 3 ? edges[a] - point[a] : edges[a];
            for (int k = 0; k < a; ++k) value -= at(k, a) * own[k];
            own[a] = select<Real>(a < 3 ? held : fixed, L{}, inverse[a] * value);
        }
#pragma GCC unroll 3
        for (int k = 0; k < 3; ++k) {
            point[k] = select<Real>(held, edges[k], point[k]); // x_{i+1} takes the place of e_i
            for (int a = 0; a < Unknowns; ++a) point[k] -= at(a, Unknowns + k) * own[a];
        }
#pragma GCC unroll 16
        for (int c = Unknowns; c < Reach; ++c) {
            L value = c < R ? edges[c] : L{};
            for (int a = 0; a < Unknowns; ++a) value -= at(a, 3 + c) * own[a];
            edges[c - Unknowns] = value;
        }
    }
};

/// Which unknowns of point i and its edge are held (1), and their values: those of the point and the edge's fourth.
template <class Real> struct Held {
    Lanes<Real> point, fourth, x[3], s;
};

/// What elimination has left of the system from point i on. What begins at point i comes as
///     rows g, whose squares are added;  `add(row, column, sum)`, which adds the blocks' entry at column >= row;
///     by_edge, the right side by the edges' unknowns;  mass and by_point, matrix (xx, xy, xz, yy, yz, zz) and right side by x_i
template <class Real, int Unknowns, int Reach> class Window {
    using L = Lanes<Real>;
    static constexpr int Band = Reach + 3;
    static constexpr int R = Reach - Unknowns; // unknowns of edges that terms before have reached
    static constexpr int kRows = Unknowns == 3 ? 3 : 2; // so many rows at a time fit the registers
    using Edge = Pivots<Real, Unknowns, Reach>;

  public:
    explicit Window(Arena &arena)
        : xx_(arena.take<L>(6)), xe_(arena.take<L>(3 * R)), ee_(arena.take<L>(R * (R + 1) / 2)), x_(arena.take<L>(3)),
          e_(arena.take<L>(R)) {}

    /// Nothing is touched yet.
    void clear() {
        for (int k = 0; k < 6; ++k) xx_[k] = L{};
        for (int k = 0; k < 3; ++k) x_[k] = L{};
        for (int k = 0; k < 3 * R; ++k) xe_[k] = L{};
        for (int k = 0; k < R * (R + 1) / 2; ++k) ee_[k] = L{};
        for (int k = 0; k < R; ++k) e_[k] = L{};
    }

    /// What is left at column >= row, by unknowns of the edges; and their right side.
    RINGLET_INLINE L &left(int row, int column) { return ee_[triangle(R, row) + column]; }
    RINGLET_INLINE L &right(int row) { return e_[row]; }

    /// Eliminates E_i and moves on to the next point.
    template <class Terms>
    RINGLET_INLINE void eliminate(const Terms &terms, const L (&mass)[6], const L (&by_point)[3], Edge &to) {
        L M[6], b[3];
        for (int k = 0; k < 6; ++k) M[k] = mass[k] + xx_[k];
        for (int k = 0; k < 3; ++k) b[k] = by_point[k] + x_[k];
#pragma GCC unroll 4
        for (int a = 0; a < Unknowns; a += 2) {
            L rows[2][Band], value[2];
            own_rows(a, terms, M, b, to, rows, value);
            finish_row(a, rows[0], value[0], to);
            if (a + 1 == Unknowns) break;
            const L factor = to.at(a, a + 1);
#pragma GCC unroll 16
            for (int c = a + 1; c < Band; ++c) rows[1][c] -= factor * to.at(a, c);
            finish_row(a + 1, rows[1], value[1] - factor * to.right[a], to);
        }
        move_on(terms, M, b, to);
    }

    /// The same where some lanes hold the point or the fourth unknown of its edge. Few points do: no care for speed.
    template <class Terms>
    __attribute__((noinline)) void eliminate_held(const Terms &terms, const L (&mass)[6], const L (&by_point)[3],
                                                  const Held<Real> &known, Edge &to) {
        Whole whole;
        expand(terms, mass, by_point, whole);
        const Mask<Real> held = known.point > 0;
        L rows[Band][Band], value[Band];
        for (int r = 0; r < Band; ++r) {
            for (int c = r; c < Band; ++c) rows[r][c] = select<Real>(held, whole.given_point(r, c), whole.free_point(r, c));
            value[r] = select<Real>(held, whole.given_point(r, known.x), whole.free_point(r));
        }
        if constexpr (Unknowns == 4) impose_fourth(known, rows, value);
        eliminate_whole(rows, value, to);
        for (int a = 0; a < 3; ++a) { // e_i = x_{i+1} - x_i
            to.right[a] = select<Real>(held, -known.x[a], to.right[a]);
            to.at(a, Unknowns + a) = select<Real>(held, splat(Real(-1)), to.at(a, Unknowns + a));
        }
        keep(rows, value);
    }

    /// Moves on to the next point where every lane holds this one, the next one and the edge between; `edge` are the
    /// values of E_i.
    template <class Terms>
    __attribute__((noinline)) void pass(const Terms &terms, const L (&point)[3], const L (&edge)[Unknowns]) {
        Whole whole;
        const L massless[6] = {}, free[3] = {};
        expand(terms, massless, free, whole);
        clear();
        for (int r = Unknowns; r < Reach; ++r) {
            L value = whole.b[r];
            for (int a = 0; a < Unknowns; ++a) value -= whole.A[a][r] * edge[a];
            for (int k = 0; k < 3; ++k) value -= whole.X[k][r] * point[k];
            e_[r - Unknowns] = value;
            for (int c = r; c < Reach; ++c) left(r - Unknowns, c - Unknowns) = whole.A[r][c];
        }
    }

  private:
    L *xx_, *xe_, *ee_, *x_, *e_; // matrix by x_i, between it and the edges, by the edges; right sides

    RINGLET_INLINE L &xe(int row, int column) { return xe_[row * R + column]; }

    static constexpr int of_point(int r, int c) { return r < c ? triangle(3, r) + c : triangle(3, c) + r; }

    /// The entry by unknowns of the edges at column >= row; `by` and `column` are columns r and c of g.
    template <class Terms, int Count>
    RINGLET_INLINE L complete(int r, int c, const L (&by)[Count], const L (&column)[Count], const Terms &terms) {
        L sum = by[0] * column[0];
#pragma GCC unroll 4
        for (int k = 1; k < Count; ++k)
            if (c < Terms::length(k)) sum += by[k] * column[k];
        terms.add(r, c, sum);
        return c < R ? sum + left(r, c) : sum;
    }

    /// Column c of the rows g, as far as they reach.
    template <class Terms, int Count> RINGLET_INLINE static void read_column(const Terms &terms, int c, L (&column)[Count]) {
#pragma GCC unroll 4
        for (int k = 0; k < Count; ++k)
            column[k] = c < Terms::length(k) ? terms.g[k][c] : L{};
    }

    /// Rows a and a + 1 of E_i with x_i = x_{i+1} - e_i, after the rows before a are eliminated: two at a time, so that
    /// what is read for a column serves both.
    template <class Terms>
    RINGLET_INLINE void own_rows(int a, const Terms &terms, const L (&M)[6], const L (&b)[3], Edge &to, L (&rows)[2][Band],
                                 L (&value)[2]) {
        constexpr int Count = Terms::Count;
        L by[2][Count], factor[2][Unknowns];
        for (int p = 0; p < 2 && a + p < Unknowns; ++p) {
            read_column(terms, a + p, by[p]);
            value[p] = e_[a + p] + terms.by_edge[a + p];
            if (a + p < 3) value[p] -= b[a + p];
            for (int k = 0; k < a; ++k) factor[p][k] = to.at(k, a + p), value[p] -= factor[p][k] * to.right[k];
        }
#pragma GCC unroll 16
        for (int c = a; c < Band; ++c) {
            const bool by_x = c >= Unknowns && c < Unknowns + 3;
            const int j = c < Unknowns ? c : c - 3;
            L column[Count], before[Unknowns];
            if (!by_x)
                read_column(terms, j, column);
            for (int k = 0; k < a; ++k) before[k] = to.at(k, c);
#pragma GCC unroll 2
            for (int p = 0; p < 2; ++p) {
                const int r = a + p;
                if (r >= Unknowns || c < r) continue;
                L entry;
                if (by_x) {
                    entry = xe(c - Unknowns, r);
                    if (r < 3) entry -= M[of_point(r, c - Unknowns)];
                } else {
                    entry = complete(r, j, by[p], column, terms);
                    if (r < 3 && j < 3) entry += M[of_point(r, j)] - xe(j, r);
                    if (r < 3 && j < R) entry -= xe(r, j);
                }
                for (int k = 0; k < a; ++k) entry -= factor[p][k] * before[k];
                rows[p][c] = entry;
            }
        }
    }

    /// Takes a complete row into the factor.
    RINGLET_INLINE void finish_row(int a, const L (&row)[Band], L value, Edge &to) {
        const L inverse = inverse_root<Real>(row[a]);
        to.inverse[a] = inverse;
        to.right[a] = value * inverse;
#pragma GCC unroll 16
        for (int c = a + 1; c < Band; ++c) to.at(a, c) = row[c] * inverse;
    }

    /// What is left after E_i, seen from the next point.
    template <class Terms> RINGLET_INLINE void move_on(const Terms &terms, const L (&M)[6], const L (&b)[3], Edge &to) {
        L factor[3][Unknowns]; // copies: stores to the window cannot change them
#pragma GCC unroll 3
        for (int k = 0; k < 3; ++k) {
            L value = b[k];
            for (int a = 0; a < Unknowns; ++a) factor[k][a] = to.at(a, Unknowns + k), value -= factor[k][a] * to.right[a];
            x_[k] = value;
        }
#pragma GCC unroll 3
        for (int k = 0; k < 3; ++k)
#pragma GCC unroll 3
            for (int c = k; c < 3; ++c) {
                L entry = M[of_point(k, c)];
                for (int a = 0; a < Unknowns; ++a) entry -= factor[k][a] * factor[c][a];
                xx_[of_point(k, c)] = entry;
            }
#pragma GCC unroll 16
        for (int c = Unknowns; c < Reach; ++c) {
            L column[Unknowns];
            for (int a = 0; a < Unknowns; ++a) column[a] = to.at(a, 3 + c);
#pragma GCC unroll 3
            for (int k = 0; k < 3; ++k) {
                L entry = c < R ? xe(k, c) : L{};
                for (int a = 0; a < Unknowns; ++a) entry -= factor[k][a] * column[a];
                xe(k, c - Unknowns) = entry;
            }
        }
#pragma GCC unroll 16
        for (int r = Unknowns; r < Reach; r += kRows) move_rows(r, terms, to);
    }

    /// Rows r to r + kRows - 1 of it.
    template <class Terms> RINGLET_INLINE void move_rows(int r, const Terms &terms, Edge &to) {
        constexpr int Count = Terms::Count;
        L by[kRows][Count], factor[kRows][Unknowns];
#pragma GCC unroll 3
        for (int p = 0; p < kRows; ++p) {
            read_column(terms, r + p, by[p]);
            L value = terms.by_edge[r + p];
            if (r + p < R) value += e_[r + p];
            for (int a = 0; a < Unknowns; ++a)
                factor[p][a] = to.at(a, 3 + r + p), value -= factor[p][a] * to.right[a];
            e_[r + p - Unknowns] = value;
        }
#pragma GCC unroll 16
        for (int c = r; c < Reach; ++c) {
            L column[Count], before[Unknowns];
            read_column(terms, c, column);
            for (int a = 0; a < Unknowns; ++a) before[a] = to.at(a, 3 + c);
#pragma GCC unroll 3
            for (int p = 0; p < kRows; ++p) {
                if (c < r + p) continue;
                L entry = complete(r + p, c, by[p], column, terms);
                for (int a = 0; a < Unknowns; ++a) entry -= factor[p][a] * before[a];
                left(r + p - Unknowns, c - Unknowns) = entry;
            }
        }
    }

    /// The system as whole matrices: A and b by edges, M and c by x_i, X between them. Its entries with x_i replaced, over
    /// the unknowns E_i, x_{i+1}, later edges: these are the columns of the factor.
    struct Whole {
        L A[Reach][Reach], b[Reach], M[3][3], c[3], X[3][Reach]{};

        static constexpr bool is_point(int column) { return column >= Unknowns && column < Unknowns + 3; }
        static constexpr int edge(int column) { return column < Unknowns ? column : column - 3; }

        /// x_i = x_{i+1} - e_i.
        L free_point(int r, int c) const {
            if (is_point(r)) return is_point(c) ? M[r - Unknowns][c - Unknowns] : X[r - Unknowns][edge(c)];
            if (is_point(c)) return r < 3 ? X[c - Unknowns][r] - M[c - Unknowns][r] : X[c - Unknowns][r];
            L entry = A[edge(r)][edge(c)];
            if (r < 3) entry -= X[r][edge(c)];
            if (c < 3) entry += M[r][c] - X[c][r];
            return entry;
        }
        L free_point(int r) const { return is_point(r) ? c[r - Unknowns] : r < 3 ? b[r] - c[r] : b[edge(r)]; }

        /// x_i is known: of e_i = x_{i+1} - x_i only x_{i+1} is not, and takes its place; the rows of e_i are the identity's.
        L given_point(int r, int c) const {
            if (r < 3) return splat(Real(r == c));
            return A[is_point(r) ? r - Unknowns : edge(r)][is_point(c) ? c - Unknowns : edge(c)];
        }
        L given_point(int r, const L (&x)[3]) const {
            if (r < 3) return L{};
            const int i = is_point(r) ? r - Unknowns : edge(r);
            L value = b[i];
            for (int k = 0; k < 3; ++k) value += (A[i][k] - X[k][i]) * x[k];
            return value;
        }
    };

    template <class Terms>
    void expand(const Terms &terms, const L (&mass)[6], const L (&by_point)[3], Whole &whole) {
        for (int r = 0; r < Reach; ++r) {
            for (int c = r; c < Reach; ++c) {
                L by[Terms::Count], column[Terms::Count];
                read_column(terms, r, by);
                read_column(terms, c, column);
                whole.A[r][c] = whole.A[c][r] = complete(r, c, by, column, terms);
            }
            whole.b[r] = terms.by_edge[r];
            if (r < R) whole.b[r] += e_[r];
        }
        for (int k = 0; k < 3; ++k) {
            whole.c[k] = by_point[k] + x_[k];
            for (int c = 0; c < 3; ++c) whole.M[k][c] = mass[of_point(k, c)] + xx_[of_point(k, c)];
            for (int r = 0; r < R; ++r) whole.X[k][r] = xe(k, r);
        }
    }

    /// Where the fourth unknown is held its row becomes the identity's.
    static void impose_fourth(const Held<Real> &known, L (&rows)[Band][Band], L (&value)[Band]) {
        const L keep = 1 - known.fourth, moved = known.fourth * known.s;
        for (int k = 0; k < Band; ++k) {
            if (k == 3) continue;
            L &entry = k < 3 ? rows[k][3] : rows[3][k];
            value[k] -= entry * moved;
            entry *= keep;
        }
        rows[3][3] = select<Real>(known.fourth > 0, splat(Real(1)), rows[3][3]);
        value[3] = select<Real>(known.fourth > 0, moved, value[3]);
    }

    void eliminate_whole(L (&rows)[Band][Band], L (&value)[Band], Edge &to) {
        for (int a = 0; a < Unknowns; ++a) {
            finish_row(a, rows[a], value[a], to);
            for (int r = a + 1; r < Band; ++r) {
                const L factor = to.at(a, r);
                value[r] -= factor * to.right[a];
                for (int c = r; c < Band; ++c) rows[r][c] -= factor * to.at(a, c);
            }
        }
    }

    /// What is left of whole rows.
    void keep(const L (&rows)[Band][Band], const L (&value)[Band]) {
        for (int k = 0; k < 3; ++k) {
            x_[k] = value[Unknowns + k];
            for (int c = k; c < 3; ++c) xx_[of_point(k, c)] = rows[Unknowns + k][Unknowns + c];
            for (int c = Unknowns; c < Reach; ++c) xe(k, c - Unknowns) = rows[Unknowns + k][3 + c];
        }
        for (int r = Unknowns; r < Reach; ++r) {
            e_[r - Unknowns] = value[3 + r];
            for (int c = r; c < Reach; ++c) left(r - Unknowns, c - Unknowns) = rows[3 + r][3 + c];
        }
    }
};

} // namespace ringlet
