// Radiance of strands towards the eye, 16 points side by side.
//
// With n fibres on the way to the light (the mean of a Poisson count) and n_b behind the point, per channel,
//
//     L = E V { e^-n sum M N + (I - e^-n) sum M(v + v_I) G(phi) + q c J sum M(v + v_J) G(pi - phi) } + environment,
//
// where I and J are the light that goes down and comes back in a two-flux layer of fibres with forward and backward
// albedo a_f and a_b: g = 1 - a_f, k^2 = g^2 - a_b^2, T = n + n_b,
//
//     I = [(k+g) e^-kn + (k-g) e^-k(2T-n)] / den,  J = a_b [e^-kn - e^-k(2T-n)] / den,  den = (k+g) + (k-g) e^-2kT.
//
// Ours; a variant of Zinke et al., Dual Scattering Approximation for Fast Multiple Scattering in Hair, SIGGRAPH 2008,
// which counts hits along the ray and truncates the layer's series. q = pi/2 turns flux into radiance, c = max(0.2, N.L).
#pragma once

#include "illumination.hpp"
#include "strand_point.hpp"

namespace ringlet {

struct StrandPoints {
    const float *points;     // (S, P, 3)
    const float *variation; // (S, 3)
    const uint32_t *key;    // (S,)
    const uint32_t *which;  // (count,) points that are shaded; null: all of them
    int P;

