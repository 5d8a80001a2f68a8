// Rest strains that hold the groom: statics, stability and reactions of all strands.
//
// Strands are stiffened by f = max(1, margin x critical factor), no more than max_factor, and so that no rest strain
// changes by more than a quarter turn: past half a turn a twist wraps round, and the joint would hold nothing.
// Reactions are used where they are needed: where gravity alone needs stiffening, or where a strand lies on the head.
#pragma once

#include "reactions.hpp"
#include "stability.hpp"

#include <vector>

namespace ringlet {

inline constexpr double kLies = 0.25;         // part of a strand's points that are supported
inline constexpr double kMostChange = 1.5707963267948966; // [rad] of a rest strain

/// What the balance of a groom is made from; arrays of the caller.
struct Groom {
    const RestShape &rest;
    const double *load;   // (S, P, 3) [N] in the head's rest frame: gravity and whatever else pulls
    const double *normal; // (S, P, 3) of the head where it supports a point, 0 elsewhere
    double margin, max_factor;
};

struct SagFree {
    std::vector<double> strain;   // (S, P-2, 3) rest strains
    std::vector<double> tension;  // (S, P-1) [N]
    std::vector<double> reaction; // (S, P) [N]
    std::vector<double> critical; // (S,) critical factor at the true stiffness
    std::vector<double> needed;   // (S,) factor that is asked for
    std::vector<double> factor;   // (S,) factor that is given

    SagFree(int S, int P)
        : strain(size_t(S) * (P - 2) * 3), tension(size_t(S) * (P - 1)), reaction(size_t(S) * P), critical(S),
          needed(S), factor(S) {}
};

class SagFreeBlock {
  public:
    SagFreeBlock(Arena &arena, int P)
        : block_(arena, P), stability_(arena, P), normal_(arena.take<Vector>(P)), gravity_(arena.take<Vector>(P)),
          strain_(arena.take<Vector>(P)), reaction_(arena.take<Many>(P)), tension_(arena.take<Many>(P)) {}

    static size_t bytes(int P) { return sizeof(Many) * (size_t(P) * (90 + sizeof(StaticJoint) / sizeof(Many)) + 512); }

    void solve(const Groom &groom, const BlockIndex<double> &index, SagFree &result) {
        const int P = block_.P;
        read(groom, index);
        block_.set_joints();
        block_.balance();
        stability_.set(block_);
        Many critical = stability_.critical();
        if (support(groom.margin, critical, index)) {
            block_.balance();
            stability_.set(block_);
            critical = stability_.critical();
        }
        const Many one = splat(1.0);
        Many needed = maximum<double>(groom.margin * critical, block_.largest_change() / kMostChange);
        needed = maximum<double>(needed, one);
        Many factor = minimum<double>(needed, splat(groom.max_factor));
        for (int i = 1; i < P - 1; ++i) {
            const StaticJoint &joint = block_.joint[i];
            const Many per_factor = joint.dl / factor;
            strain_[i] = {joint.k1 - per_factor * joint.s[0] / block_.B[0],
                          joint.k2 - per_factor * joint.s[1] / block_.B[1],
                          joint.twist - per_factor * joint.s[2] / block_.B[2]};
        }
        for (int j = 0; j < P - 1; ++j) tension_[j] = block_.turns[j] * dot(block_.t[j], block_.W[j]);
        scatter(strain_ + 1, result.strain.data(), P - 2, index);
        scatter(tension_, result.tension.data(), P - 1, index);
        scatter(reaction_, result.reaction.data(), P, index);
        scatter(&critical, result.critical.data(), 1, index);
        scatter(&needed, result.needed.data(), 1, index);
        scatter(&factor, result.factor.data(), 1, index);
    }

  private:
    StaticBlock block_;
    Stability stability_;
    Vector *normal_, *gravity_, *strain_;
    Many *reaction_, *tension_;

    void read(const Groom &groom, const BlockIndex<double> &index) {
        const int P = block_.P;
        gather(block_.x, groom.rest.points.data(), P, index.strand);
        gather(block_.director, groom.rest.directors.data(), P - 1, index.strand);
        gather(gravity_, groom.load, P, index.strand);
        gather(normal_, groom.normal, P, index.strand);
        gather<double>(block_.l, groom.rest.length.data(), P - 1, P - 1, index.strand);
        gather<double>(&block_.B[0], groom.rest.bending.data(), 1, 1, index.strand);
        gather<double>(&block_.B[1], groom.rest.bending_2.data(), 1, 1, index.strand);
        gather<double>(&block_.B[2], groom.rest.twisting.data(), 1, 1, index.strand);
        for (int i = 0; i < P; ++i) {
            block_.F[i] = gravity_[i], stability_.n[i] = Vector{}, reaction_[i] = Many{};
            if (i == P - 1) break;
            for (int lane = 0; lane < kLanes<double>; ++lane) {
                const uint8_t *held = &groom.rest.held[size_t(index.strand[lane]) * P + i];
                block_.turns[i][lane] = held[0] == 0 || held[1] == 0;
            }
        }
    }

    /// Adds the reactions of the lanes that need them to the loads; false when there are none.
    bool support(double margin, Many critical, const BlockIndex<double> &index) {
        bool used = false;
        for (int lane = 0; lane < index.count; ++lane) {
            Reactions reactions(block_, normal_, lane);
            const int count = reactions.count();
            if (count == 0 || !(margin * critical[lane] > 1 || count > kLies * block_.P)) continue;
            reactions.solve(reaction_);
            used = true;
        }
        for (int k = 0; used && k < block_.P; ++k) {
            Mask<double> on = reaction_[k] > splat(0.0);
            block_.F[k] = gravity_[k] + reaction_[k] * normal_[k];
            stability_.n[k] = select(on, normal_[k], Vector{});
        }
        return used;
    }
};

inline SagFree sag_free(const Groom &groom, int threads) {
    const int S = groom.rest.S, P = groom.rest.P;
    SagFree result(S, P);
#pragma omp parallel num_threads(threads)
    {
        Arena arena(SagFreeBlock::bytes(P));
        SagFreeBlock block(arena, P);
#pragma omp for schedule(dynamic, 4)
        for (int k = 0; k < block_count<double>(S); ++k) block.solve(groom, BlockIndex<double>(k, S), result);
    }
    return result;
}

} // namespace ringlet
