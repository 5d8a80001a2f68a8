// What lies between any point and a light: layers of hair behind the surface that the light meets first, and the head.
//
// Seen from the light, hair lies on a map of nodes (u, v), w away from the light. Under the front f(u, v), a bilinear
// sheet that no strand is before, hair counts in layers that double in thickness every third: with d = w - f and
// x = 1 + d / unit, layer c = 3 log2 x, linear in x within each octave. Thin where light enters, they resolve single
// strands of the surface, which voxels do not. A part of a segment adds length * width on the map to the layer of the
// nearest node; N(c), the sum of the layers before, over a node's area, is the mean number of strands on the way.
// Sums are integers: they depend neither on threads nor on the order of strands.
// Source: Yuksel and Keyser, Deep Opacity Maps, Eurographics 2008 (layers that begin at the first surface).
#pragma once

#include "elementary.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace ringlet {

/// Numbers N as 16 bits each, five of them the exponent: to 1 / 2048 of 32 N in 2^-14 .. 65504, and 0 below.
struct Sums {
    std::unique_ptr<uint16_t[]> bits;
    size_t room = 0;

    /// Room for so many, which hold anything: they are written 16 at a time.
    void resize(size_t count) {
        if (count > room) bits.reset(), bits.reset(new uint16_t[count]), room = count;
    }

    /// Writes 16 numbers, rounded; larger ones become the largest.
    static RINGLET_INLINE void write(uint16_t *to, Floats n) {
        typedef uint16_t Halves __attribute__((vector_size(32)));
        const Floats scaled = minimum<float>(32.0f * n, splat(65504.0f));
        Words words;
        __builtin_memcpy(&words, &scaled, sizeof words);
        words = scaled < 0x1p-14f ? Words{} : (words - (112u << 23) + 0x1000) >> 13;
        const Halves halves = __builtin_convertvector(words, Halves);
        __builtin_memcpy(to, &halves, sizeof halves);
    }

    /// Numbers `at` and `at` + 1 of every lane.
    RINGLET_INLINE void read_pairs(Ints at, Floats &first, Floats &second) const {
        Words pair;
#ifdef __AVX512F__
        pair = Words(_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), 0xffff, __m512i(at), bits.get(), 2));
#else
        for (int k = 0; k < 16; ++k) __builtin_memcpy((char *)&pair + 4 * k, bits.get() + at[k], sizeof(uint32_t));
#endif
        first = unpacked(pair & 0xffff), second = unpacked(pair >> 16);
    }

    static RINGLET_INLINE Floats unpacked(Words half) {
        Floats value;
        half <<= 13;
        __builtin_memcpy(&value, &half, sizeof value);
        return value * 0x1p107f; // 2^112 / 32
    }
};

struct ShadowMap {
    static constexpr int kLayers = 32; // sums kept per node: 31 layers
    static constexpr int kOctave = 3;  // layers until their thickness doubles
    static constexpr float kFar = 1e9f; // [m] nothing is there

    float axis[3][3];             // u, v, and w away from the light
    std::array<double, 3> centre; // [m] where u = v = w = 0
    float low[3];                 // [m] u, v, w of the first node and of layer 0
    float spacing, unit;          // [m] between nodes; of x
    int n[2];                     // nodes along u and v
    float width;                  // [m] of a typical strand
    float opacity;                // of strands at random that shade like the strands here, per strand
    float own;                    // what a strand's own width adds to N at its middle
    std::vector<float> surface;   // (nu, nv, 2): front [m] above low[2], sum of all layers
    Sums layers;                  // (nu, nv, kLayers): N
    std::vector<float> solid;     // (nu, nv): where the light meets the head [m] above low[2]

    size_t nodes() const { return size_t(n[0]) * n[1]; }
};

/// Where a ray through a point meets a map: u and v in nodes, w [m] from layer 0.
RINGLET_INLINE Vec3<float> on_map(const ShadowMap &map, Vec3<float> x) {
    const float (&a)[3][3] = map.axis;
    const float inverse = 1 / map.spacing;
    return {(a[0][0] * x.x + a[0][1] * x.y + a[0][2] * x.z - map.low[0]) * inverse,
            (a[1][0] * x.x + a[1][1] * x.y + a[1][2] * x.z - map.low[1]) * inverse,
            a[2][0] * x.x + a[2][1] * x.y + a[2][2] * x.z - map.low[2]};
}

