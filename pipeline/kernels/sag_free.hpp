// Rest strains that hold the groom: statics, stability and reactions of all strands.
//
// Strands are stiffened by f = max(1, margin x critical factor), no more than max_factor, and so that no rest strain
// changes by more than a quarter turn: past half a turn a twist wraps round, and the joint would hold nothing.
// A strand that needs more than lean_above leans on the head where that at least halves what it needs. The others do
// not: leaning hair slides when the head moves, and friction keeps it where it slid to, while hair that holds itself
// comes back (test_leaning_strands_are_at_rest measures both).
#pragma once

#include "reactions.hpp"
#include "stability.hpp"

#include <vector>

namespace ringlet {

inline constexpr double kMostChange = 1.5707963267948966; // [rad] of a rest strain
inline constexpr double kWorthLeaning = 0.5;              // a strand leans if that leaves this part of its factor

/// What the balance of a groom is made from; arrays of the caller.
struct Groom {
    const RestShape &rest;
    const double *load;   // (S, P, 3) [N] in the head's rest frame: gravity and whatever else pulls
    const double *normal; // (S, P, 3) of the head where it supports a point, 0 elsewhere
    double margin, max_factor, lean_above;
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
          strain_(arena.take<Vector>(P)), reaction_(arena.take<Many>(P)), tension_(arena.take<Many>(P)) {
        for (auto **array : {&force_[0], &force_[1], &couple_[0], &couple_[1]}) *array = arena.take<Vector>(P);
    }

    static size_t bytes(int P) { return sizeof(Many) * (size_t(P) * (112 + sizeof(StaticJoint) / sizeof(Many)) + 512); }

    void solve(const Groom &groom, const BlockIndex<double> &index, SagFree &result) {
        const int P = block_.P;
        read(groom, index);
        block_.set_joints();
        load();
        hold(index);
        Many critical, needed;
        balance(groom.margin, critical, needed);
        lean(groom, index, critical, needed);
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
    Vector *force_[2], *couple_[2]; // of what holds strands beyond their roots; what leaning adds
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
            reaction_[i] = Many{};
            for (int k = 0; k < 2; ++k) force_[k][i] = couple_[k][i] = Vector{};
            for (int lane = 0; lane < kLanes<double>; ++lane) {
                const uint8_t *held = &groom.rest.held[size_t(index.strand[lane]) * P];
                const bool clamped = held[0] && held[1];
                block_.held[i][lane] = held[i] != 0;
                if (i + 1 < P) block_.turns[i][lane] = clamped && !(held[i] && held[i + 1]);
            }
        }
    }

    /// Forces and couples of what holds strands beyond their roots; they bear the loads of held points themselves.
    void hold(const BlockIndex<double> &index) {
        block_.balance();
        for (int lane = 0; lane < index.count; ++lane) {
            const Reactions reactions(block_, lane);
            if (reactions.count() > 0) reactions.solve(reaction_, force_[0], couple_[0]);
        }
        load();
    }

    /// Balances the loads; the critical factor, and the one that is needed.
    void balance(double margin, Many &critical, Many &needed) {
        block_.balance();
        stability_.set(block_);
        critical = stability_.critical();
        needed = maximum<double>(margin * critical, block_.largest_change() / kMostChange);
        needed = maximum<double>(needed, splat(1.0));
    }

    /// Lets the lanes that need much lean on the head, and keeps that where it helps.
    void lean(const Groom &groom, const BlockIndex<double> &index, Many &critical, Many &needed) {
        bool leans = false;
        for (int lane = 0; lane < index.count; ++lane) {
            if (!(needed[lane] > groom.lean_above)) continue;
            Reactions reactions(block_, lane);
            const int held = reactions.count();
            reactions.lean(normal_);
            if (reactions.count() == held) continue;
            reactions.solve(reaction_, force_[1], couple_[1]);
            leans = true;
        }
        if (!leans) return;
        load();
        Many leaning_critical, leaning_needed;
        balance(groom.margin, leaning_critical, leaning_needed);
        const Mask<double> helps = leaning_needed < kWorthLeaning * needed;
        critical = select<double>(helps, leaning_critical, critical);
        needed = select<double>(helps, leaning_needed, needed);
        for (int k = 0; k < block_.P; ++k) {
            reaction_[k] = select<double>(helps, reaction_[k], Many{});
            force_[1][k] = select(helps, force_[1][k], Vector{});
            couple_[1][k] = select(helps, couple_[1][k], Vector{});
        }
        load();
        block_.balance();
    }

    /// Puts all forces and couples together, and what they hold.
    void load() {
        const Many one = splat(1.0);
        for (int k = 0; k < block_.P; ++k) {
            const Many held = block_.held[k], leans = select<double>(reaction_[k] > splat(0.0), one, Many{});
            block_.F[k] = (1 - held) * gravity_[k] + force_[0][k] + force_[1][k];
            block_.couple[k] = couple_[0][k] + couple_[1][k];
            stability_.hold[k] = diagonal<double>(held) + leans * outer(normal_[k], normal_[k]);
        }
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
