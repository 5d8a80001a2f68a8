// Hair-hair contact as a continuum: mass and momentum of all strands on a lattice that is fixed in the head's frame.
//
// Notation: h spacing of the lattice; w_n(x) trilinear weight of node n; m mass of a point; rho_n = sum m w_n / h^3
// density and V_n mean velocity at a node; L_n density that is let pass: `density`, or the groom's own where that is
// more, so that the groom keeps its shape. A point gets
//     a = -sum_n grad w_n p_n + c_v sum_n w_n (V_n - v),     p_n = min(p_max, k_p max(0, rho_n / L_n - 1)).
// Where hair is denser it pushes, and it takes on the velocity of the hair around it (hair as a fluid: "Animating hair
// with volumetric interactions", Petrovic et al. 2005). The first term is the gradient of an energy, a function of the
// densities alone, without which a bundle never comes to rest (measured: test_a_bundle_keeps_its_width); it keeps
// momentum to about a percent. The second term keeps it to rounding: points take with the weights that they gave with.
// Sums at a node run over the points in one order, whatever the number of threads.
#pragma once

#include "neighbours.hpp"
#include "rest.hpp"

#include <algorithm>
#include <cmath>

namespace ringlet {

/// Nodes low .. low + n - 1 of the lattice along x, y, z; y changes slowest, x fastest.
struct Box {
    int low[3] = {0, 0, 0}, n[3] = {0, 0, 0};

    size_t size() const { return size_t(n[0]) * n[1] * n[2]; }
    size_t row() const { return size_t(n[0]); }
    size_t layer() const { return size_t(n[0]) * n[2]; }

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

struct GridSettings {
    double cell = 8e-3;     // [m] h
    double density = 0.15;  // [kg/m^3] of the guides' own mass
    double pressure = 0.05; // [m^2/s^2] k_p
    double drag = 3;        // [1/s] c_v
    double limit = 50;      // [m/s^2] largest push along an axis: p_max / h
};

class HairGrid final : public Neighbours {
  public:
    const GridSettings settings;
    Box groomed;                 // where there is hair at rest
    std::vector<double> densest; // L on those nodes
    double lowest[3], highest[3]; // how far strands reach, in cells
    int S, P;

    HairGrid(const RestShape &rest, const GridSettings &given) : settings(given), S(rest.S), P(rest.P) {
        double longest = 0;
        for (int s = 0; s < S; ++s) {
            double length = 0;
            for (int j = 0; j + 1 < P; ++j) length += rest.length[size_t(s) * (P - 1) + j];
            longest = std::max(longest, length);
        }
        double low[3], high[3];
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = 1e30, high[axis] = -1e30;
            for (size_t k = axis; k < rest.points.size(); k += 3) {
                low[axis] = std::min(low[axis], rest.points[k] / settings.cell);
                high[axis] = std::max(high[axis], rest.points[k] / settings.cell);
            }
            lowest[axis] = low[axis] - longest / settings.cell;
            highest[axis] = high[axis] + longest / settings.cell;
        }
        if (cells() < kMostCells) measure_groom(rest, Box::around(low, high));
    }

    static constexpr double kMostCells = 1 << 28;

    /// Cells that the strands can reach.
    double cells() const {
        double product = 1;
        for (int axis = 0; axis < 3; ++axis) product *= highest[axis] - lowest[axis] + 4;
        return product;
    }

    bool fits(int strands, int points) const override { return strands == S && points == P; }
    std::unique_ptr<NeighbourForce<float>> start(float, double) const override;
    std::unique_ptr<NeighbourForce<double>> start(double, double) const override;

