// Radiance of strands towards the eye, 16 points side by side.
//
// With n fibres on the way to the light (the mean of a Poisson count) and n_b behind the point, per channel,
//
//     L = E V { e^-n sum M N + D sum M(v + v_D) G(phi) + c U sum M(v + v_U) G(pi - phi) } + S (a_f + a_b) (r + (1 - r) T),
//
// where D and U are the fluence of scattered light that goes down and that comes back up in a layer of fibres. Of direct light
// a_f is scattered on and a_b back; of scattered light, which comes from all sides, s back and a_f + a_b - s = 1 - g on. It
// goes aslant, and passes m times as many fibres as the direct light from which it stems:
//
//     D' = m (-g D + s U + a_f e^-n),  -U' = m (-g U + s D + a_b e^-n),  D(0) = 0,  U(n + n_b) = 0.
//
// m k, k^2 = g^2 - s^2, is the rate at which light fades deep in the layer; pipeline/render/fibre.py finds it without two
// streams. `test_scattered_light_is_that_of_a_layer_of_fibres` holds D and U against random walks. c = max(0.2, N.L).
//
// Of a sky S, T is what comes through hair and head as a fibre of the point's tangent answers (sky.hpp), and r = s / (g + k)
// what infinitely deep hair returns: a layer of n fibres that is lit from both sides shines as bright as (e + r) / (1 + r e) of
// the sky, e = e^-kn, nearly r + (1 - r) e. The head counts as such hair.
//
// Ours; a variant of Zinke et al., Dual Scattering Approximation for Fast Multiple Scattering in Hair, SIGGRAPH 2008, which
// counts hits along the ray and truncates the layer's series. Kubelka and Munk (1931) for the two streams, with a collimated
// source.
#pragma once

#include "illumination.hpp"
#include "near_field.hpp"
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

/// How one channel's light goes in a layer of such fibres: D and U are sums of P e^-n, Q e^-n and of exponentials at a rate,
/// each with its ratio of U to D.
struct Layer {
    Floats P, Q, rate, ratio;
    Floats twice[3]; // circle means of N_R, N_TT, N_TRT + N_rest, two times

    Layer() = default;
    RINGLET_INLINE explicit Layer(const Floats sums[8]) {
        const Floats a_f = sums[0], a_b = sums[1], s = sums[2], m = sums[3], g = 1.0f - a_f - a_b + s;
        const Floats k = square_root<float>(maximum<float>(g * g - s * s, splat(1e-6f)));
        ratio = s / (g + k);
        // Where scattered light fades just as the direct light does, the solution has another form, and this one a pole
        rate = m * k;
        const Floats off = rate - 1.0f;
        rate = off * off > 1e-6f ? rate : (off < 0.0f ? splat(0.999f) : splat(1.001f));
        const Floats fade = 1.0f + m * g;
        P = m * (m * s * a_b + a_f * fade) / (rate * rate - 1.0f), Q = m * (s * P + a_b) / fade;
        twice[0] = (a_f + a_b) * (1 / kPi) - sums[4] - sums[5], twice[1] = sums[4], twice[2] = sums[5];
    }
};

/// 16 points of strands, and what does not depend on the light.
struct FibrePoints {
    Vec3<float> x, at, tangent, to_eye; // x in voxels; at [m] from the middle of the shadow maps
    Floats sine, cosine, theta;     // of theta_o
    Floats level[3];                // absorption in entries of the tables
    Floats rough;                   // variance of the lobes over that of the tables
    Lobe lobes[4];
    Floats albedo[3];               // a_f + a_b
    Layer layers[3];
    Floats passed, forward, back;   // green's a_f; variance that each fibre adds to light it passes, and of light from behind
    Words patch;                    // of 4 mm of its strand: from hash to hash evenly spread
    Around around;                  // half a segment to both sides, half a patch at most, where strands are told apart
    Floats lit;                     // the part of it that one light reaches
    Ints told;                      // whether that is known
};