    StrandPoint operator[](size_t k) const {
        const size_t index = which ? which[k] : k, s = index / P;
        return {points + 3 * s * P, variation + 3 * s, key[s], int(index - s * P)};
    }
};

/// 16 points of strands, and what does not depend on the light.
struct FibrePoints {
    Vec3<float> x, at, tangent, to_eye; // x in voxels; at [m] from the middle of the shadow maps
    Floats sine, cosine, theta;     // of theta_o
    Floats level[3];                // absorption in entries of the tables
    Floats rough;                   // variance of the lobes over that of the tables
    Lobe lobes[4];
    Floats albedo[3];               // a_f + a_b across the fibre
    Words patch;                    // hash of 4 mm of its strand
};

constexpr float kPi = 3.14159265f;
constexpr float kPatch = 4e-3f; // [m] length of strand that is lit or shadowed as one

/// Colour and roughness of points at a place along their strands (0 .. 1) that differ from others by u (0 .. 1) in colour
/// and by a factor in the variance of their lobes.
inline void read_colour(const FibreTables &tables, Floats along, Floats u, Floats rougher, FibrePoints &p) {
    Floats entries[4];
    read_pigment(tables, along, u, entries);
    p.rough = rougher * entries[3];
    for (int q = 0; q < 4; ++q) p.lobes[q] = Lobe(p.rough * tables.variance[q]);
    const float scale = (tables.A - 1) / std::sqrt(tables.absorption_max);
    for (int c = 0; c < 3; ++c) {
        p.level[c] = square_root<float>(maximum<float>(entries[c], splat(0.0f))) * scale;
        Floats sums[8];
        read_sums(tables, Place(p.level[c], tables.A), Place(splat(0.0f), tables.T), sums);
        p.albedo[c] = sums[0] + sums[1];
    }
}

/// Reads 16 points of strands of P points.
inline FibrePoints gather(const StrandPoint (&points)[16], int P, const double (&eye)[3], const Illumination &light,
                          const FibreTables &tables) {
    float position[3][16], tangent[3][16], own[3][16], along[16];
    uint32_t patch[16];
    for (int i = 0; i < 16; ++i) {
        const int j = points[i].j;
        const float *root = points[i].root, *at = root + 3 * j;
        const float *before = j > 0 ? at - 3 : at, *after = j + 1 < P ? at + 3 : at;
        float spacing = 0;
        for (int c = 0; c < 3; ++c) {
            position[c][i] = at[c];
            tangent[c][i] = after[c] - before[c];
            own[c][i] = points[i].variation[c];
            spacing += (root[3 + c] - root[c]) * (root[3 + c] - root[c]);
        }
        along[i] = float(j) / float(P - 1);
        const uint32_t key = mix(points[i].key);
        // The first segment is held, so its length is the same in every frame and patches do not crawl
        const float patches = std::min(j * std::sqrt(spacing) / kPatch + float(key >> 8) * 0x1p-24f, 1e6f);
        patch[i] = mix(key ^ mix(uint32_t(patches)));
    }
    FibrePoints p;
    Vec3<float> x;
    __builtin_memcpy(&x, position, sizeof x);
    __builtin_memcpy(&p.tangent, tangent, sizeof p.tangent);
    __builtin_memcpy(&p.patch, patch, sizeof patch);
    const auto unit = [](Vec3<float> a) { return (1.0f / square_root<float>(dot(a, a) + 1e-30f)) * a; };
    p.tangent = unit(p.tangent);
    p.to_eye = unit({float(eye[0]) - x.x, float(eye[1]) - x.y, float(eye[2]) - x.z});
    p.at = from_centre(light, x);
    // Hair that is seen lies on the eye's side of its voxel, which is thicker than the layer that covers it
    p.x = in_voxels(light, x) + splat(0.5f) * p.to_eye;
    p.sine = clamp(dot(p.tangent, p.to_eye), -1, 1);
    p.cosine = square_root<float>(maximum<float>(1.0f - p.sine * p.sine, splat(1e-6f)));
    p.theta = 0.5f * kPi - arc_cosine(p.sine);
    Floats differs[3], place;
    __builtin_memcpy(differs, own, sizeof own);
    __builtin_memcpy(&place, along, sizeof along);
    read_colour(tables, place + differs[2], differs[0], differs[1], p);
    return p;
}

/// Forward, backward and twice scattered light in one channel.
struct Flux {
    Floats down, back; // I with the direct light, J
};

RINGLET_INLINE Flux two_flux(Floats a_f, Floats a_b, Floats n, Floats behind) {
    const Floats g = 1.0f - a_f, k = square_root<float>(maximum<float>(g * g - a_b * a_b, splat(1e-6f)));
    const Floats there = exponential(-k * n), behind_twice = exponential(-2.0f * k * behind);
    const Floats returned = there * behind_twice; // e^-k(2T-n)
    const Floats scale = 1.0f / ((k + g) + (k - g) * there * returned);
    return {((k + g) * there + (k - g) * returned) * scale, a_b * (there - returned) * scale};
}

/// M of the lobes R, TT and TRT + rest, widened by the light's spread.
RINGLET_INLINE void widened(const FibreTables &tables, Floats rough, Floats spread, Floats cosines, Floats sines, Floats M[3]) {
    for (int p = 0; p < 3; ++p) M[p] = along(cosines, sines, Lobe(rough * tables.variance[p] + spread));
}

/// What one light adds. noinline: the compiler keeps the 16 lanes in registers only in functions of this size.
__attribute__((noinline)) inline void add_light(const FibrePoints &p, const Illumination &light, int l,
                                                const FibreTables &tables, const Vec3<float> &normal, Floats radiance[3]) {
    const Vec3<float> L = light.direction(l);
    const ShadowMap &map = light.shadows->maps[l];
    Reach way = reach(map, p.at, 1.0f);

    // Angles of the fibre's frame
    const Floats sine = clamp(dot(p.tangent, L), -1, 1);
    const Floats cosine = square_root<float>(maximum<float>(1.0f - sine * sine, splat(1e-6f)));
    const Floats difference = p.theta - (0.5f * kPi - arc_cosine(sine));
    const Floats azimuths = clamp((dot(p.to_eye, L) - p.sine * sine) / (p.cosine * cosine), -1, 1), phi = arc_cosine(azimuths);
    way.n *= 1.0f - shared(way.way * cosine, square_root<float>(2.0f - 2.0f * azimuths), map.width);
    const Place theta((difference < 0.0f ? -difference : difference) * ((tables.T - 1) / kPi), tables.T);
    const Place azimuth(phi * ((tables.H - 1) / kPi), tables.H);

    // Spread of light that went through n fibres, from the green channel
    Floats lobes[8], sums[3][8];
    for (int c = 0; c < 3; ++c) read_sums(tables, Place(p.level[c], tables.A), theta, sums[c]);
    const Floats a_f = sums[1][0], a_b = sums[1][1], g = 1.0f - a_f;
    const Floats hits = way.n * a_f / (1.0f - exponential(-way.n * a_f) + 1e-6f);
    const Floats loss = square_root<float>(maximum<float>(g * g - a_b * a_b, splat(1e-6f)));
    const Floats cosines = cosine * p.cosine, sines = sine * p.sine;
    Floats direct[4], down[3], back[3];
    widened(tables, p.rough, minimum<float>(p.rough * hits * sums[1][5], splat(2.0f)), cosines, sines, down);
    widened(tables, p.rough, minimum<float>(p.rough * (sums[1][6] + 2.0f * sums[1][5] / (g + loss)), splat(2.0f)), cosines, sines, back);

    // The direct lobes, turned by the cuticle's scales
    for (int q = 0; q < 4; ++q) {
        const float ct = tables.tilt_cosine[q], st = tables.tilt_sine[q];
        const Floats turned = p.cosine * ct - p.sine * st;
        direct[q] = along(cosine * (turned < 0.0f ? -turned : turned), sine * (p.sine * ct + p.cosine * st), p.lobes[q]);
    }

    const Floats through = exponential(-way.n);
    const Words glint = mix(p.patch + 0x9e3779b9u * uint32_t(l + 1));
    const Floats seen = light.glints ? (uniform(glint) < through ? splat(1.0f) : splat(0.0f)) : through;
    const Floats facing = (0.5f * kPi) * maximum<float>(dot(normal, L), splat(0.2f));
    for (int c = 0; c < 3; ++c) {
        read_lobes(tables, Place(p.level[c], tables.A), theta, azimuth, lobes);
        const Flux flux = two_flux(sums[c][0], sums[c][1], way.n, way.behind);
        const Floats scattered = flux.down - through, returned = flux.back * facing;
        Floats sum = seen * (direct[0] * lobes[0] + direct[1] * lobes[1] + direct[2] * lobes[2] + direct[3] * lobes[3]);
        // G(pi - phi) = 2 mean - G(phi): the half circles complete each other
        for (int q = 0; q < 3; ++q)
            sum += scattered * down[q] * lobes[4 + q] + returned * back[q] * (2.0f * sums[c][2 + q] - lobes[4 + q]);
        radiance[c] += light.irradiance[3 * l + c] * way.visible * sum;
    }
}

/// Light of 16 points from everywhere.
inline void light_block(FibrePoints &p, const Illumination &light, const FibreTables &tables, Floats radiance[3]) {
    Floats around[8];
    read_surroundings(light, p.x, around);
    const Vec3<float> out{around[4], around[5], around[6]};
    const Vec3<float> normal = (1.0f / square_root<float>(dot(out, out) + 1e-20f)) * out;
    for (int c = 0; c < 3; ++c) radiance[c] = light.sky[c] * p.albedo[c] * around[c];
    for (int l = 0; l < light.lights; ++l) add_light(p, light, l, tables, normal, radiance);
}

/// Shades points as an eye sees them.
struct FibreShader : PointShader {
    const Illumination &light;
    const FibreTables &tables;
    double eye[3];

