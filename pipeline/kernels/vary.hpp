// What makes a copy differ from the groom strand that it is copied from: its segments at rest, a lane per strand.
//
// Every part bends the strand and none stretches it: afterwards a segment has its parent's length times the scale.
// The direction of the first segment is the parent's: how hair leaves the skin is the groom's to say.
#pragma once

#include "simd.hpp"

#include <cmath>
#include <cstdint>

namespace ringlet {

struct ExpandStyle {
    float skin, clump, frizz; // [m], 0 .. 1, [rad]
};

typedef uint32_t KeyLanes __attribute__((vector_size(64)));

/// The copies of a block.
struct Copies {
    Mask<float> varied; // set in lanes that hold a copy
    KeyLanes key;
    Lanes<float> scale, cosine, sine; // length factor; of the phase
    Vec3<float> offset;               // from the parent's root to the copy's
};

/// Uniform in [-1, 1), by the hash of pipeline.strands.random.
RINGLET_INLINE Lanes<float> signed_uniform(KeyLanes key, uint32_t salt) {
    KeyLanes h = key * 0x9E3779B1u + salt * 0xC2B2AE35u;
    h = (h ^ (h >> 16)) * 0x7FEB352Du;
    h = (h ^ (h >> 15)) * 0x846CA68Bu;
    h ^= h >> 16;
    return __builtin_convertvector(Mask<float>(h >> 8), Lanes<float>) * 0x1p-23f - 1.0f;
}

RINGLET_INLINE Lanes<float> length(Vec3<float> a) { return square_root<float>(dot(a, a)); }

/// Smooth noise along a strand: random vectors at every fourth segment, none at the root.
class Noise {
  public:
    explicit Noise(KeyLanes key) : key_(key), from_{}, to_(knot(1)) {}

    RINGLET_INLINE Vec3<float> at(int j) {
        if (j > 0 && j % kStep == 0) from_ = to_, to_ = knot(j / kStep + 1);
        const float u = float(j % kStep) / kStep, smooth = u * u * (3 - 2 * u);
        return from_ + splat<float>(smooth) * (to_ - from_);
    }

  private:
    static constexpr int kStep = 4;

    RINGLET_INLINE Vec3<float> knot(uint32_t i) const {
        return {signed_uniform(key_, 3 * i), signed_uniform(key_, 3 * i + 1), signed_uniform(key_, 3 * i + 2)};
    }

    KeyLanes key_;
    Vec3<float> from_, to_;
};

/// Turns the parents' segments e (P-1) and their lengths into those of the copies; x (P) are the parents' points.
///
/// Phase: a segment is turned about the smoothed direction of its strand, the chord over a quarter of its length
/// (shorter at the ends), which leaves that direction and the curl's radius as they are. Clump: the offset of the
/// roots is taken back more and more towards the tip.
inline void vary(Vec3<float> *e, Lanes<float> *whole, const Vec3<float> *x, int P, const Copies &copies,
                 const ExpandStyle &style) {
    const Lanes<float> none = splat(1e-30f); // keeps a direction that does not exist finite
    const Lanes<float> scale = select<float>(copies.varied, copies.scale, splat(1.0f));
    const int half = (P - 1) / 8;
    const float closing = 2 * style.clump / (float(P - 1) * float(P - 1));
    Noise noise(copies.key);
    for (int j = 0; j + 1 < P; ++j) {
        int reach = half < j ? half : j;
        if (P - 2 - j < reach) reach = P - 2 - j;
        const Vec3<float> chord = x[j + 1 + reach] - x[j - reach];
        const Vec3<float> axis = inverse_root<float>(dot(chord, chord) + none) * chord;
        // Rodrigues about the chord, then clump and frizz
        Vec3<float> d = copies.cosine * e[j] + copies.sine * cross(axis, e[j]) +
                        ((1 - copies.cosine) * dot(axis, e[j])) * axis;
        if (j > 0) d = d - splat((j + 0.5f) * closing) * copies.offset;
        d = d + (style.frizz * whole[j]) * noise.at(j);
        whole[j] *= scale;
        d = (whole[j] * inverse_root<float>(dot(d, d) + none)) * d;
        e[j] = select(copies.varied, d, e[j]);
    }
}

} // namespace ringlet
