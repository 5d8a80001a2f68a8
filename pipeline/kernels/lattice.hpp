// A lattice of nodes: points give mass and momentum to the nodes around them, and get pressure and velocity back.
//
// Notation: places are in cells, node n has the weight w_n(x) = (1 - |x - n_x|) (1 - |y - n_y|) (1 - |z - n_z|) in the
// eight cells around it. Sums at a node run over the points in one order whatever the threads: points give in slabs of
// four layers of cells, a thread each, with nodes of their own, and the layer that two slabs share is added up after.
// Slabs lie at fixed places, so that no sum depends on how large the lattice happens to be.
// Four numbers of a node lie side by side: eight nodes are four loads.
#pragma once

#include "simd.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace ringlet {

/// Nodes low .. low + n - 1 of the lattice along x, y, z; y changes slowest, x fastest.
struct Box {
    int low[3] = {0, 0, 0}, n[3] = {0, 0, 0};

    size_t size() const { return size_t(n[0]) * n[1] * n[2]; }
    size_t row() const { return size_t(n[0]); }
    size_t layer() const { return size_t(n[0]) * n[2]; }

    size_t index(const int (&node)[3]) const {
        return (node[1] - low[1]) * layer() + (node[2] - low[2]) * row() + (node[0] - low[0]);
    }

    bool contains(const Box &other) const {
        for (int axis = 0; axis < 3; ++axis)
            if (other.low[axis] < low[axis] || other.low[axis] + other.n[axis] > low[axis] + n[axis]) return false;
        return true;
    }

    /// The nodes around places between these (in cells), and one more on every side.
    static Box around(const double (&lowest)[3], const double (&highest)[3]) {
        Box box;
        for (int axis = 0; axis < 3; ++axis) {
            box.low[axis] = int(std::floor(lowest[axis])) - 1;
            box.n[axis] = int(std::floor(highest[axis])) + 3 - box.low[axis];
        }
        return box;
    }
};

/// Groups of `group` numbers of two vectors in turn; of both, the first halves or the second.
template <int group, int half, class V, size_t... e>
RINGLET_INLINE V zip(V a, V b, std::index_sequence<e...>) {
    constexpr int n = sizeof...(e);
    return __builtin_shufflevector(a, b, int(int(e) / group % 2 * n + int(e) / (2 * group) * group + int(e) % group + half * n / 2)...);
}

/// Every other group of `group` numbers of two vectors, one after the other; from the first group or the second.
template <int group, int from, class V, size_t... e>
RINGLET_INLINE V unzip(V a, V b, std::index_sequence<e...>) {
    return __builtin_shufflevector(a, b, int(int(e) / group * 2 * group + from * group + int(e) % group)...);
}

template <class Real> using EveryLane = std::make_index_sequence<size_t(kLanes<Real>)>;

/// From four numbers of every lane to the four of the first lane, of the second ... side by side.
template <class Real> RINGLET_INLINE void to_fours(const Lanes<Real> (&part)[4], Lanes<Real> (&fours)[4]) {
    constexpr EveryLane<Real> lanes;
    const Lanes<Real> low = zip<1, 0>(part[0], part[1], lanes), high = zip<1, 1>(part[0], part[1], lanes);
    const Lanes<Real> low_2 = zip<1, 0>(part[2], part[3], lanes), high_2 = zip<1, 1>(part[2], part[3], lanes);
    fours[0] = zip<2, 0>(low, low_2, lanes), fours[1] = zip<2, 1>(low, low_2, lanes);
    fours[2] = zip<2, 0>(high, high_2, lanes), fours[3] = zip<2, 1>(high, high_2, lanes);
}

/// And back.
template <class Real> RINGLET_INLINE void from_fours(const Lanes<Real> (&fours)[4], Lanes<Real> (&part)[4]) {
    constexpr EveryLane<Real> lanes;
    const Lanes<Real> low = unzip<2, 0>(fours[0], fours[1], lanes), high = unzip<2, 0>(fours[2], fours[3], lanes);
    const Lanes<Real> low_2 = unzip<2, 1>(fours[0], fours[1], lanes), high_2 = unzip<2, 1>(fours[2], fours[3], lanes);
    part[0] = unzip<1, 0>(low, high, lanes), part[1] = unzip<1, 1>(low, high, lanes);
    part[2] = unzip<1, 0>(low_2, high_2, lanes), part[3] = unzip<1, 1>(low_2, high_2, lanes);
}

/// How density and momentum become pressure and velocity.
struct NodeLaw {
    double pressure, most, drag; // p = min(most, pressure max(0, rho / let pass - 1)); drag V
};