    FibreShader(const Illumination &light, const FibreTables &tables, const double *from)
        : light(light), tables(tables), eye{from[0], from[1], from[2]} {}

    /// The points from `first` on, 16 of them; past the last, the last again.
    template <class Points> void block(const Points &from, size_t first, size_t count, int P, float *radiance) const {
        StrandPoint points[16];
        for (size_t i = 0; i < 16; ++i) points[i] = from[std::min(first + i, count - 1)];
        FibrePoints p = gather(points, P, eye, light, tables);
        Floats sum[3];
        light_block(p, light, tables, sum);
        for (size_t i = 0; i < 16 && first + i < count; ++i)
            for (int c = 0; c < 3; ++c) radiance[3 * (first + i) + c] = sum[c][i];
    }

    void shade(const StrandPoint *points, size_t count, int P, float *radiance) const override {
        for (size_t first = 0; first < count; first += 16) block(points, first, count, P, radiance);
    }

    /// Fills `radiance` (count, 3) of the points that are wanted.
    void shade(const StrandPoints &points, size_t count, float *radiance, int threads) const {
        const ptrdiff_t blocks = ptrdiff_t((count + 15) / 16);
#pragma omp parallel for schedule(dynamic, 64) num_threads(threads)
        for (ptrdiff_t block = 0; block < blocks; ++block) this->block(points, 16 * size_t(block), count, points.P, radiance);
    }
};

} // namespace ringlet