  private:
    void measure_groom(const RestShape &rest, const Box &box) {
        groomed = box;
        densest.assign(box.size(), 0);
        const double per_volume = std::pow(settings.cell, -3);
        for (size_t k = 0; k < rest.mass.size(); ++k) {
            double f[3];
            size_t at[3];
            for (int axis = 0; axis < 3; ++axis) {
                const double place = rest.points[3 * k + axis] / settings.cell - box.low[axis];
                at[axis] = size_t(place), f[axis] = place - std::floor(place);
            }
            const size_t first = at[1] * box.layer() + at[2] * box.row() + at[0];
            for (int corner = 0; corner < 8; ++corner) {
                const int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
                const double w = (x ? f[0] : 1 - f[0]) * (y ? f[1] : 1 - f[1]) * (z ? f[2] : 1 - f[2]);
                densest[first + y * box.layer() + z * box.row() + x] += w * rest.mass[k] * per_volume;
            }
        }
        for (double &value : densest) value = std::max(value, settings.density);
    }
};

template <class Real> class GridForce final : public NeighbourForce<Real> {
    using L = Lanes<Real>;
    using M = Mask<Real>;
    typedef Real Four __attribute__((vector_size(4 * sizeof(Real))));
    typedef Real Eight __attribute__((vector_size(8 * sizeof(Real))));
    struct Node {
        Four v; // a type of its own: template arguments lose attributes
    };
    static constexpr Real kNowhere = Real(-1e9); // place of a lane that takes no part

  public:
    explicit GridForce(const HairGrid &grid)
        : grid_(grid), settings_(grid.settings), turn_(identity()), ranges_(block_count<Real>(grid.S)),
          places_(ranges_.size() * grid.P) {}

    void see(const Resident<Real> &block, int number, const Pose &head) override {
        place(block, number, Rigid<Real>(head.inverse()));
    }

    void look(const std::vector<Resident<Real>> &blocks, const Pose &head) override {
#pragma omp single
        {
            turn_ = Rigid<Real>(head);
            enclose();
        }
        const int slabs = int(slabs_.size()) - 1;
#pragma omp for schedule(dynamic, 1)
        for (int slab = 0; slab < slabs; ++slab) spread(blocks, slabs_[slab], slabs_[slab + 1]);
    }

    void act(Resident<Real> &block, int number) override {
        const int P = block.block.P;
        const L drag = splat(Real(settings_.drag));
        for (int i = 0; i < P; ++i) {
            const Around around(places_[number * size_t(P) + i], box_);
            Real a[3][kLanes<Real>];
            for (int lane = 0; lane < kLanes<Real>; ++lane) {
                const Four force = around.force(lane, nodes_.data(), box_);
                for (int axis = 0; axis < 3; ++axis) a[axis][lane] = force[axis + 1];
            }
            Vec3<Real> local;
            __builtin_memcpy(&local, a, sizeof local);
            const M nowhere = around.nowhere;
            block.outside.push[i] = select(nowhere, drag * block.now.v[i], turn_.turn(local));
            for (int k : {0, 3, 5}) block.outside.rate[6 * i + k] = drag;
        }
    }

  private:
    struct Range {
        double low[3], high[3];
    };

    /// The cell of each lane's place and its place there.
    struct Around {
        M nowhere, y, at; // takes no part; layer and index of the cell's first node
        Vec3<Real> f;     // place in the cell, 0 .. 1

        Around(Vec3<Real> place, const Box &box) : nowhere(place.y <= kNowhere) {
            M x, z;
            below(place.x, x, f.x), below(place.y, y, f.y), below(place.z, z, f.z);
            x = nowhere ? M{} : x - box.low[0];
            y = nowhere ? M{} : y - box.low[1];
            z = nowhere ? M{} : z - box.low[2];
            at = (y * box.n[2] + z) * box.n[0] + x;
        }

        /// Whole cells and the rest, which does not depend on the box.
        static RINGLET_INLINE void below(L place, M &whole, L &rest) {
            whole = __builtin_convertvector(place, M);
            whole += __builtin_convertvector(whole, L) > place; // truncation to floor: a true comparison is -1
            rest = place - __builtin_convertvector(whole, L);
        }

        /// From pressure over h and c_v V at the nodes: in 1 to 3, their force.
        RINGLET_INLINE Four force(int lane, const Node *nodes, const Box &box) const {
            const Node *node = nodes + at[lane];
            const Real fx = f.x[lane], fy = f.y[lane], fz = f.z[lane];
            const Eight low = pair(node), high = pair(node + box.layer());
            const Eight dz_low = pair(node + box.row()) - low, dz_high = pair(node + box.layer() + box.row()) - high;
            const Eight at_low = low + fz * dz_low, dy = high + fz * dz_high - at_low, all = at_low + fy * dy;
            const Eight dz = dz_low + fy * (dz_high - dz_low);
            const Four first = __builtin_shufflevector(all, all, 0, 1, 2, 3);
            const Four dx = __builtin_shufflevector(all, all, 4, 5, 6, 7) - first;
            const Four slope = {0, dx[0], dy[0] + fx * (dy[4] - dy[0]), dz[0] + fx * (dz[4] - dz[0])};
            return first + fx * dx - slope;
        }
    };

    const HairGrid &grid_;
    const GridSettings &settings_;
    Rigid<Real> turn_;
    Box box_;
    std::vector<Range> ranges_;
    std::vector<Vec3<Real>> places_; // of every point, in cells
    std::vector<int> slabs_;         // first layers of what one thread fills at a time
    std::vector<Node> nodes_;        // density and momentum, then pressure over h and c_v V
    std::vector<Real> per_let_pass_; // 1 / L

    static Pose identity() { return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}; }

