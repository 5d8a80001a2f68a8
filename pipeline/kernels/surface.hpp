// Radiance of the head's surface towards the eye: skin (skin.hpp) in the shadow of hair and of itself.
#pragma once

#include "distance_field.hpp"
#include "illumination.hpp"
#include "pose.hpp"
#include "skin.hpp"

#include <cmath>
#include <optional>

namespace ringlet {

struct SurfacePoints {
    const float *points, *normals, *albedo; // (N, 3) world [m], unit, linear R, G, B
    const float *curvature;                 // (N,) [1/m]
    double eye[3];
};

/// The head that shadows itself.
struct Occluder {
    const DistanceField *field; // may be null
    Rigid<float> to_rest;
};

/// 16 points of the surface.
struct SkinPoints {
    Vec3<float> x, normal, to_eye, albedo;
    Floats curvature;
};

inline Vec3<float> read16(const float *values, size_t first, size_t count) {
    float lanes[3][16];
    for (int i = 0; i < 16; ++i)
        for (int c = 0; c < 3; ++c) lanes[c][i] = values[3 * std::min(first + i, count - 1) + c];
    Vec3<float> r;
    __builtin_memcpy(&r, lanes, sizeof r);
    return r;
}

RINGLET_INLINE Ints in_box(const DistanceField &field, const Vec3<float> &x) {
    const Floats at[3] = {x.x, x.y, x.z};
    Ints inside = at[0] == at[0];
    for (int axis = 0; axis < 3; ++axis) {
        const float low = float(field.origin[axis]), high = low + float(field.spacing) * (field.n[axis] - 1);
        inside &= (at[axis] >= low) & (at[axis] <= high);
    }
    return inside;
}

/// Part of the light that the head lets past, marching its distance field from just above the skin. The nearest miss
/// gives a penumbra (Quilez, Soft shadows in raymarched SDFs, 2010): the terminator and the chin's shadow are soft.
__attribute__((noinline)) inline Floats past_head(const Occluder &head, const SkinPoints &p, const Vec3<float> &L) {
    Floats open = splat(1.0f);
    if (!head.field) return open;
    constexpr float sharpness = 7;
    const float step = float(head.field->spacing);
    const Vec3<float> start = head.to_rest(p.x + splat(0.5f * step) * p.normal), toward = head.to_rest.turn(L);
    Floats way = splat(1.5f * step);
    Ints inside = way > 0.0f;
    for (int march = 0; march < 256 && any<float>(inside & (open > 0.0f)); ++march) {
        const Vec3<float> x = start + way * toward;
        Floats phi;
        Vec3<float> gradient;
        sample(*head.field, x, phi, gradient);
        // A ray that left the field's box does not come back
        inside &= in_box(*head.field, x);
        open = inside ? minimum<float>(open, clamp(sharpness * phi / way, 0, 1)) : open;
        way += maximum<float>(phi, splat(0.5f * step));
    }
    return open;
}

/// How far out of the grid: 0 inside, 1 from a sixteenth of its longest side on. There no hair hides the sky.
RINGLET_INLINE Floats outside(const Illumination &light, const Vec3<float> &g) {
    const Floats at[3] = {g.x, g.y, g.z};
    Floats farthest = splat(0.0f);
    for (int axis = 0; axis < 3; ++axis)
        farthest = maximum<float>(farthest, maximum<float>(-0.5f - at[axis], at[axis] - (light.n[axis] - 0.5f)));
    return clamp(farthest * (16.0f / std::max({light.n[0], light.n[1], light.n[2]})), 0, 1);
}

/// The way to the light, bent up until it clears the surface that it starts from: whether light reaches round a curve is
/// the skin's to say, not the shadow's.
RINGLET_INLINE Vec3<float> clear_of(const Vec3<float> &normal, const Vec3<float> &L, Floats c) {
    const Vec3<float> up = L + maximum<float>(0.15f - c, splat(0.0f)) * normal;
    return (1.0f / square_root<float>(dot(up, up) + 1e-12f)) * up;
}

/// How many strands n lie between light and skin, and how far off [m] the first is, at the k-th of some places that fill a
/// disc of a radius [m] around x evenly.
RINGLET_INLINE Reach reach_on_disc(const ShadowMap &map, const Vec3<float> &x, const Vec3<float> axes[2], Floats radius,
                                   int k, int places) {
    const float out = std::sqrt((k + 0.5f) / places), turn = 2.39996323f * k; // the golden angle
    return reach(map, x + (radius * (out * std::cos(turn))) * axes[0] + (radius * (out * std::sin(turn))) * axes[1], 0.0f);
}

/// Part of the light of map l, in R, G, B, that hair lets past around points `above` the skin, from the middle of the map:
/// the mean over a disc as wide as light spreads in skin (Jensen et al., A Practical Model for Subsurface Light
/// Transport, 2001). Shadows of single strands, finer than the mesh they fall on, would be stains at its points. What
/// strands have scattered, e^(-loss n) - e^-n, comes from a cone: from hair at a distance d, the mean over a disc of
/// kCone d. The part that meets no strand at all comes back: what strands have scattered gives no gloss.
inline Floats past_hair(const Illumination &light, int l, const Vec3<float> &above, const Vec3<float> &normal,
                        const float loss[3], Floats past[3]) {
    constexpr float kSpread = 4e-3f, kCone = 0.5f;
    const ShadowMap &map = light.shadows->maps[l];
    // Two axes across a unit vector: Duff et al., Building an Orthonormal Basis, Revisited (2017)
    const Floats sign = normal.z >= 0.0f ? splat(1.0f) : splat(-1.0f), part = -1.0f / (sign + normal.z);
    const Vec3<float> along{1.0f + sign * normal.x * normal.x * part, sign * normal.x * normal.y * part, -(sign * normal.x)};
    const Vec3<float> axes[2] = {along, cross(normal, along)};
    Floats straight = splat(0.0f), way = splat(0.0f), met = splat(0.0f);
    for (int k = 0; k < 8; ++k) {
        const Reach hair = reach_on_disc(map, above, axes, splat(kSpread), k, 8);
        const Floats open = exponential(-hair.n);
        straight += 0.125f * open, way += 0.125f * (1.0f - open) * hair.way, met += hair.n;
    }
    for (int c = 0; c < 3; ++c) past[c] = straight;
    if (!any<float>(met > 0.0f)) return straight; // here the disc below is the one above, which adds nothing
    const Floats radius = maximum<float>(kCone * way / (1.001f - straight), splat(kSpread));
    for (int k = 0; k < 5; ++k) {
        const Floats n = reach_on_disc(map, above, axes, radius, k, 5).n, open = exponential(-n);
        for (int c = 0; c < 3; ++c) past[c] += 0.2f * (exponential(-loss[c] * n) - open);
    }
    return straight;
}

RINGLET_INLINE Floats gloss(const SkinPoints &p, const Vec3<float> &L, Floats facing) {
    const Vec3<float> middle = p.to_eye + L;
    const Floats square = dot(middle, middle);
    const Vec3<float> half = (1.0f / square_root<float>(square + 1e-12f)) * middle;
    return gloss(dot(p.normal, half), dot(half, L), square, facing);
}

inline void light_skin(const SkinPoints &p, const Illumination &light, const Occluder &head, const float loss[3],
                       Floats radiance[3]) {
    const Floats albedo[3] = {p.albedo.x, p.albedo.y, p.albedo.z};
    // Just above the skin, where the head's voxels show no more; a half space sees half of all directions
    const Vec3<float> g = in_voxels(light, p.x) + splat(0.5f) * p.normal, above = from_centre(light, p.x);
    Floats around[4];
    SkyPlace(light, g).read<Four>(light.open, 4, around);
    const Floats beyond = outside(light, g);
    Floats open_sky = splat(0.0f);
    for (int c = 0; c < 3; ++c) {
        const Floats part = minimum<float>(2.0f * around[c], splat(1.0f)), seen = part + beyond * (1.0f - part);
        radiance[c] = light.sky[c] * albedo[c] * seen;
        open_sky += seen * (1 / 3.0f);
    }
    for (int l = 0; l < light.lights; ++l) {
        const Vec3<float> L = light.direction(l);
        const Floats cosine = dot(p.normal, L);
        if (!any<float>(cosine + kSkinReach * p.curvature > 0.0f)) continue;
        const Floats open = past_head(head, p, clear_of(p.normal, L, cosine));
        const Floats shine = gloss(p, L, maximum<float>(cosine, splat(0.0f)));
        Floats diffuse[3], past[3];
        scattered(cosine, p.curvature, diffuse);
        // Between roots little is open to a mirrored ray: skin there has the gloss of what it sees of the sky, there and back
        const Floats mirrored = shine * past_hair(light, l, above, p.normal, loss, past) * open_sky * open_sky;
        for (int c = 0; c < 3; ++c)
            radiance[c] += light.irradiance[3 * l + c] * open *
                           (past[c] * albedo[c] * diffuse[c] * (1 / 3.14159265f) + mirrored);
    }
}

/// Fills `radiance` (N, 3).
inline void shade_surface(const SurfacePoints &surface, size_t count, const Illumination &light, const Occluder &head,
                          const float loss[3], float *radiance, int threads) {
    const ptrdiff_t blocks = ptrdiff_t((count + 15) / 16);
#pragma omp parallel for schedule(dynamic, 16) num_threads(threads)
    for (ptrdiff_t block = 0; block < blocks; ++block) {
        const size_t first = 16 * size_t(block);
        SkinPoints p{read16(surface.points, first, count), read16(surface.normals, first, count), {},
                     read16(surface.albedo, first, count), {}};
        for (int i = 0; i < 16; ++i) p.curvature[i] = surface.curvature[std::min(first + i, count - 1)];
        const Vec3<float> eye{splat(float(surface.eye[0])), splat(float(surface.eye[1])), splat(float(surface.eye[2]))};
        const Vec3<float> way = eye - p.x;
        p.to_eye = (1.0f / square_root<float>(dot(way, way) + 1e-12f)) * way;
        Floats sum[3];
        light_skin(p, light, head, loss, sum);
        for (size_t i = 0; i < 16 && first + i < count; ++i)
            for (int c = 0; c < 3; ++c) radiance[3 * (first + i) + c] = sum[c][i];
    }
}

} // namespace ringlet
