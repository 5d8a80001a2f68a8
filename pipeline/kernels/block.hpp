// One block of strands, a lane each: its state, its rest shape, and how arrays of strands are read and written.
//
// Notation: x, v points and velocities; T tension of a segment; l its rest length; m mass of a point,
// here in units of the strand's mean mass m0 (mu = m/m0, w = m0/m; 0 where the point is held).
#pragma once

#include "rest.hpp"
#include "rows.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <vector>

namespace ringlet {

/// Memory of one thread: handed out in aligned pieces, given back all at once. The thread keeps it for its next arenas:
/// fresh pages from the system cost a twentieth of a frame's steps.
class Arena {
  public:
    explicit Arena(size_t bytes) : memory_(kept(bytes)), left_(bytes) {}

    template <class T> T *take(size_t count) {
        size_t bytes = (count * sizeof(T) + size_t(kAlignment) - 1) / size_t(kAlignment) * size_t(kAlignment);
        if (bytes > left_) throw std::bad_alloc();
        std::byte *piece = memory_.get() + used_;
        used_ += bytes, left_ -= bytes;
        T *items = reinterpret_cast<T *>(piece);
        for (size_t i = 0; i < count; ++i) items[i] = T{};
        return items;
    }

  private:
    static constexpr std::align_val_t kAlignment{64};
    static constexpr size_t kKept = 4; // pieces that a thread keeps

    struct Free {
        void operator()(std::byte *p) const { ::operator delete(p, kAlignment); }
    };
    struct Piece {
        std::unique_ptr<std::byte, Free> memory;
        size_t bytes;
    };
    /// The pieces that a thread keeps, smallest first; its own: an arena may be given back by another thread.
    static std::vector<Piece> &pieces() {
        static thread_local std::vector<Piece> pieces;
        return pieces;
    }
    struct Keep {
        size_t bytes = 0;
        void operator()(std::byte *p) const {
            std::vector<Piece> &all = pieces();
            const auto larger = [this](const Piece &piece) { return piece.bytes > bytes; };
            all.insert(std::find_if(all.begin(), all.end(), larger), Piece{std::unique_ptr<std::byte, Free>(p), bytes});
            if (all.size() > kKept) all.erase(all.begin());
        }
    };
    std::unique_ptr<std::byte, Keep> memory_;
    size_t used_ = 0, left_;