/// Strands on the way to a light and behind a point, and how much the head lets through.
struct Reach {
    Floats n, behind, visible;
    Floats way;     // [m] from the front
    Floats crowded; // [1/m] strands on the way through the hair just behind
};

/// At 16 points, from the map's centre on. `own`: how much of the strands there are the points' own strands.
RINGLET_INLINE Reach reach(const ShadowMap &map, Vec3<float> x, float own) {
    const Vec3<float> g = on_map(map, x);
    const Ints inside = (g.x >= 0.0f) & (g.x < float(map.n[0] - 1)) & (g.y >= 0.0f) & (g.y < float(map.n[1] - 1));
    const Floats u = inside ? g.x : splat(0.0f), v = inside ? g.y : splat(0.0f), w = inside ? g.z : splat(0.0f);
    const Ints i = whole(u), j = whole(v), at = i * map.n[1] + j;
    const Floats fu = u - real(i), fv = v - real(j);
    const Floats weight[4] = {(1.0f - fu) * (1.0f - fv), (1.0f - fu) * fv, fu * (1.0f - fv), fu * fv};
    const int offset[4] = {0, 1, map.n[1], map.n[1] + 1};

    Floats front = splat(0.0f), total = splat(0.0f), lit = splat(0.0f);
    for (int k = 0; k < 4; ++k) {
        Floats f, t;
        gather_pairs<float>(map.surface.data() + 2 * offset[k], at * 2, f, t);
        front += weight[k] * f, total += weight[k] * t;
    }
    const float soft = 1 / map.spacing;
    for (int k = 0; k < 4; k += 2) {
        Floats near, next;
        gather_pairs<float>(map.solid.data() + offset[k], at, near, next);
        lit += weight[k] * clamp((near - w) * soft + 1.5f, 0, 1) + weight[k + 1] * clamp((next - w) * soft + 1.5f, 0, 1);
    }
    const Floats way = maximum<float>(w - front, splat(0.0f)), beyond = way * (1 / map.unit) + 1.0f;
    Ints bits;
    __builtin_memcpy(&bits, &beyond, sizeof bits);
    const Floats c = minimum<float>(real(bits - 0x3f800000) * (ShadowMap::kOctave / 8388608.0f), splat(ShadowMap::kLayers - 1.001f));
    const Ints below = whole(c);
    const Floats part = c - real(below);
    Floats n = splat(0.0f), deeper = splat(0.0f);
    const Ints further = below + 2 * ShadowMap::kOctave, later = further < ShadowMap::kLayers - 2 ? further : Ints{} + (ShadowMap::kLayers - 2);
    for (int k = 0; k < 4; ++k) {
        Floats here, next;
        map.layers.read_pairs((at + offset[k]) * ShadowMap::kLayers + below, here, next);
        n += weight[k] * (here + part * (next - here));
        map.layers.read_pairs((at + offset[k]) * ShadowMap::kLayers + later, here, next);
        deeper += weight[k] * (here + part * (next - here));
    }
    const Floats none = splat(0.0f), others = maximum<float>(n - own * map.own, none);
    const Floats behind = maximum<float>(total - n - own * map.own, none);
    return {inside ? others : none, inside ? behind : none, inside ? lit : splat(1.0f), way,
            inside ? maximum<float>(deeper - n - own * map.own, none) / (3.0f * (way + map.unit)) : none};
}

/// Part of the strands before a point that hide it from the eye and the light alike, so that of a point that is seen they
/// hide nothing: where both look at a strand from azimuths `a` (as a chord of the unit circle) apart, a strand at the
/// distance s is before both as long as the rays are not as far apart as it is wide, a s < D. The mean of 1 - a s / D
/// over the way, from the next strand on. Source: the hot spot of plant canopies (Kuusk, The Hot Spot Effect of a Uniform
/// Vegetative Cover, Sov. J. Remote Sensing 1985), here for parallel cylinders.
RINGLET_INLINE Floats shared(Floats way, Floats a, float width) {
    const Floats x = a * way * (1 / width), apart = maximum<float>(1.0f - a, splat(0.0f));
    return apart * apart * (x < 1.0f ? 1.0f - 0.5f * x : 0.5f / x);
}

} // namespace ringlet