template <class Real> class Lattice {
    using L = Lanes<Real>;
    using M = Mask<Real>;
    typedef Real Four __attribute__((vector_size(4 * sizeof(Real)), may_alias));
    typedef Real Eight __attribute__((vector_size(8 * sizeof(Real))));
    struct Node {
        Four v; // a type of its own: template arguments lose attributes
    };

  public:
    static constexpr int kSlab = 4; // layers of cells

    const Box &box() const { return box_; }
    int slabs() const { return box_.n[1] / kSlab; }

    /// Makes room for places in this box; true when nodes have moved. Whole slabs, and some more than asked for.
    bool reach(const Box &tight) {
        Box roomy = tight;
        for (int axis = 0; axis < 3; ++axis) roomy.low[axis] -= 1, roomy.n[axis] += 2;
        const int end = roomy.low[1] + roomy.n[1];
        roomy.low[1] &= -kSlab;
        roomy.n[1] = (end - roomy.low[1] + kSlab - 1) & -kSlab;
        if (box_.contains(tight) && 2 * box_.size() < 3 * roomy.size()) return false;
        box_ = roomy;
        layer_ = (box_.layer() + kLanes<Real> - 1) / kLanes<Real> * kLanes<Real>;
        given_.assign(slabs() * (kSlab + 1) * layer_, Node{});
        velocity_.assign(box_.n[1] * layer_, Node{});
        pressure_.assign(box_.n[1] * layer_, 0);
        per_let_pass_.assign(box_.n[1] * layer_, 0);
        return true;
    }

    /// 1 / (density that is let pass) at a node.
    Real &per_let_pass(int x, int y, int z) {
        return per_let_pass_[(y - box_.low[1]) * layer_ + (z - box_.low[2]) * box_.row() + (x - box_.low[0])];
    }

    /// Layers of cells of a slab: from the first, up to the second.
    std::pair<Real, Real> layers(int slab) const {
        const Real from = Real(box_.low[1] + slab * kSlab);
        return {from, from + kSlab};
    }

    /// Points of a slab give: mass and momentum of each lane side by side.
    RINGLET_INLINE void give(int slab, Vec3<Real> place, M here, const L (&fours)[4]) {
        const Cells cells(place, here, box_, layer_);
        const Four *all = reinterpret_cast<const Four *>(fours);
        Node *nodes = given_.data() + slab * layer_; // before a slab are the extra layers of those below
        const size_t row = box_.row();
        for (uint32_t left = set_lanes<Real>(here); left; left &= left - 1) {
            const int lane = __builtin_ctz(left);
            const Eight both = __builtin_shufflevector(all[lane], all[lane], 0, 1, 2, 3, 0, 1, 2, 3);
            const Eight share = cells.along_x(lane) * both;
            Node *node = nodes + cells.at[lane];
            add(node, cells.weight[0][lane] * share);
            add(node + row, cells.weight[1][lane] * share);
            add(node + layer_, cells.weight[2][lane] * share);
            add(node + layer_ + row, cells.weight[3][lane] * share);
        }
    }

    /// Once all have given: pressure and velocity of the nodes of a slab. What was given is taken away.
    void press(int slab, const NodeLaw &law) {
        for (int y = slab * kSlab; y < (slab + 1) * kSlab; ++y) {
            Node *given = given_.data() + (y + slab) * layer_;
            Node *below = y == slab * kSlab && slab > 0 ? given - layer_ : nullptr;
            for (size_t k = 0; k < layer_; k += kLanes<Real>)
                press(y * layer_ + k, given + k, below ? below + k : nullptr, law);
        }
    }

    /// drag sum w_n V_n - sum grad w_n p_n at the place of every lane that takes part.
    RINGLET_INLINE Vec3<Real> take(Vec3<Real> place, M here) const {
        const Cells cells(place, here, box_, layer_);
        return velocity(cells) - slope(cells);
    }

  private:
    /// The cell of each lane's place, and the weights of its nodes.
    struct Cells {
        M first;               // index of the node with the lowest x, y, z
        Vec3<Real> f;          // place in the cell, 0 .. 1
        L part[4];             // weights along y and z: of (0, 0), (0, 1), (1, 0), (1, 1)
        int at[kLanes<Real>];  // the same in memory, where single lanes are read
        Real across[kLanes<Real>], weight[4][kLanes<Real>];

        RINGLET_INLINE Cells(Vec3<Real> place, M here, const Box &box, size_t layer) {
            M x, y, z;
            below(place.x, x, f.x), below(place.y, y, f.y), below(place.z, z, f.z);
            // Lanes that take no part are far away: a product of theirs would overflow
            x = here ? x - box.low[0] : M{}, y = here ? y - box.low[1] : M{}, z = here ? z - box.low[2] : M{};
            first = y * int(layer) + z * box.n[0] + x;
            const L far = f.y * f.z;
            part[3] = far, part[2] = f.y - far, part[1] = f.z - far, part[0] = 1 - f.y - part[1];
            for (int lane = 0; lane < kLanes<Real>; ++lane) at[lane] = int(first[lane]);
            __builtin_memcpy(across, &f.x, sizeof across);
            __builtin_memcpy(weight, part, sizeof weight);
            asm("" : "+m"(at), "+m"(across), "+m"(weight)); // else lanes are shuffled out of registers one by one
        }

        /// Weights along x: four times that of the first node, four times that of the second.
        RINGLET_INLINE Eight along_x(int lane) const {
            return Eight{1, 1, 1, 1, 0, 0, 0, 0} + across[lane] * Eight{-1, -1, -1, -1, 1, 1, 1, 1};
        }

        /// Whole cells and the rest, which does not depend on the box.
        static RINGLET_INLINE void below(L place, M &whole, L &rest) {
            whole = __builtin_convertvector(place, M);
            whole += __builtin_convertvector(whole, L) > place; // truncation to floor: a true comparison is -1
            rest = place - __builtin_convertvector(whole, L);
        }
    };

    Box box_;
    size_t layer_ = 0;           // nodes of a layer, in whole lanes
    std::vector<Node> given_;    // density and momentum; every slab has one layer more
    std::vector<Node> velocity_; // drag V in 1 .. 3
    std::vector<Real> pressure_, per_let_pass_;

    static RINGLET_INLINE Eight pair(const Node *node) {
        Eight both;
        __builtin_memcpy(&both, node, sizeof both);
        return both;
    }

    static RINGLET_INLINE void add(Node *node, Eight share) {
        const Eight sum = pair(node) + share;
        __builtin_memcpy(node, &sum, sizeof sum);
    }

    /// One lane a node.
    RINGLET_INLINE void press(size_t k, Node *given, Node *below, const NodeLaw &law) {
        L fours[4], part[4];
        __builtin_memcpy(fours, given, sizeof fours);
        if (below) {
            L more[4];
            __builtin_memcpy(more, below, sizeof more);
            for (int q = 0; q < 4; ++q) fours[q] += more[q];
        }
        from_fours<Real>(fours, part);
        const L rho = part[0];
        L p{};
        if (any<Real>(rho > 0)) {
            std::fill_n(given, kLanes<Real>, Node{});
            if (below) std::fill_n(below, kLanes<Real>, Node{});
            L let_pass;
            __builtin_memcpy(&let_pass, &per_let_pass_[k], sizeof let_pass);
            p = Real(law.pressure) * (rho * let_pass - 1);
            p = minimum<Real>(maximum<Real>(p, L{}), splat(Real(law.most)));
            const L per_mass = Real(law.drag) / maximum<Real>(rho, splat(Real(1e-30))); // lighter: nobody takes from it
            for (int q = 1; q < 4; ++q) part[q] *= per_mass;
            to_fours<Real>(part, fours);
            __builtin_memcpy(velocity_.data() + k, fours, sizeof fours);
        }
        __builtin_memcpy(&pressure_[k], &p, sizeof p);
    }

    RINGLET_INLINE Vec3<Real> velocity(const Cells &cells) const {
        L fours[4], part[4];
        Four *all = reinterpret_cast<Four *>(fours);
        const size_t row = box_.row();
        for (int lane = 0; lane < kLanes<Real>; ++lane) {
            const Node *node = velocity_.data() + cells.at[lane];
            Eight sum = cells.weight[0][lane] * pair(node);
            sum += cells.weight[1][lane] * pair(node + row);
            sum += cells.weight[2][lane] * pair(node + layer_);
            sum += cells.weight[3][lane] * pair(node + layer_ + row);
            const Four low = __builtin_shufflevector(sum, sum, 0, 1, 2, 3);
            const Four high = __builtin_shufflevector(sum, sum, 4, 5, 6, 7);
            all[lane] = low + cells.across[lane] * (high - low);
        }
        from_fours<Real>(fours, part);
        return {part[1], part[2], part[3]};
    }

    RINGLET_INLINE Vec3<Real> slope(const Cells &cells) const {
        const size_t row = box_.row();
        L value[4];
        Vec3<Real> slope{};
        for (int corner = 0; corner < 4; ++corner) {
            const size_t up = (corner >> 1) * layer_ + (corner & 1) * row;
            L low, high;
            pressures(cells, up, low, high);
            slope.x += cells.part[corner] * (high - low);
            value[corner] = low + cells.f.x * (high - low);
        }
        const L dz = value[1] - value[0], dz_up = value[3] - value[2];
        slope.y = (value[2] - value[0]) + cells.f.z * (dz_up - dz);
        slope.z = dz + cells.f.y * (dz_up - dz);
        return slope;
    }

    RINGLET_INLINE void pressures(const Cells &cells, size_t up, L &low, L &high) const {
        const Real *p = pressure_.data() + up;
        if constexpr (sizeof(Real) == 4) {
            gather_pairs<float>(p, cells.first, low, high);
        } else {
            for (int lane = 0; lane < kLanes<Real>; ++lane) low[lane] = p[cells.at[lane]], high[lane] = p[cells.at[lane] + 1];
        }
    }
};

} // namespace ringlet
