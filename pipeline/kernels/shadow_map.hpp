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

#include "distance_field.hpp"
#include "elementary.hpp"
#include "pose.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ringlet {

struct ShadowMap {
    static constexpr int kLayers = 32; // sums kept per node: 31 layers
    static constexpr int kOctave = 3;  // layers until their thickness doubles
    static constexpr float kCount = 65536; // counts for a mean of one strand
    static constexpr float kFar = 1e9f;    // [m] nothing is there

    float axis[3][3];             // u, v, and w away from the light
    std::array<double, 3> centre; // [m] where u = v = w = 0
    float low[3];                 // [m] u, v, w of the first node and of layer 0
    float spacing, unit;          // [m] between nodes; of x
    int n[2];                     // nodes along u and v
    float width;                  // [m] of a typical strand
    float opacity;                // of strands at random that shade like the strands here, per strand
    float own;                    // what a strand's own width adds to N at its middle
    std::vector<float> surface;   // (nu, nv, 2): front [m] above low[2], sum of all layers
    std::vector<float> layers;    // (nu, nv, kLayers): N
    std::vector<float> solid;     // (nu, nv): where the light meets the head [m] above low[2]

    size_t nodes() const { return size_t(n[0]) * n[1]; }

    /// A float that grows with d as the layers do: x >= 1.
    static int layer(float x) {
        int32_t bits;
        __builtin_memcpy(&bits, &x, sizeof bits);
        return std::min(int(float(bits - 0x3f800000) * (kOctave / 8388608.0f)), kLayers - 2);
    }
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
    Floats way; // [m] from the front
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
    Floats n = splat(0.0f);
    for (int k = 0; k < 4; ++k) {
        Floats here, next;
        gather_pairs<float>(map.layers.data() + offset[k] * ShadowMap::kLayers, at * ShadowMap::kLayers + below, here, next);
        n += weight[k] * (here + part * (next - here));
    }
    const Floats none = splat(0.0f), others = maximum<float>(n - own * map.own, none);
    const Floats behind = maximum<float>(total - n - own * map.own, none);
    return {inside ? others : none, inside ? behind : none, inside ? lit : splat(1.0f), way};
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

/// Strands that cast shadows, kept until all are there.
struct Casters {
    std::vector<float> points, widths; // (S, P, 3) from the centre on [m], (S, P) [m]
    int P = 0;

    size_t count() const { return P ? widths.size() / P : 0; }
};

/// Strands on the way to a light in voxels: not exact, but it tells what is deep in the hair.
struct Depths {
    static constexpr float kDeep = 16; // strands, behind which nothing is lit directly

    const float *values;    // (nx, ny, nz)
    int n[3];
    float origin[3];        // [m] middle of the first voxel, from the maps' centre on
    float inverse;          // voxels per metre

    bool deep(const float *x) const {
        size_t at = 0;
        for (int k = 0; k < 3; ++k) {
            const float v = (x[k] - origin[k]) * inverse + 0.5f;
            if (!(v >= 0 && v < float(n[k]))) return false;
            at = at * n[k] + size_t(v);
        }
        return values[at] > kDeep;
    }
};

/// Calls visit(u [nodes], v, w [m], n) for parts of a strand: one for each node that it passes, or for a segment all of
/// which is deep in the hair just one, as there only the sum matters.
template <class Visit>
inline void walk(const ShadowMap &map, const Depths &depths, const float *points, const float *widths, int P, Visit &&visit) {
    const float inverse = 1 / map.spacing;
    float before[3] = {};
    bool was_deep = false;
    for (int j = 0; j < P; ++j) {
        const float *x = points + 3 * j;
        float here[3];
        for (int k = 0; k < 3; ++k) {
            const float *a = map.axis[k];
            here[k] = (a[0] * x[0] + a[1] * x[1] + a[2] * x[2] - map.low[k]) * (k < 2 ? inverse : 1);
        }
        const bool deep = depths.deep(x);
        if (j > 0) {
            const float du = here[0] - before[0], dv = here[1] - before[1], dw = here[2] - before[2];
            const float length = std::sqrt(du * du + dv * dv);
            // Not-a-number and strands that broke cast no shadow
            if (length > 0 && length < 1e4f) {
                const int steps = deep && was_deep ? 1 : int(length) + 1;
                const float part = 1.0f / steps, share = length * 0.5f * (widths[j - 1] + widths[j]) * inverse * map.opacity * part;
                for (int s = 0; s < steps; ++s) {
                    const float t = (s + 0.5f) * part, u = before[0] + t * du, v = before[1] + t * dv, w = before[2] + t * dw;
                    if (u >= 1 && v >= 1 && u < map.n[0] - 2 && v < map.n[1] - 2 && w >= 0 && w < 10) visit(u, v, w, share);
                }
            }
        }
        for (int k = 0; k < 3; ++k) before[k] = here[k];
        was_deep = deep;
    }
}

/// Lowers a number to `value`; whatever the order, the least one stays.
inline void lower_to(uint32_t &number, uint32_t value) {
    std::atomic_ref<uint32_t> at(number);
    uint32_t old = at.load(std::memory_order_relaxed);
    while (value < old && !at.compare_exchange_weak(old, value, std::memory_order_relaxed)) {}
}

/// The front: each node's is the nearest hair in the four cells around it, so that between nodes nothing is before it.
inline void find_front(ShadowMap &map, const Casters &casters, const Depths &depths, int threads) {
    const int nu = map.n[0], nv = map.n[1];
    uint32_t far;
    __builtin_memcpy(&far, &ShadowMap::kFar, sizeof far);
    std::vector<uint32_t> nearest(map.nodes(), far); // of each cell, as bits: positive floats are in their order
#pragma omp parallel for schedule(dynamic, 256) num_threads(threads)
    for (size_t s = 0; s < casters.count(); ++s)
        walk(map, depths, casters.points.data() + 3 * s * casters.P, casters.widths.data() + s * casters.P, casters.P,
             [&](float u, float v, float w, float) {
                 uint32_t bits;
                 __builtin_memcpy(&bits, &w, sizeof bits);
                 lower_to(nearest[size_t(u) * nv + size_t(v)], bits);
             });
    map.surface.assign(2 * map.nodes(), 0.0f);
    const auto cell = [&](int i, int j) {
        float w = ShadowMap::kFar;
        if (i >= 0 && j >= 0 && i < nu && j < nv) __builtin_memcpy(&w, &nearest[size_t(i) * nv + j], sizeof w);
        return w;
    };
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int i = 0; i < nu; ++i)
        for (int j = 0; j < nv; ++j) {
            float w = std::min({cell(i, j), cell(i - 1, j), cell(i, j - 1), cell(i - 1, j - 1)});
            // Beside the hair the front goes on, so that skin there is not taken for hair
            for (int k = -2; k < 2 && w == ShadowMap::kFar; ++k)
                for (int l = -2; l < 2; ++l) w = std::min(w, cell(i + k, j + l));
            map.surface[2 * (size_t(i) * nv + j)] = w == ShadowMap::kFar ? 10.0f : w;
        }
}

