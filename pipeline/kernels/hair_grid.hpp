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
//
// All this may be looked at once in several steps (`hold`): the force goes with its point in between. Over the time in
// which pressure crosses a quarter of a cell that errs by less than the steps themselves do (measured:
// test_looking_less_often_errs_less_than_the_steps_do), and hair comes to rest as before.
#pragma once

#include "lattice.hpp"
#include "neighbours.hpp"
#include "rest.hpp"

#include <algorithm>
#include <cmath>

namespace ringlet {

struct GridSettings {
    double cell = 14e-3;    // [m] h
    double density = 0.15;  // [kg/m^3] of the guides' own mass
    double pressure = 0.03; // [m^2/s^2] k_p
    double drag = 3;        // [1/s] c_v
    double limit = 50;      // [m/s^2] largest push along an axis: p_max / h
    int hold = 1;           // steps from one look to the next
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
    int hold() const override { return settings.hold; }
    NodeLaw law() const { return {settings.pressure / settings.cell, settings.limit, settings.drag}; }

    /// Fills in what is let pass at the nodes of a lattice.
    template <class Real> void let_pass(Lattice<Real> &lattice) const {
        const Box &box = lattice.box();
        int n[3] = {};
        for (n[1] = box.low[1]; n[1] < box.low[1] + box.n[1]; ++n[1])
            for (n[2] = box.low[2]; n[2] < box.low[2] + box.n[2]; ++n[2])
                for (n[0] = box.low[0]; n[0] < box.low[0] + box.n[0]; ++n[0]) {
                    const bool inside = groomed.contains({{n[0], n[1], n[2]}, {1, 1, 1}});
                    lattice.per_let_pass(n[0], n[1], n[2]) = Real(1 / (inside ? densest[groomed.index(n)] : settings.density));
                }
    }

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
    static constexpr Real kNowhere = Real(-1e9); // place of a lane that takes no part

  public:
    explicit GridForce(const HairGrid &grid)
        : grid_(grid), law_(grid.law()), ranges_(block_count<Real>(grid.S)), points_(ranges_.size() * grid.P) {}

    void see(const Resident<Real> &block, int number, const Pose &head, double ahead) override {
        place(block, number, Rigid<Real>(head.inverse()), splat(Real(ahead)));
    }

    void look(const Pose &head) override {
#pragma omp single
        {
            head_ = head;
            enclose();
        }
        const int slabs = lattice_.slabs();
#pragma omp for schedule(dynamic, 1)
        for (int slab = 0; slab < slabs; ++slab) give(slab);
#pragma omp for schedule(dynamic, 1)
        for (int slab = 0; slab < slabs; ++slab) lattice_.press(slab, law_);
    }

    void act(const Resident<Real> &block, int number, Outside<Real> &outside) override {
        const int P = block.block.P;
        const L drag = splat(Real(grid_.settings.drag));
        const Rigid<Real> turn(head_);
        for (int i = 0; i < P; ++i) {
            const Vec3<Real> at = points_[number * size_t(P) + i].place;
            const M here = at.y > kNowhere;
            const Vec3<Real> force = turn.turn(lattice_.take(at, here)) - drag * block.now.v[i];
            outside.force[i] = select(here, force, Vec3<Real>{});
            for (int k : {0, 3, 5}) outside.rate[6 * i + k] = drag;
        }
    }

  private:
    struct Range {
        double low[3], high[3];
    };
    struct Point {
        Vec3<Real> place; // in cells
        L fours[4];       // density and momentum that a point gives to its nodes, of the first lane, of the second ...
    };

    const HairGrid &grid_;
    const NodeLaw law_;
    Pose head_{};
    Lattice<Real> lattice_;
    std::vector<Range> ranges_; // of the blocks' places
    std::vector<Point> points_;

    /// Places of a block's points; those of no strand, lost or out of all reach take no part.
    void place(const Resident<Real> &resident, int number, const Rigid<Real> &local, L ahead) {
        const double cell = grid_.settings.cell;
        const L per_cell = splat(Real(1 / cell)), far = splat(Real(1e9));
        const L per_volume = resident.block.m0 * Real(std::pow(cell, -3));
        const Vec3<Real> lowest = broadcast<Real>(grid_.lowest), highest = broadcast<Real>(grid_.highest);
        const int P = resident.block.P;
        M own{};
        for (int lane = 0; lane < resident.index.count; ++lane) own[lane] = -1;
        Vec3<Real> low{far, far, far}, high{-far, -far, -far};
        for (int i = 0; i < P; ++i) {
            const Vec3<Real> v = resident.now.v[i], at = per_cell * local(resident.now.x[i] + ahead * v);
            const M here = own & inside(at, lowest, highest) & (dot(v, v) < Real(1e12));
            const Vec3<Real> if_low = select(here, at, Vec3<Real>{far, far, far});
            const Vec3<Real> if_high = select(here, at, Vec3<Real>{-far, -far, -far});
            Point &point = points_[number * size_t(P) + i];
            point.place = if_high;
            const L mass = resident.block.mu[i] * per_volume;
            const Vec3<Real> momentum = mass * local.turn(v);
            const L parts[4] = {mass, momentum.x, momentum.y, momentum.z};
            to_fours<Real>(parts, point.fours);
            low = {minimum<Real>(low.x, if_low.x), minimum<Real>(low.y, if_low.y), minimum<Real>(low.z, if_low.z)};
            high = {maximum<Real>(high.x, if_high.x), maximum<Real>(high.y, if_high.y),
                    maximum<Real>(high.z, if_high.z)};
        }
        ranges_[number] = {{smallest<Real>(low.x), smallest<Real>(low.y), smallest<Real>(low.z)},
                           {largest<Real>(high.x), largest<Real>(high.y), largest<Real>(high.z)}};
    }

    /// A lattice around all places.
    void enclose() {
        double low[3] = {1e30, 1e30, 1e30}, high[3] = {-1e30, -1e30, -1e30};
        for (const Range &range : ranges_)
            for (int axis = 0; axis < 3; ++axis) {
                low[axis] = std::min(low[axis], range.low[axis]);
                high[axis] = std::max(high[axis], range.high[axis]);
            }
        if (low[0] > high[0]) std::fill_n(low, 3, 0.0), std::fill_n(high, 3, 0.0); // no point takes part
        if (lattice_.reach(Box::around(low, high))) grid_.let_pass(lattice_);
    }

    /// Points of all blocks give to the nodes of a slab, in order.
    void give(int slab) {
        const auto [from, to] = lattice_.layers(slab);
        for (size_t b = 0; b < ranges_.size(); ++b) {
            if (!(ranges_[b].low[1] < to && ranges_[b].high[1] >= from)) continue;
            for (size_t k = b * grid_.P; k < (b + 1) * grid_.P; ++k) {
                const Point &point = points_[k];
                const M here = (point.place.y >= from) & (point.place.y < to);
                if (any<Real>(here)) lattice_.give(slab, point.place, here, point.fours);
            }
        }
    }
};

inline std::unique_ptr<NeighbourForce<float>> HairGrid::start(float, double) const {
    return std::make_unique<GridForce<float>>(*this);
}
inline std::unique_ptr<NeighbourForce<double>> HairGrid::start(double, double) const {
    return std::make_unique<GridForce<double>>(*this);
}

} // namespace ringlet
