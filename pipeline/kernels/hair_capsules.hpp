// Hair-hair contact by capsules: every segment is a soft rod with the radius of the wisp that its guide stands for.
//
// Rods are where their strands will be at x + theta dt v (rods.hpp); forces and matrices come back to the points.
#pragma once

#include "neighbours.hpp"
#include "rest.hpp"
#include "rods.hpp"

namespace ringlet {

struct CapsuleSettings {
    double radius = 1.5e-3;   // [m] of a wisp
    double stiffness = 0.005; // [N/m]
    double friction = 0.3;    // Coulomb
    double speed = 0.2;       // [m/s] rods are pushed apart no faster than this
};

class HairCapsules final : public Neighbours {
  public:
    const CapsuleSettings settings;
    const int S, P;
    Closeness allowed;               // strands that are groomed nearer than 2 r may stay as near
    double longest = 0, mass = 0;    // longest segment [m]; mean mass of a point [kg]
    double lowest[3], highest[3];    // how far strands reach [m]

    HairCapsules(const RestShape &shape, const CapsuleSettings &given)
        : settings(given), S(shape.S), P(shape.P), allowed(S) {
        double longest_strand = 0;
        for (int s = 0; s < S; ++s) {
            double length = 0;
            for (int j = 0; j + 1 < P; ++j) {
                const int k = s * (P - 1) + j;
                length += shape.length[k];
                longest = std::max(longest, shape.length[k]);
            }
            longest_strand = std::max(longest_strand, length);
        }
        for (double m : shape.mass) mass += m / double(shape.mass.size());
        for (int axis = 0; axis < 3; ++axis) {
            lowest[axis] = 1e30, highest[axis] = -1e30;
            for (size_t k = axis; k < shape.points.size(); k += 3) {
                lowest[axis] = std::min(lowest[axis], shape.points[k] - longest_strand);
                highest[axis] = std::max(highest[axis], shape.points[k] + longest_strand);
            }
        }
        measure_groom(shape);
    }

    /// Segment j of strand s is rod s (P - 1) + j.
    int rods() const { return S * (P - 1); }

    /// The middles of two segments that touch are no farther apart; they may be strained by a percent.
    double cell() const { return 1.01 * longest + 2 * settings.radius; }

    bool fits(int strands, int points) const override { return strands == S && points == P; }
    std::unique_ptr<NeighbourForce<float>> start(float, double theta_dt) const override;
    std::unique_ptr<NeighbourForce<double>> start(double, double theta_dt) const override;

    /// The law of contact for steps of dt.
    RodLaw law(double theta_dt) const {
        const double damping = 0.5 * std::sqrt(settings.stiffness * mass), reach = 2 * settings.radius;
        return {float(settings.stiffness),        float(damping), float(settings.stiffness * reach / settings.speed),
                float(settings.speed),            float(settings.friction),
                float(reach),                     float(theta_dt)};
    }

  private:
    void measure_groom(const RestShape &shape) {
        RodGrid grid(allowed, rods(), P - 1, cell(), law(0));
        for (int k = 0; k < rods(); ++k) {
            float ends[2][6] = {};
            for (int axis = 0; axis < 6; ++axis)
                ends[axis / 3][axis % 3] = float(shape.points[3 * (k / (P - 1) * P + k % (P - 1)) + axis]);
            grid.put(k, ends[0], ends[1], true);
        }
        grid.measure([&](int a, int b, float distance) { allowed.note(a, b, distance); });
    }
};

template <class Real> class CapsuleForce final : public NeighbourForce<Real> {
    using L = Lanes<Real>;

  public:
    CapsuleForce(const HairCapsules &capsules, double theta_dt)
        : capsules_(capsules), theta_dt_(splat(Real(theta_dt))),
          grid_(capsules.allowed, capsules.rods(), capsules.P - 1, capsules.cell(),
                capsules.law(theta_dt)) {}

    void see(const Resident<Real> &resident, int, const Pose &head, double) override {
        const Rigid<Real> local(head.inverse());
        const Vec3<Real> lowest = broadcast<Real>(capsules_.lowest), highest = broadcast<Real>(capsules_.highest);
        float ends[2][kLanes<Real>][6]; // by lane: where a point will be, and its velocity
        bool valid[2][kLanes<Real>];
        for (int i = 0; i < capsules_.P; ++i) {
            const Vec3<Real> v = resident.now.v[i], x = resident.now.x[i] + theta_dt_ * v, at = local(x);
            const Mask<Real> here = inside(at, lowest, highest) & (dot(v, v) < Real(1e12));
            for (int lane = 0; lane < resident.index.count; ++lane) {
                float(&end)[6] = ends[i % 2][lane];
                end[0] = float(x.x[lane]), end[1] = float(x.y[lane]), end[2] = float(x.z[lane]);
                end[3] = float(v.x[lane]), end[4] = float(v.y[lane]), end[5] = float(v.z[lane]);
                valid[i % 2][lane] = here[lane] != 0;
                if (i == 0) continue;
                const int rod = resident.index.strand[lane] * (capsules_.P - 1) + i - 1;
                grid_.put(rod, ends[(i - 1) % 2][lane], end, valid[0][lane] && valid[1][lane]);
            }
        }
    }

    void look(const Pose &) override { grid_.work(); }

    void act(const Resident<Real> &resident, int, Outside<Real> &outside) override {
        for (int i = 0; i < capsules_.P; ++i) {
            L sums[9] = {};
            for (int lane = 0; lane < kLanes<Real>; ++lane) {
                const int rod = resident.index.strand[lane] * (capsules_.P - 1) + i;
                const RodLoad *before = i > 0 ? grid_.load(rod - 1) : nullptr;
                const RodLoad *after = i + 1 < capsules_.P ? grid_.load(rod) : nullptr;
                for (int k = 0; before && k < 9; ++k) sums[k][lane] += Real(before->at[1][k]);
                for (int k = 0; after && k < 9; ++k) sums[k][lane] += Real(after->at[0][k]);
            }
            const L per_mass = resident.block.per_mass / resident.block.mu[i];
            for (int k = 0; k < 6; ++k) outside.rate[6 * i + k] = per_mass * sums[3 + k];
            outside.force[i] = per_mass * Vec3<Real>{sums[0], sums[1], sums[2]};
        }
    }

  private:
    const HairCapsules &capsules_;
    const L theta_dt_;
    RodGrid grid_;
};

inline std::unique_ptr<NeighbourForce<float>> HairCapsules::start(float, double theta_dt) const {
    return std::make_unique<CapsuleForce<float>>(*this, theta_dt);
}
inline std::unique_ptr<NeighbourForce<double>> HairCapsules::start(double, double theta_dt) const {
    return std::make_unique<CapsuleForce<double>>(*this, theta_dt);
}

} // namespace ringlet