    static RINGLET_INLINE Eight pair(const Node *node) {
        Eight both;
        __builtin_memcpy(&both, node, sizeof both);
        return both;
    }

    /// Places of a block's points; those of no strand, lost or out of all reach take no part.
    void place(const Resident<Real> &resident, int number, const Rigid<Real> &local) {
        const L per_cell = splat(Real(1 / settings_.cell)), far = splat(Real(1e9));
        const Vec3<Real> lowest = broadcast<Real>(grid_.lowest), highest = broadcast<Real>(grid_.highest);
        const int P = resident.block.P;
        M own{};
        for (int lane = 0; lane < resident.index.count; ++lane) own[lane] = -1;
        Vec3<Real> low{far, far, far}, high{-far, -far, -far};
        for (int i = 0; i < P; ++i) {
            const Vec3<Real> v = resident.now.v[i], at = per_cell * local(resident.now.x[i]);
            const M here = own & inside(at, lowest, highest) & (dot(v, v) < Real(1e12));
            const Vec3<Real> if_low = select(here, at, Vec3<Real>{far, far, far});
            const Vec3<Real> if_high = select(here, at, Vec3<Real>{-far, -far, -far});
            places_[number * size_t(P) + i] = if_high;
            low = {minimum<Real>(low.x, if_low.x), minimum<Real>(low.y, if_low.y), minimum<Real>(low.z, if_low.z)};
            high = {maximum<Real>(high.x, if_high.x), maximum<Real>(high.y, if_high.y),
                    maximum<Real>(high.z, if_high.z)};
        }
        ranges_[number] = {{smallest<Real>(low.x), smallest<Real>(low.y), smallest<Real>(low.z)},
                           {largest<Real>(high.x), largest<Real>(high.y), largest<Real>(high.z)}};
    }

    /// A box around all places; the last one as long as it holds them and is not much too large.
    void enclose() {
        double low[3] = {1e30, 1e30, 1e30}, high[3] = {-1e30, -1e30, -1e30};
        for (const Range &range : ranges_)
            for (int axis = 0; axis < 3; ++axis) {
                low[axis] = std::min(low[axis], range.low[axis]);
                high[axis] = std::max(high[axis], range.high[axis]);
            }
        if (low[0] > high[0]) std::fill_n(low, 3, 0.0), std::fill_n(high, 3, 0.0); // no point takes part
        const Box tight = Box::around(low, high);
        Box roomy = tight;
        for (int axis = 0; axis < 3; ++axis) roomy.low[axis] -= 1, roomy.n[axis] += 2;
        if (box_.contains(tight) && 2 * box_.size() < 3 * roomy.size()) return;
        box_ = roomy;
        nodes_.resize(box_.size());
        fill_let_pass();
        const int layers = box_.n[1], slabs = std::min(layers, kSlabs);
        slabs_.clear();
        for (int slab = 0; slab <= slabs; ++slab) slabs_.push_back(layers * slab / slabs);
    }

    static constexpr int kSlabs = 8;