constexpr float kPatch = 4e-3f; // [m] length of strand that is lit or shadowed as one
constexpr float kUnlit = 12;    // strands behind which no light is looked for
constexpr uint32_t kTold = 7;  // of a hash
// Nodes of a shadow map. Of the strands whose shadows a node sums up the eye sees the foremost: they lie before its mean.
// `test_points_that_are_seen_are_lit_as_exact_rays_say`
constexpr float kBefore = 0.25f;

/// An inclination's place in the tables.
RINGLET_INLINE Place inclination(const FibreTables &tables, Floats theta) {
    return Place((theta < 0.0f ? -theta : theta) * (2 * (tables.T - 1) / kPi), tables.T);
}

/// Colour and roughness of points at a place along their strands (0 .. 1) that differ from others by u (0 .. 1) in colour
/// and by a factor in the variance of their lobes.
inline void read_colour(const FibreTables &tables, Floats along, Floats u, Floats rougher, FibrePoints &p) {
    Floats entries[4];
    read_pigment(tables, along, u, entries);
    p.rough = rougher * entries[3];
    for (int q = 0; q < 4; ++q) p.lobes[q] = Lobe(p.rough * tables.variance[q]);
    const float scale = (tables.A - 1) / std::sqrt(tables.absorption_max);
    const Place theta = inclination(tables, p.theta);
    for (int c = 0; c < 3; ++c) {
        p.level[c] = square_root<float>(maximum<float>(entries[c], splat(0.0f))) * scale;
        Floats sums[8];
        read_sums(tables, Place(p.level[c], tables.A), theta, sums);
        p.albedo[c] = sums[0] + sums[1];
        p.layers[c] = Layer(sums);
        if (c != 1) continue;
        const Floats g = 1.0f - sums[0], loss = square_root<float>(maximum<float>(g * g - sums[1] * sums[1], splat(1e-6f)));
        p.passed = sums[0], p.forward = p.rough * sums[6], p.back = p.rough * (sums[7] + 2.0f * sums[6] / (g + loss));
    }
}

/// The strands around 16 points of strands of P points: light on what lies farther than half a patch is other points'.
__attribute__((noinline)) inline Around look_around(const StrandPoint (&points)[16], int P, const Illumination &light) {
    float axis[3][16], ways[6][16], place[16];
    uint32_t name[16];
    Words own;
    for (int i = 0; i < 16; ++i) {
        const int j = points[i].j;
        const float *at = points[i].root + 3 * j, *before = j > 0 ? at - 3 : at, *after = j + 1 < P ? at + 3 : at;
        for (int c = 0; c < 3; ++c) axis[c][i] = at[c], ways[c][i] = before[c] - at[c], ways[3 + c][i] = after[c] - at[c];
        place[i] = float(j) / float(P - 1), name[i] = Casters::name(points[i].root), own[i] = points[i].key;
    }
    Around around;
    const Floats other = uniform(mix(own + mix(kTold)));
    around.told = other < light.shadows->told;
    __builtin_memcpy(&around.axis, axis, sizeof axis), __builtin_memcpy(&around.ways, ways, sizeof ways);
    __builtin_memcpy(&around.place, place, sizeof place), __builtin_memcpy(&around.strand, name, sizeof name);
    around.axis = from_centre(light, around.axis);
    for (Vec3<float> &way : around.ways) way = minimum<float>(splat(0.5f), 0.5f * kPatch / square_root<float>(dot(way, way) + 1e-30f)) * way;
    return around;
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
        // Steps of the golden ratio: of a strand's next patches a part e^-n is lit, more evenly than by chance
        patch[i] = key + 0x9e3779b9u * uint32_t(patches);
    }
    FibrePoints p;
    Vec3<float> x;
    __builtin_memcpy(&x, position, sizeof x);
    __builtin_memcpy(&p.tangent, tangent, sizeof p.tangent);
    __builtin_memcpy(&p.patch, patch, sizeof patch);
    const auto unit = [](Vec3<float> a) { return (1.0f / square_root<float>(dot(a, a) + 1e-30f)) * a; };
    p.tangent = unit(p.tangent);
    p.to_eye = unit({float(eye[0]) - x.x, float(eye[1]) - x.y, float(eye[2]) - x.z});
    p.at = from_centre(light, x) + splat(light.lights ? kBefore * light.shadows->maps[0].spacing : 0.0f) * p.to_eye;
    // The sky's voxels are twice as large: what is seen of one lies half of it before its mean. Within 7 % on five
    // grooms in three colours, measured: docs/shading.md
    p.x = in_voxels(light, x) + p.to_eye;
    p.sine = clamp(dot(p.tangent, p.to_eye), -1, 1);
    p.cosine = square_root<float>(maximum<float>(1.0f - p.sine * p.sine, splat(1e-6f)));
    p.theta = 0.5f * kPi - arc_cosine(p.sine);
    Floats differs[3], place;
    __builtin_memcpy(differs, own, sizeof own);
    __builtin_memcpy(&place, along, sizeof along);
    read_colour(tables, place + differs[2], differs[0], differs[1], p);
    p.told = Ints{}, p.lit = splat(0.0f);
    if (light.lights && light.shadows->told > 0) p.around = look_around(points, P, light), p.told = p.around.told;
    return p;
}