/// Sums of the layers.
inline void fill_layers(ShadowMap &map, const Casters &casters, const Depths &depths, std::vector<uint32_t> &counts, int threads) {
    constexpr int K = ShadowMap::kLayers;
    const int nv = map.n[1];
    counts.assign(map.nodes() * K, 0);
    const float inverse = 1 / map.unit;
#pragma omp parallel for schedule(dynamic, 256) num_threads(threads)
    for (size_t s = 0; s < casters.count(); ++s)
        walk(map, depths, casters.points.data() + 3 * s * casters.P, casters.widths.data() + s * casters.P, casters.P,
             [&](float u, float v, float w, float share) {
                 const int i = int(u), j = int(v);
                 const float fu = u - i, fv = v - j, *f = map.surface.data() + 2 * (size_t(i) * nv + j);
                 const float front = (1 - fu) * ((1 - fv) * f[0] + fv * f[2]) + fu * ((1 - fv) * f[2 * nv] + fv * f[2 * nv + 2]);
                 const int layer = ShadowMap::layer(1 + std::max(w - front, 0.0f) * inverse);
                 const size_t node = size_t(i + (fu >= 0.5f)) * nv + j + (fv >= 0.5f);
                 std::atomic_ref<uint32_t>(counts[node * K + 1 + layer])
                     .fetch_add(uint32_t(share * ShadowMap::kCount + 0.5f), std::memory_order_relaxed);
             });
    map.layers.resize(map.nodes() * K);
#pragma omp parallel for schedule(static) num_threads(threads)
    for (size_t node = 0; node < map.nodes(); ++node) {
        uint64_t sum = 0;
        for (int k = 0; k < K; ++k) {
            sum += counts[node * K + k];
            map.layers[node * K + k] = float(double(sum) / ShadowMap::kCount);
        }
        map.surface[2 * node + 1] = map.layers[node * K + K - 1];
    }
}

/// Where rays from the light meet the head, by its distance field (Hart, Sphere Tracing, 1996).
inline void find_solid(ShadowMap &map, const DistanceField *field, const Pose &pose, int threads) {
    map.solid.assign(map.nodes(), ShadowMap::kFar);
    if (!field) return;
    const Rigid<float> to_rest(pose.inverse());
    const float reach = float(field->spacing) * (field->n[0] + field->n[1] + field->n[2]); // beyond the head
    Floats lane;
    for (int k = 0; k < 16; ++k) lane[k] = float(k);
    const auto world = [&](int k, Floats u, Floats v, Floats w) RINGLET_ALWAYS {
        return map.axis[0][k] * u + map.axis[1][k] * v + map.axis[2][k] * w + float(map.centre[k]);
    };
#pragma omp parallel for schedule(dynamic, 4) num_threads(threads)
    for (int i = 0; i < map.n[0]; ++i)
        for (int first = 0; first < map.n[1]; first += 16) {
            const Floats u = splat(map.low[0] + i * map.spacing), v = (lane + float(first)) * map.spacing + map.low[1];
            Floats way = splat(-reach), phi, hit = splat(ShadowMap::kFar);
            Vec3<float> gradient;
            Ints open = lane >= 0.0f;
            for (int step = 0; step < 128 && any<float>(open); ++step) {
                const Floats w = way + map.low[2];
                sample(*field, to_rest(Vec3<float>{world(0, u, v, w), world(1, u, v, w), world(2, u, v, w)}), phi, gradient);
                hit = (open & (phi < 1e-4f)) ? way : hit;
                open &= (phi >= 1e-4f) & (way < reach);
                way += open ? maximum<float>(phi, splat(2e-4f)) : splat(0.0f);
            }
            for (int k = 0; k < 16 && first + k < map.n[1]; ++k) map.solid[size_t(i) * map.n[1] + first + k] = hit[k];
        }
}

} // namespace ringlet
