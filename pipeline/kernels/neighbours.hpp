// What the strands around it do to a strand: the interface between the step and the methods of hair-hair contact.
//
// Notation: x, v points and velocities, u = v + theta dv the velocity at which a step travels (implicit.hpp). A force
// from outside the strand, over the point's mass and linear in u, is  a(u) = push - C u  with C symmetric [1/s]:
// with a force f/m at the state of the step's start, push = f/m + C v. It stays right when a step is halved.
// Where several steps go by between two looks at the neighbours, f/m stays with the point, and C v follows its velocity:
// two strands that pull each other keep doing so by the same amount, so that momentum is kept. A force that is late feeds
// energy in, so that one looks at where strands will be in the middle of those steps.
#pragma once

#include "block.hpp"
#include "pose.hpp"

#include <memory>

namespace ringlet {

/// The force of the neighbours on the points of one block of strands, while a thread steps it.
template <class Real> struct Outside {
    Vec3<Real> *force; // f/m at the last look [m/s^2]
    Vec3<Real> *push;  // [m/s^2]
    Lanes<Real> *rate; // C: xx, xy, xz, yy, yz, zz of each point [1/s]

    Outside(Arena &arena, int P)
        : force(arena.take<Vec3<Real>>(P)), push(arena.take<Vec3<Real>>(P)),
          rate(arena.take<Lanes<Real>>(6 * size_t(P))) {}

    /// Bytes that an Outside takes from its arena.
    static size_t bytes(int P) { return sizeof(Lanes<Real>) * 12 * size_t(P); }

    /// C a at point i.
    RINGLET_INLINE Vec3<Real> times_rate(int i, Vec3<Real> a) const {
        const Lanes<Real> *C = rate + 6 * i;
        return {C[0] * a.x + C[1] * a.y + C[2] * a.z, C[1] * a.x + C[3] * a.y + C[4] * a.z,
                C[2] * a.x + C[4] * a.y + C[5] * a.z};
    }

    /// The push of a step that starts with these velocities.
    void begin_step(const Vec3<Real> *v, int P) {
        for (int i = 0; i < P; ++i) push[i] = force[i] + times_rate(i, v[i]);
    }
};

/// Adds the force of C u at point i to a row of the solve: block is in units of the point's mass.
template <class Real>
RINGLET_INLINE void add_rate(const Outside<Real> &outside, int i, Lanes<Real> theta_dt, Lanes<Real> (&block)[6]) {
    for (int k = 0; k < 6; ++k) block[k] += theta_dt * outside.rate[6 * i + k];
}

/// push - C v at point i.
template <class Real> RINGLET_INLINE Vec3<Real> acceleration(const Outside<Real> &outside, int i, Vec3<Real> v) {
    return outside.push[i] - outside.times_rate(i, v);
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
    Vec3<Real> *nearby; // last samples of the head's field, see Contacts
    Lanes<Real> *phi;

    Resident(Arena &arena, int P, const BlockIndex<Real> &index)
        : index(index), block(arena, P), now(arena, P), nearby(arena.take<Vec3<Real>>(P)),
          phi(arena.take<Lanes<Real>>(P)) {}

    /// Bytes that a Resident takes from its arena.
    static size_t bytes(int P) { return sizeof(Lanes<Real>) * 64 * (size_t(P) + 2); }
};

/// A method at work in one call of `advance`: at every look it sees each block, looks at all, and acts on each.
template <class Real> class NeighbourForce {
  public:
    virtual ~NeighbourForce() = default;

    /// Reads a block at the time of a look. What is seen is to serve for a while: in the middle of its steps are `ahead`
    /// [s] later, where the head has this pose. Blocks may come in any order and thread.
    virtual void see(const Resident<Real> &block, int number, const Pose &head, double ahead) = 0;

    /// Works out what all strands do; with the same pose. Called by every thread of a parallel region, which share it.
    virtual void look(const Pose &head) = 0;

    /// Writes `force` and `rate` for a block that is as it was seen. Blocks may come in any order and thread.
    virtual void act(const Resident<Real> &block, int number, Outside<Real> &outside) = 0;
};

/// A method of hair-hair contact and its parameters, for strands with one rest shape.
class Neighbours {
  public:
    virtual ~Neighbours() = default;
    virtual bool fits(int S, int P) const = 0;

    /// Steps from one look to the next; the first step of a call looks.
    virtual int hold() const { return 1; }

    /// The method at work, for steps of theta_dt [s]; the first argument only tells the precision.
    virtual std::unique_ptr<NeighbourForce<float>> start(float, double theta_dt) const = 0;
    virtual std::unique_ptr<NeighbourForce<double>> start(double, double theta_dt) const = 0;
};

} // namespace ringlet
