// All strands step by step together, each step at the same time: strands that push one another.
//
// Blocks stay in lanes for the whole call, so that a step reads and writes no arrays of the caller. At the start of a
// step the neighbours look at all strands; then every block gets their force and steps by itself. Nothing is kept from
// one step to the next but the state: calls may be split anywhere.
#pragma once

#include "advance.hpp"
#include "neighbours.hpp"

#include <algorithm>
#include <chrono>

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
    Together(StateArrays<Real> state, const RestShape &rest, const Drive &drive, const StepSettings &settings)
        : state_(state), rest_(rest), drive_(drive), settings_(settings), tallies_(block_count<Real>(rest.S)),
          arena_(tallies_.size() * Resident<Real>::bytes(rest.P)) {
        for (int b = 0; b < int(tallies_.size()); ++b)
            blocks_.emplace_back(arena_, rest.P, BlockIndex<Real>(b, rest.S));
    }

    Report advance(const DistanceField *field, NeighbourForce<Real> &force, int most_threads) {
        const int threads = std::clamp(int(blocks_.size()) / kBlocksForThread, 1, most_threads);
        double looking = 0, acting = 0;
#pragma omp parallel num_threads(threads) reduction(+ : acting)
        {
            Arena arena(Stepper<Real>::bytes(rest_.P));
            Stepper<Real> stepper(arena, rest_.P, settings_, field);
            read_blocks(stepper, force);
            double look = 0;
            for (int k = 0; k < drive_.steps; ++k) {
                {
                    const Clock clock(look);
                    force.look(blocks_, drive_.head[k]);
                }
                step_blocks(stepper, force, k, acting);
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
    std::vector<Tally<Real>> tallies_;
    Arena arena_;
    std::vector<Resident<Real>> blocks_;

    void read_blocks(Stepper<Real> &stepper, NeighbourForce<Real> &force) {
#pragma omp for schedule(static)
        for (int b = 0; b < int(blocks_.size()); ++b) {
            Resident<Real> &resident = blocks_[b];
            read(resident.block, rest_, resident.index, settings_.torsion != Torsion::kirchhoff);
            read(resident.now, state_, rest_.P, resident.index);
            stepper.exchange(resident);
            stepper.contacts.forget(rest_.P);
            stepper.exchange(resident);
            force.see(resident, b, drive_.head[0]);
        }
    }

    void step_blocks(Stepper<Real> &stepper, NeighbourForce<Real> &force, int k, double &acting) {
        RootPose<Real> roots[2];
#pragma omp for schedule(dynamic, 1)
        for (int b = 0; b < int(blocks_.size()); ++b) {
            Resident<Real> &resident = blocks_[b];
            {
                const Clock clock(acting);
                force.act(resident, b);
            }
            stepper.outside = &resident.outside;
            stepper.tally = tallies_[b];
            stepper.exchange(resident);
            stepper.step(interval_of(drive_, k, settings_, rest_.S, resident.index, roots), own_lanes(resident.index));
            stepper.exchange(resident);
            tallies_[b] = stepper.tally;
            const Clock clock(acting);
            force.see(resident, b, drive_.head[k + 1]);
        }
    }

    void write_blocks() {
#pragma omp for schedule(static)
        for (int b = 0; b < int(blocks_.size()); ++b) {
            tallies_[b].bad_strand = first_bad_strand(blocks_[b].block, blocks_[b].now, blocks_[b].index);
            write(blocks_[b].now, state_, rest_.P, blocks_[b].index);
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
        force.see(residents[b], b, head);
    }
#pragma omp parallel num_threads(threads)
    {
        force.look(residents, head);
#pragma omp for
        for (int b = 0; b < blocks; ++b) {
            Resident<Real> &resident = residents[b];
            force.act(resident, b);
            for (int i = 0; i < rest.P; ++i)
                resident.outside.push[i] = acceleration(resident.outside, i, resident.now.v[i]);
            scatter(resident.outside.push, a, rest.P, resident.index);
        }
    }
}

} // namespace ringlet