/// Fluence of scattered light in one channel.
struct Flux {
    Floats down, up;
};

/// At the depth n of n + n_b; `through` and `past` are e^-n and e^-n_b.
RINGLET_INLINE Flux two_flux(const Layer &a, Floats n, Floats behind, Floats through, Floats past) {
    const Floats there = exponential(-a.rate * n), rest = exponential(-a.rate * behind), all = a.ratio * there * rest;
    const Floats bottom = a.Q * through * past, first = (all * bottom - a.P) / (1.0f - all * all), last = -(bottom + all * first);
    return {maximum<float>(a.P * through + first * there + a.ratio * last * rest, splat(0.0f)),
            maximum<float>(a.Q * through + a.ratio * first * there + last * rest, splat(0.0f))};
}

/// How much more of a lobe is seen than of a fibre in the mean, where `crowd` fibres lie along one fibre's radius. Fibres take
/// room: of cylinders at random a side that lies x radii nearer to the eye than the axis is seen e^(crowd x) as often. R comes
/// from the side that faces eye and light, x = cos(phi / 2); TRT, of hair that is not black, from x = 2 / 3 in the mean, at any
/// phi (0.69 of white hair, 0.66 of brown); all of a fibre from x = pi / 4.
RINGLET_INLINE Floats shown(Floats crowd, Floats x) { return exponential(crowd * (x - kPi / 4)); }

/// M of the lobes R, TT and TRT + rest, widened by the light's spread.
RINGLET_INLINE void widened(const FibreTables &tables, Floats rough, Floats spread, Floats cosines, Floats sines, Floats M[3]) {
    for (int p = 0; p < 3; ++p) M[p] = along(cosines, sines, Lobe(rough * tables.variance[p] + spread));
}

