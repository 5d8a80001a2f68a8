// What the strands around it do to a strand: the interface between the step and the methods of hair-hair contact.
//
// Notation: x, v points and velocities, u = v + theta dv the velocity at which a step travels (implicit.hpp). A force
// from outside the strand, over the point's mass and linear in u, is  a(u) = push - C u  with C symmetric [1/s]:
// with a force f/m at the state of the step's start, push = f/m + C v. It stays right when a step is halved.
#pragma once

#include "block.hpp"
#include "pose.hpp"

#include <memory>
#include <vector>

namespace ringlet {

/// The force of the neighbours on the points of one block of strands.
template <class Real> struct Outside {
    Vec3<Real> *push;  // [m/s^2]
    Lanes<Real> *rate; // C: xx, xy, xz, yy, yz, zz of each point [1/s]

    Outside(Arena &arena, int P) : push(arena.take<Vec3<Real>>(P)), rate(arena.take<Lanes<Real>>(6 * size_t(P))) {}
};

/// Adds the force of C u at point i to a row of the solve: block is in units of the point's mass.
template <class Real>
RINGLET_INLINE void add_rate(const Outside<Real> &outside, int i, Lanes<Real> theta_dt, Lanes<Real> (&block)[6]) {
    for (int k = 0; k < 6; ++k) block[k] += theta_dt * outside.rate[6 * i + k];
}

/// push - C v at point i.
template <class Real> RINGLET_INLINE Vec3<Real> acceleration(const Outside<Real> &outside, int i, Vec3<Real> v) {
    const Lanes<Real> *C = outside.rate + 6 * i;
    return outside.push[i] - Vec3<Real>{C[0] * v.x + C[1] * v.y + C[2] * v.z, C[1] * v.x + C[3] * v.y + C[4] * v.z,
                                        C[2] * v.x + C[4] * v.y + C[5] * v.z};
}

/// Whether a point is in a box; not-a-number is not.
template <class Real> RINGLET_INLINE Mask<Real> inside(Vec3<Real> at, Vec3<Real> lowest, Vec3<Real> highest) {
    return (at.x >= lowest.x) & (at.x <= highest.x) & (at.y >= lowest.y) & (at.y <= highest.y) & (at.z >= lowest.z) &
           (at.z <= highest.z);
}

/// A block of strands that stays in lanes while all strands go step by step: what is read, and what a step changes.
template <class Real> struct Resident {
    BlockIndex<Real> index;
    Block<Real> block;
    Motion<Real> now;
    Outside<Real> outside;
    Vec3<Real> *nearby; // last samples of the head's field, see Contacts
    Lanes<Real> *phi;

    Resident(Arena &arena, int P, const BlockIndex<Real> &index)
        : index(index), block(arena, P), now(arena, P), outside(arena, P), nearby(arena.take<Vec3<Real>>(P)),
          phi(arena.take<Lanes<Real>>(P)) {}

    /// Bytes that a Resident takes from its arena.
    static size_t bytes(int P) { return sizeof(Lanes<Real>) * 96 * (size_t(P) + 2); }
};

/// A method at work in one call of `advance`: in every step it sees each block, looks at all, and acts on each.
template <class Real> class NeighbourForce {
  public:
    virtual ~NeighbourForce() = default;

    /// Reads a block where a step starts; head: its pose there. Blocks may come in any order and thread.
    virtual void see(const Resident<Real> &block, int number, const Pose &head) = 0;

    /// Works out what all strands do, at the same pose. Called by every thread of a parallel region, which share it.
    virtual void look(const std::vector<Resident<Real>> &blocks, const Pose &head) = 0;

    /// Writes the force on a block. Blocks may come in any order and thread.
    virtual void act(Resident<Real> &block, int number) = 0;
};

/// A method of hair-hair contact and its parameters, for strands with one rest shape.
class Neighbours {
  public:
    virtual ~Neighbours() = default;
    virtual bool fits(int S, int P) const = 0;

    /// The method at work, for steps of theta_dt [s]; the first argument only tells the precision.
    virtual std::unique_ptr<NeighbourForce<float>> start(float, double theta_dt) const = 0;
    virtual std::unique_ptr<NeighbourForce<double>> start(double, double theta_dt) const = 0;
};

} // namespace ringlet