    static std::unique_ptr<std::byte, Keep> kept(size_t bytes) {
        std::vector<Piece> &all = pieces();
        const auto fits = std::find_if(all.begin(), all.end(), [&](const Piece &piece) { return piece.bytes >= bytes; });
        if (fits == all.end())
            return {static_cast<std::byte *>(::operator new(bytes, kAlignment)), Keep{bytes}};
        std::unique_ptr<std::byte, Keep> piece(fits->memory.release(), Keep{fits->bytes});
        all.erase(fits);
        return piece;
    }
};

/// What a step changes.
template <class Real> struct Motion {
    Vec3<Real> *x, *v;
    Vec3<Real> *m;      // director of segment j, unit
    Lanes<Real> *twist; // at point i, see kirchhoff.hpp
    Lanes<Real> *T;     // tension of segment j, positive when pulled
    Lanes<Real> *touch; // in the last step: 1 pressed by the solve against the head, 2 by lengths only, else 0

    Motion(Arena &arena, int P)
        : x(arena.take<Vec3<Real>>(P)), v(arena.take<Vec3<Real>>(P)), m(arena.take<Vec3<Real>>(P)),
          twist(arena.take<Lanes<Real>>(P)), T(arena.take<Lanes<Real>>(P)), touch(arena.take<Lanes<Real>>(P)) {}

    /// Bytes that a Motion takes from its arena.
    static size_t bytes(int P) { return sizeof(Lanes<Real>) * 12 * size_t(P); }
};

/// What a step reads: the rest shape of the block's strands.
template <class Real> struct Block {
    int P;
    int first = 0;            // points before this one are held in every lane
    bool held_inside = false; // some lane holds a point after that
    bool clamped = false;     // some lane has a root_weight
    Lanes<Real> k_kappa, k_tau, m0, per_mass; // per_mass = 1 / m0
    Lanes<Real> k_kappa_2, k_ratio, inverse_ratio; // "kirchhoff": B2, B2 / B1, B1 / B2
    Lanes<Real> theta{};                           // implicitness, see implicitness.hpp
    Lanes<Real> root_kappa, root_kappa_2, root_tau; // square roots of k_kappa, k_kappa_2, k_tau
    Vec3<Real> *anchor;                 // rest position of a point; valid where some lane holds it, and at the root
    Lanes<Real> root_bend[2], root_weight;    // root.hpp; weight 0 unless the head holds points 0 and 1
    Vec3<Real> *load;                   // constant force on a point over m0
    Vec3<Real> *director, *strain;      // "kirchhoff": of segment j, valid as `anchor`; (r1, r2, r3) at point i
    Lanes<Real> *turns;                 // 1 where the director of segment j is free: not both its ends are held
    Lanes<Real> *l, *dl;                // length of segment j; mean length of the segments beside point i
    Lanes<Real> *inverse_l, *inverse_dl, *root_dl; // 1 / l, 1 / dl, sqrt(dl)
    Lanes<Real> *mu, *w;                // mass and mobility of a point, see above
    Lanes<Real> *free, *hand, *offset;  // 1 where free; 1 where the hand holds; contact offset
    Lanes<Real> *kappa_r, *tau_r;       // at point i
    Lanes<Real> *C, *S;                 // "rotor" about segment i: cos(phi_r), sin(phi_r)
    Lanes<Real> *G_before, *G_after;    // its sqrt(G rho), sqrt(G / rho)

    Block(Arena &arena, int points) : P(points) {
        for (auto **array : {&anchor, &load, &director, &strain}) *array = arena.take<Vec3<Real>>(P);
        for (auto **array : {&turns, &l, &dl, &inverse_l, &inverse_dl, &root_dl, &mu, &w, &free, &hand, &offset,
                             &kappa_r, &tau_r, &C, &S, &G_before, &G_after})
            *array = arena.take<Lanes<Real>>(P);
    }
};

/// Copies `count` numbers of each strand of a block into lanes; lanes past the last strand repeat it.
/// Strand s begins at source + s * stride.
template <class Real, class Source>
void gather(Lanes<Real> *to, const Source *source, int count, int stride, const int (&strand)[kLanes<Real>]) {
    constexpr int n = kLanes<Real>;
    for (int first = 0; first < count; first += n) {
        if (count < n) {
            for (int i = 0; i < count; ++i) {
                Lanes<Real> column{};
                for (int lane = 0; lane < n; ++lane) column[lane] = Real(source[size_t(strand[lane]) * stride + i]);
                to[i] = column;
            }
            return;
        }
        const int begin = std::min(first, count - n); // the last piece overlaps the one before
        Lanes<Real> rows[n];
        for (int lane = 0; lane < n; ++lane) rows[lane] = load_row<Real>(source + size_t(strand[lane]) * stride + begin);
        transpose<Real>(rows);
        for (int i = 0; i < n; ++i) to[begin + i] = rows[i];
    }
}

template <class Real, class Source>
void gather(Vec3<Real> *to, const Source *source, int count, const int (&strand)[kLanes<Real>]) {
    gather<Real>(&to->x, source, 3 * count, 3 * count, strand);
}

/// The strands of a block: its lanes from `begin`; the last block is filled up with copies of its last strand.
template <class Real> struct BlockIndex {
    int begin, count, strand[kLanes<Real>];

    BlockIndex(int block, int strands) : begin(block * kLanes<Real>), count(strands - begin) {
        if (count > kLanes<Real>) count = kLanes<Real>;
        for (int lane = 0; lane < kLanes<Real>; ++lane) strand[lane] = begin + (lane < count ? lane : count - 1);
    }
};

template <class Real> int block_count(int strands) { return (strands + kLanes<Real> - 1) / kLanes<Real>; }

/// Lanes to `count` numbers of each strand: the first `strands` lanes, to target + strand[lane] * count.
template <class Real, class T>
void scatter(const Lanes<Real> *from, T *target, int count, const int (&strand)[kLanes<Real>], int strands) {
    constexpr int n = kLanes<Real>;
    for (int first = 0; first < count; first += n) {
        if (count < n) {
            for (int lane = 0; lane < strands; ++lane)
                for (int i = 0; i < count; ++i) target[size_t(strand[lane]) * count + i] = T(from[i][lane]);
            return;
        }
        const int begin = std::min(first, count - n);
        Lanes<Real> rows[n];
        for (int i = 0; i < n; ++i) rows[i] = from[begin + i];
        transpose<Real>(rows);
        for (int lane = 0; lane < strands; ++lane)
            store_row<Real>(rows[lane], target + size_t(strand[lane]) * count + begin);
    }
}

template <class Real, class T>
void scatter(const Lanes<Real> *from, T *target, int count, const BlockIndex<Real> &index) {
    scatter<Real>(from, target, count, index.strand, index.count);
}

template <class Real, class T>
void scatter(const Vec3<Real> *from, T *target, int count, const BlockIndex<Real> &index) {
    scatter<Real>(&from->x, target, 3 * count, index);
}

/// The bend that a clamped root keeps: the second segment seen in the frame of the first, at rest, and its shift.
template <class Real> void derive_root(Block<Real> &b) {
    Vec3<Real> d[2];
    for (int j = 0; j < 2; ++j) {
        const Vec3<Real> edge = b.anchor[j + 1] - b.anchor[j];
        d[j] = inverse_root<Real>(dot(edge, edge)) * edge;
    }
    b.root_bend[0] += dot(d[1], b.director[0]);
    b.root_bend[1] += dot(d[1], cross(d[0], b.director[0]));
    const Mask<Real> by_head = (b.free[0] + b.free[1] + b.hand[0] + b.hand[1]) < Real(1);
    b.root_weight = select<Real>(by_head, b.root_weight, splat(Real(0)));
    b.clamped = any<Real>(b.root_weight > 0);
}

/// Masses and held points in the form that the step uses.
template <class Real> void derive(Block<Real> &b, const RestShape &rest, const int (&strand)[kLanes<Real>]) {
    const Lanes<Real> one = splat(Real(1)), none = splat(Real(0));
    Lanes<Real> sum = none;
    for (int i = 0; i < b.P; ++i) sum += b.mu[i];
    b.m0 = sum / Real(b.P), b.per_mass = 1 / b.m0;
    bool leading = true;
    b.first = 0, b.held_inside = false;
    gather<Real>(b.hand, rest.held.data(), b.P, b.P, strand);
    for (int i = 0; i < b.P; ++i) {
        b.free[i] = select<Real>(b.hand[i] == none, one, none);
        b.hand[i] = select<Real>(b.hand[i] == splat(Real(2)), one, none);
        b.mu[i] = b.mu[i] / b.m0;
        b.w[i] = b.free[i] / b.mu[i];
        leading = leading && !any<Real>(b.free[i] > none);
        if (leading) b.first = i + 1;
        else if (any<Real>(b.free[i] < one)) b.held_inside = true;
        b.load[i] = b.per_mass * b.load[i];
        if (i > 0) b.turns[i - 1] = maximum<Real>(b.free[i - 1], b.free[i]);
        if (i < b.P - 1) b.inverse_l[i] = 1 / b.l[i];
        if (i > 0 && i < b.P - 1) {
            b.dl[i] = Real(0.5) * (b.l[i - 1] + b.l[i]);
            b.inverse_dl[i] = 1 / b.dl[i], b.root_dl[i] = square_root<Real>(b.dl[i]);
        }
    }
}

/// Cosine and sine to the last bits: series for a quarter of the angle, and the double angle twice.
template <class Real>
RINGLET_INLINE void cosine_and_sine(Lanes<Real> angle, Lanes<Real> &cosine, Lanes<Real> &sine) {
    constexpr double turn = 6.28318530717958647692;
    const Lanes<Real> u = Real(0.25) * (angle - Real(turn) * nearest<Real>(angle * Real(1 / turn))), z = u * u;
    Lanes<Real> less = splat(Real(0)), s = splat(Real(0)); // 1 - cos(u), sin(u) / u - 1
    for (int k = 8; k >= 1; --k) {
        less = z * Real(1.0 / (2 * k * (2 * k - 1))) * (1 - less);
        s = z * Real(-1.0 / (2 * k * (2 * k + 1))) * (1 + s);
    }
    s = u + u * s;
    for (int twice = 0; twice < 2; ++twice) {
        const Lanes<Real> doubled = 2 * s * (1 - less);
        less = 2 * s * s;
        s = doubled;
    }
    cosine = 1 - less, sine = s;
}

/// Reads what "rotor" and "frenet" keep: rest curvature and torsion, and the dihedrals about segments with their weights.
template <class Real> void read_curves(Block<Real> &b, const RestShape &rest, const int (&strand)[kLanes<Real>]) {
    const int P = b.P;
    gather<Real>(b.kappa_r + 1, rest.curvature.data(), P - 2, P - 2, strand);
    gather<Real>(b.tau_r + 2, rest.torsion.data(), P - 4, P - 4, strand);
    gather<Real>(b.G_after + 1, rest.ratio.data(), P - 3, P - 3, strand);
    gather<Real>(b.G_before + 1, rest.weight.data(), P - 3, P - 3, strand);
    gather<Real>(b.C + 1, rest.dihedral.data(), P - 3, P - 3, strand);
    for (int i = 1; i < P - 2; ++i) {
        const Lanes<Real> G = b.G_before[i], rho = b.G_after[i];
        cosine_and_sine<Real>(b.C[i], b.C[i], b.S[i]);
        b.G_before[i] = square_root<Real>(G * rho), b.G_after[i] = square_root<Real>(G / rho);
    }
}

/// Reads rest positions and directors, as far along as some lane holds a point, and at the root.
template <class Real>
void read_anchors(Block<Real> &b, const RestShape &rest, const int (&strand)[kLanes<Real>]) {
    int count = 6; // these lie in one row, or two in float64, and the root's first two segments among them
    for (int i = count; i < b.P; ++i)
        if (any<Real>(b.free[i] < splat(Real(1)))) count = i + 1;
    gather<Real>(&b.anchor->x, rest.points.data(), 3 * count, 3 * b.P, strand);
    gather<Real>(&b.director->x, rest.directors.data(), 3 * std::min(count, b.P - 1), 3 * (b.P - 1), strand);
}

/// Reads the rest shape of a block of strands; without curves, what "kirchhoff" needs.
template <class Real>
void read(Block<Real> &b, const RestShape &rest, const BlockIndex<Real> &index, bool curves = true) {
    const int P = b.P;
    const auto &strand = index.strand;
    gather<Real>(b.l, rest.length.data(), P - 1, P - 1, strand);
    gather<Real>(b.mu, rest.mass.data(), P, P, strand);
    gather<Real>(b.offset, rest.offset.data(), P, P, strand);
    gather<Real>(&b.k_kappa, rest.bending.data(), 1, 1, strand);
    gather<Real>(&b.k_tau, rest.twisting.data(), 1, 1, strand);
    gather<Real>(&b.k_kappa_2, rest.bending_2.data(), 1, 1, strand);
    const Lanes<Real> one = splat(Real(1));
    b.k_ratio = select<Real>(b.k_kappa > 0, b.k_kappa_2 / b.k_kappa, one);
    b.inverse_ratio = select<Real>(b.k_kappa_2 > 0, b.k_kappa / b.k_kappa_2, one);
    gather<Real>(b.root_bend, rest.root_shift.data(), 2, 2, strand);
    gather<Real>(&b.root_weight, rest.root_weight.data(), 1, 1, strand);
    b.root_kappa = square_root<Real>(b.k_kappa), b.root_kappa_2 = square_root<Real>(b.k_kappa_2);
    b.root_tau = square_root<Real>(b.k_tau);
    gather(b.load, rest.load.data(), P, strand);
    gather(b.strain + 1, rest.strain.data(), P - 2, strand);
    if (curves) read_curves(b, rest, strand);
    derive(b, rest, strand);
    read_anchors(b, rest, strand);
    derive_root(b);
}

} // namespace ringlet