/// What one light adds. noinline: the compiler keeps the 16 lanes in registers only in functions of this size. `places`
/// take what differs across the strands.
template <class Places>
__attribute__((noinline)) void add_light(const FibrePoints &p, const Illumination &light, int l, const FibreTables &tables,
                                         const Vec3<float> &normal, Floats radiance[3], Places &places) {
    const Vec3<float> L = light.direction(l);
    const ShadowMap &map = light.shadows->maps[l];
    const Reach way = reach(map, p.at, 1.0f);

    // Angles of the fibre's frame
    const Floats sine = clamp(dot(p.tangent, L), -1, 1);
    const Floats cosine = square_root<float>(maximum<float>(1.0f - sine * sine, splat(1e-6f)));
    const Floats difference = p.theta - (0.5f * kPi - arc_cosine(sine));
    const Floats azimuths = clamp((dot(p.to_eye, L) - p.sine * sine) / (p.cosine * cosine), -1, 1), phi = arc_cosine(azimuths);
    // Strands that would hide what is seen from the light itself are not there; what they scatter comes from beside them
    const Floats together = shared(way.way * cosine, square_root<float>(2.0f - 2.0f * azimuths), map.width);
    const Floats before = way.n * (1.0f - together);
    const Floats crowd = minimum<float>(0.5f * map.width * way.crowded / cosine, splat(1.0f));
    const Floats crowns = shown(crowd, square_root<float>(0.5f + 0.5f * azimuths)), flanks = shown(crowd, splat(2.0f / 3));
    const Place theta = inclination(tables, tables.reciprocal ? 0.5f * difference : p.theta);
    const Place azimuth(phi * ((tables.H - 1) / kPi), tables.H);

    // Spread of light that went through n fibres, from the green channel
    const Floats hits = way.n * p.passed / (1.0f - exponential(-way.n * p.passed) + 1e-6f);
    const Floats cosines = cosine * p.cosine, sines = sine * p.sine;
    Floats lobes[8], direct[4], down[3], back[3];
    widened(tables, p.rough, minimum<float>(hits * p.forward, splat(2.0f)), cosines, sines, down);
    widened(tables, p.rough, minimum<float>(p.back, splat(2.0f)), cosines, sines, back);

    // The direct lobes, turned by the cuticle's scales
    for (int q = 0; q < 4; ++q) {
        const float ct = tables.tilt_cosine[q], st = tables.tilt_sine[q];
        const Floats turned = p.cosine * ct - p.sine * st;
        direct[q] = along(cosine * (turned < 0.0f ? -turned : turned), sine * (p.sine * ct + p.cosine * st), p.lobes[q]);
    }

    const Floats through = exponential(-way.n), past = exponential(-way.behind);
    const Words glint = p.patch + mix(uint32_t(l + 1));
    const Floats alone = exponential(-before), chance = light.glints ? (uniform(glint) < alone ? splat(1.0f) : splat(0.0f)) : alone;
    const Floats seen = p.told ? p.lit : chance;
    const Floats facing = maximum<float>(dot(normal, L), splat(0.2f));
    places.turn(dot(cross(p.tangent, p.to_eye), L) < 0.0f ? -phi : phi, seen);
    for (int c = 0; c < 3; ++c) {
        read_lobes(tables, Place(p.level[c], tables.A), theta, azimuth, lobes);
        const Flux flux = two_flux(p.layers[c], way.n, way.behind, through, past);
        const Floats scattered = flux.down, returned = flux.up * facing;
        const Floats once = crowns * direct[0] * lobes[0] + direct[1] * lobes[1] + flanks * direct[2] * lobes[2] + direct[3] * lobes[3];
        Floats sum = seen * once;
        // G(pi - phi) = 2 mean - G(phi): the half circles complete each other
        const Floats *twice = p.layers[c].twice;
        for (int q = 0; q < 3; ++q) sum += scattered * down[q] * lobes[4 + q] + returned * back[q] * (twice[q] - lobes[4 + q]);
        const Floats lit = light.irradiance[3 * l + c] * way.visible;
        radiance[c] += lit * sum;
        places.add(c, lit * seen, direct, lobes, once);
    }
}

/// How much more of the sky than a mean fibre one of this tangent answers: 3/2 t (M - tr M / 3) t; of M xx, yy, xy, xz, yz.
RINGLET_INLINE Floats mirrors(const Vec3<float> &t, const Floats M[5]) {
    const Floats diagonal = M[0] * (t.x * t.x - t.z * t.z) + M[1] * (t.y * t.y - t.z * t.z);
    return 1.5f * (diagonal + 2.0f * (M[2] * t.x * t.y + M[3] * t.x * t.z + M[4] * t.y * t.z));
}

