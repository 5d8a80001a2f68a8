// All strands together, from one look of the neighbours to the next: strands that push one another.
//
// Blocks stay in lanes for the whole call, so that a step reads and writes no arrays of the caller. The neighbours look
// at all strands; then every block gets their force and goes to the next look by itself. Nothing is kept from one look
// to the next but the state: calls may be split wherever one looks.
#pragma once

#include "advance.hpp"
#include "neighbours.hpp"

#include <algorithm>
#include <chrono>
#include <optional>

namespace ringlet {

/// Adds the time since its making to a sum.
class Clock {
  public:
    explicit Clock(double &sum) : sum_(sum), start_(now()) {}
    ~Clock() { sum_ += std::chrono::duration<double>(now() - start_).count(); }
    Clock(const Clock &) = delete;
    Clock &operator=(const Clock &) = delete;

  private:
    double &sum_;
    std::chrono::steady_clock::time_point start_;
    static std::chrono::steady_clock::time_point now() { return std::chrono::steady_clock::now(); }
};

/// Fewer blocks than this do not pay a thread that waits for the others three times a step.
inline constexpr int kBlocksForThread = 4;

/// The blocks of a state in lanes; every block's memory is its own.
template <class Real> class Together {
  public:
    Together(StateArrays<Real> state, const RestShape &rest, const Drive &drive, const StepSettings &settings,
             int hold)
        : state_(state), rest_(rest), drive_(drive), settings_(settings), hold_(hold), tallies_(block_count<Real>(rest.S)),
          blocks_(tallies_.size()) {}

    Report advance(const DistanceField *field, NeighbourForce<Real> &force, int most_threads) {
        const int blocks = int(blocks_.size()), threads = std::clamp(blocks / kBlocksForThread, 1, most_threads);
        const int share = (blocks + threads - 1) / threads; // blocks that a thread has memory for
        double looking = 0, acting = 0;
#pragma omp parallel num_threads(threads) reduction(+ : acting)
        {
            Arena arena(Stepper<Real>::bytes(rest_.P) + Outside<Real>::bytes(rest_.P) +
                        share * Resident<Real>::bytes(rest_.P));
            Stepper<Real> stepper(arena, rest_.P, settings_, field);
            Outside<Real> outside(arena, rest_.P);
            stepper.outside = &outside;
#pragma omp for schedule(static, share)
            for (int b = 0; b < blocks; ++b) read_block(arena, stepper, force, b);
            double look = 0;
            for (int first = 0; first < drive_.steps; first += hold_) {
                {
                    const Clock clock(look);
                    force.look(pose_seen(first));
                }
                step_blocks(stepper, outside, force, first, acting);
            }
            write_blocks();
#pragma omp single
            looking = look;
        }
        Report report = summarise(tallies_, drive_.steps);
        report.neighbour_seconds = looking + acting / threads;
        return report;
    }

  private:
    StateArrays<Real> state_;
    const RestShape &rest_;
    const Drive &drive_;
    const StepSettings &settings_;
    const int hold_;
    std::vector<Tally<Real>> tallies_;
    std::vector<std::optional<Resident<Real>>> blocks_;

    /// The first step that a look at the start of a step no longer serves for.
    int next_look(int first) const { return std::min(first + hold_, drive_.steps); }

    /// The head's pose in the middle between the first and the last step that a look serves for.
    Pose pose_seen(int first) const {
        const int sum = first + std::max(first, next_look(first) - 1);
        const Pose &pose = drive_.head[sum / 2];
        return sum % 2 ? halfway(pose, drive_.head[sum / 2 + 1]) : pose;
    }

    void see(NeighbourForce<Real> &force, const Resident<Real> &resident, int b, int first) const {
        const double ahead = 0.5 * settings_.dt * std::max(0, next_look(first) - 1 - first);
        force.see(resident, b, pose_seen(first), ahead);
    }

    void read_block(Arena &arena, Stepper<Real> &stepper, NeighbourForce<Real> &force, int b) {
        Resident<Real> &resident = blocks_[b].emplace(arena, rest_.P, BlockIndex<Real>(b, rest_.S));
        read(resident.block, rest_, resident.index, settings_.torsion != Torsion::kirchhoff);
        choose_theta(resident.block, settings_);
        read(resident.now, state_, rest_.P, resident.index);
        stepper.exchange(resident);
        stepper.contacts.forget(rest_.P);
        stepper.exchange(resident);
        see(force, resident, b, 0);
    }

    /// Acts on every block and takes it to the next look.
    void step_blocks(Stepper<Real> &stepper, Outside<Real> &outside, NeighbourForce<Real> &force, int first,
                     double &acting) {
        const int last = next_look(first);
        RootPose<Real> roots[2];
#pragma omp for schedule(dynamic, 1)
        for (int b = 0; b < int(blocks_.size()); ++b) {
            Resident<Real> &resident = *blocks_[b];
            {
                const Clock clock(acting);
                force.act(resident, b, outside);
            }
            stepper.tally = tallies_[b];
            stepper.exchange(resident);
            for (int k = first; k < last; ++k) {
                outside.begin_step(stepper.now.v, rest_.P);
                stepper.step(interval_of(drive_, k, settings_, rest_.S, resident.index, roots),
                             own_lanes(resident.index));
            }
            stepper.exchange(resident);
            tallies_[b] = stepper.tally;
            if (last == drive_.steps) continue; // nobody looks
            const Clock clock(acting);
            see(force, resident, b, last);
        }
    }

    void write_blocks() {
#pragma omp for schedule(static)
        for (int b = 0; b < int(blocks_.size()); ++b) {
            const Resident<Real> &resident = *blocks_[b];
            tallies_[b].bad_strand = first_bad_strand(resident.block, resident.now, resident.index);
            write(resident.now, state_, rest_.P, resident.index);
        }
    }
};

/// The force of the neighbours alone, over the mass: (S, P, 3) accelerations of a state, for the head at a pose.
template <class Real, class T>
void neighbour_acceleration(StateArrays<Real> state, const RestShape &rest, NeighbourForce<Real> &force,
                            const Pose &head, T *a, int threads) {
    const int blocks = block_count<Real>(rest.S);
    Arena arena(blocks * Resident<Real>::bytes(rest.P));
    std::vector<Resident<Real>> residents;
    for (int b = 0; b < blocks; ++b) {
        residents.emplace_back(arena, rest.P, BlockIndex<Real>(b, rest.S));
        read(residents[b].block, rest, residents[b].index);
        read(residents[b].now, state, rest.P, residents[b].index);
        force.see(residents[b], b, head, 0);
    }
#pragma omp parallel num_threads(threads)
    {
        Arena own(Outside<Real>::bytes(rest.P));
        Outside<Real> outside(own, rest.P);
        force.look(head);
#pragma omp for
        for (int b = 0; b < blocks; ++b) {
            force.act(residents[b], b, outside);
            scatter(outside.force, a, rest.P, residents[b].index);
        }
    }
}

} // namespace ringlet