    void fill_let_pass() {
        const Box &rest = grid_.groomed;
        per_let_pass_.assign(box_.size(), Real(1 / settings_.density));
        for (int y = 0; y < rest.n[1]; ++y)
            for (int z = 0; z < rest.n[2]; ++z)
                for (int x = 0; x < rest.n[0]; ++x) {
                    const int to[3] = {x + rest.low[0] - box_.low[0], y + rest.low[1] - box_.low[1],
                                       z + rest.low[2] - box_.low[2]};
                    bool inside = true;
                    for (int axis = 0; axis < 3; ++axis) inside = inside && to[axis] >= 0 && to[axis] < box_.n[axis];
                    if (inside)
                        per_let_pass_[to[1] * box_.layer() + to[2] * box_.row() + to[0]] =
                            Real(1 / grid_.densest[y * rest.layer() + z * rest.row() + x]);
                }
    }

    /// Gives mass and momentum of all points to the nodes of the layers first .. last - 1.
    void spread(const std::vector<Resident<Real>> &blocks, int first, int last) {
        std::fill(nodes_.begin() + first * box_.layer(), nodes_.begin() + last * box_.layer(), Node{});
        const Rigid<Real> back(inverse_turn());
        const L per_volume = splat(Real(std::pow(settings_.cell, -3)));
        const L from = splat(Real(box_.low[1] + first - 1)), to = splat(Real(box_.low[1] + last));
        for (size_t b = 0; b < blocks.size(); ++b) {
            const Resident<Real> &resident = blocks[b];
            for (int i = 0; i < resident.block.P; ++i) {
                const Vec3<Real> at = places_[b * resident.block.P + i];
                const M here = (at.y >= from) & (at.y < to);
                if (!any<Real>(here)) continue;
                const Around around(at, box_);
                const L mass = resident.block.mu[i] * resident.block.m0 * per_volume;
                const Vec3<Real> momentum = mass * back.turn(resident.now.v[i]);
                for (int lane = 0; lane < kLanes<Real>; ++lane) {
                    if (!here[lane]) continue;
                    const Four all = {mass[lane], momentum.x[lane], momentum.y[lane], momentum.z[lane]};
                    give(around, lane, all, around.y[lane] >= first, around.y[lane] + 1 < last);
                }
            }
        }
        for (size_t k = first * box_.layer(); k < last * box_.layer(); ++k) press(k);
    }

    /// From density and momentum to pressure over h and c_v V.
    RINGLET_INLINE void press(size_t k) {
        Four &node = nodes_[k].v;
        const Real rho = node[0];
        if (!(rho > 0)) return;
        const Real drag = Real(settings_.drag) / rho, most = Real(settings_.limit);
        const Real p = Real(settings_.pressure / settings_.cell) * (rho * per_let_pass_[k] - 1);
        node = Four{0, drag, drag, drag} * node;
        node[0] = p > 0 ? (p < most ? p : most) : 0;
    }

    Pose inverse_turn() const {
        Pose pose = identity();
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) pose.R[i][j] = double(turn_.R[j][i]);
        return pose;
    }

    RINGLET_INLINE void give(const Around &around, int lane, Four all, bool lower, bool upper) {
        const Four high = around.f.x[lane] * all, low = all - high;
        const Eight share = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
        const Real fz = around.f.z[lane];
        const Eight above = around.f.y[lane] * share, below = share - above;
        Node *node = nodes_.data() + around.at[lane];
        if (lower) {
            const Eight far = fz * below;
            add(node, below - far);
            add(node + box_.row(), far);
        }
        if (upper) {
            const Eight far = fz * above;
            add(node + box_.layer(), above - far);
            add(node + box_.layer() + box_.row(), far);
        }
    }

    static RINGLET_INLINE void add(Node *node, Eight share) {
        const Eight sum = pair(node) + share;
        __builtin_memcpy(node, &sum, sizeof sum);
    }
};

inline std::unique_ptr<NeighbourForce<float>> HairGrid::start(float, double) const {
    return std::make_unique<GridForce<float>>(*this);
}
inline std::unique_ptr<NeighbourForce<double>> HairGrid::start(double, double) const {
    return std::make_unique<GridForce<double>>(*this);
}

} // namespace ringlet