/// The part of the strands around 16 points that a light reaches, where it is asked for: deep in the hair it is none.
__attribute__((noinline)) inline Floats look_past(const FibrePoints &p, const Shadows &shadows, int l) {
    const Reach way = reach(shadows.maps[l], p.at, 1.0f);
    Around around = p.around;
    around.told &= (way.n < kUnlit) & (way.visible > 0.0f);
    return shadows.blockers[l].lit(shadows.maps[l], around);
}

/// Light of 16 points from everywhere.
template <class Places>
void light_block(FibrePoints &p, const Illumination &light, const FibreTables &tables, Floats radiance[3], Places &places) {
    Floats around[8], mirrored[8];
    const SkyPlace place(light, p.x);
    place.read<Eight>(light.surroundings, 16, around);
    place.read<Eight>(light.surroundings + 8, 16, mirrored);
    const Vec3<float> out{around[4], around[5], around[6]};
    const Vec3<float> normal = (1.0f / square_root<float>(dot(out, out) + 1e-20f)) * out;
    const Floats own = mirrors(p.tangent, mirrored) / maximum<float>(around[1], splat(1e-6f));
    const Floats times = clamp(1.0f + own, 0, 4);
    for (int c = 0; c < 3; ++c) {
        const Floats open = minimum<float>(around[c] * times, splat(1.0f)), r = p.layers[c].ratio;
        radiance[c] = light.sky[c] * p.albedo[c] * (r + (1.0f - r) * open);
    }
    for (int l = 0; l < light.lights; ++l) {
        if (light.shadows->told > 0) p.lit = look_past(p, *light.shadows, l);
        add_light(p, light, l, tables, normal, radiance, places);
    }
}

/// Shades points as an eye sees them.
struct FibreShader : PointShader {
    const Illumination &light;
    const FibreTables &tables;
    double eye[3];

    FibreShader(const Illumination &light, const FibreTables &tables, const double *from)
        : light(light), tables(tables), eye{from[0], from[1], from[2]} {}

    /// The points from `first` on, 16 of them; past the last, the last again.
    template <class Points> FibrePoints read(const Points &from, size_t first, size_t count, int P) const {
        StrandPoint points[16];
        for (size_t i = 0; i < 16; ++i) points[i] = from[std::min(first + i, count - 1)];
        return gather(points, P, eye, light, tables);
    }

    template <class Points> void block(const Points &from, size_t first, size_t count, int P, float *radiance) const {
        FibrePoints p = read(from, first, count, P);
        Floats sum[3];
        MeanOnly mean;
        light_block(p, light, tables, sum, mean);
        for (size_t i = 0; i < 16 && first + i < count; ++i)
            for (int c = 0; c < 3; ++c) radiance[3 * (first + i) + c] = sum[c][i];
    }

    void shade(const StrandPoint *points, size_t count, int P, float *radiance) const override {
        for (size_t first = 0; first < count; first += 16) block(points, first, count, P, radiance);
    }

    bool varies_across() const override { return tables.across; }

    void shade_across(const StrandPoint *points, size_t count, int P, Across *to) const override {
        for (size_t first = 0; first < count; first += 16) {
            FibrePoints p = read(points, first, count, P);
            Floats mean[3];
            NearField places(tables, p.level, inclination(tables, p.theta), p.cosine);
            light_block(p, light, tables, mean, places);
            places.write(mean, std::min(count - first, size_t(16)), to + first);
        }
    }

    /// Fills `radiance` (count, 3) of the points that are wanted.
    void shade(const StrandPoints &points, size_t count, float *radiance, int threads) const {
        const ptrdiff_t blocks = ptrdiff_t((count + 15) / 16);
#pragma omp parallel for schedule(dynamic, 64) num_threads(threads)
        for (ptrdiff_t block = 0; block < blocks; ++block) this->block(points, 16 * size_t(block), count, points.P, radiance);
    }
};

} // namespace ringlet
