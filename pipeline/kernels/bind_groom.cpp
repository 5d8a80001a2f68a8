// Python's view of grooming: random numbers, equal spacing, growth, curls, clumps, and keeping out of the skin.
#include "bindings.hpp"

#include "coil.hpp"
#include "grow.hpp"
#include "polylines.hpp"
#include "random.hpp"
#include "smooth_curve.hpp"

#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

namespace ringlet {

using Numbers = nb::ndarray<nb::numpy, double>;
using Strands = Array<const double, -1, -1, 3>;
using PerStrand = Array<const double, -1>;
using Vectors = Array<const double, -1, 3>;

/// Chunks of strands are made side by side: a call of few strands starts no threads of its own.
static int threads_for(size_t strands) { return strands > 4096 ? threads() : 1; }

static nb::ndarray<nb::numpy, uint32_t> hash_all(Array<const uint32_t, -1> index, uint32_t word) {
    const size_t N = index.shape(0);
    auto out = new_array<uint32_t>({N});
    for_indices(index.data(), N, [&](size_t begin, Indices8 of, size_t count) {
        const Indices8 hash = hashed(of, word);
        __builtin_memcpy(out.data() + begin, &hash, count * sizeof(uint32_t));
    });
    return out;
}

static Numbers normal_all(Array<const uint32_t, -1> index, uint32_t word, uint32_t second) {
    const size_t N = index.shape(0);
    auto out = new_array<double>({N});
    for_indices(index.data(), N, [&](size_t begin, Indices8 of, size_t count) {
        const Doubles8 numbers = standard_normal(hashed(of, word), hashed(of, second));
        __builtin_memcpy(out.data() + begin, &numbers, count * sizeof(double));
    });
    return out;
}

static Numbers resampled(Strands points, int count) {
    const size_t S = points.shape(0), P = points.shape(1);
    require(P >= 2 && count >= 2, "resampled: expected strands of at least 2 points, and a count of at least 2");
    auto out = new_array<double>({S, size_t(count), size_t(3)});
    nb::gil_scoped_release release;
    resample(points.data(), int(S), int(P), count, out.data(), threads_for(S));
    return out;
}

/// Runs work(index of the block, its points, scratch of P points) for the blocks of strands (S, P, 3), and writes the
/// scratch to the result.
template <class Work> static Numbers for_blocks(Strands points, const Work &work) {
    const size_t S = points.shape(0), P = points.shape(1);
    auto out = new_array<double>({S, P, size_t(3)});
    const double *from = points.data();
    double *to = out.data();
    nb::gil_scoped_release release;
    const int blocks = block_count<double>(int(S));
#pragma omp parallel num_threads(threads_for(S))
    {
        Arena arena(2 * P * sizeof(Vec3<double>));
        Vec3<double> *x = arena.take<Vec3<double>>(P), *moved = arena.take<Vec3<double>>(P);
#pragma omp for schedule(dynamic, 16)
        for (int b = 0; b < blocks; ++b) {
            const BlockIndex<double> index(b, int(S));
            gather(x, from, int(P), index.strand);
            work(index, x, moved);
            scatter(moved, to, int(P), index);
        }
    }
    return out;
}

static Numbers coiled(Strands points, Vectors reference, PerStrand length, Array<const double, -1, 6> coil) {
    const size_t S = points.shape(0), P = points.shape(1);
    require(P >= 2, "coiled: expected strands of at least 2 points");
    require(reference.shape(0) == S && length.shape(0) == S && coil.shape(0) == S, "coiled: expected a row for each strand");
    return for_blocks(points, [&](const BlockIndex<double> &index, const Vec3<double> *x, Vec3<double> *moved) {
        Vec3<double> towards;
        Lanes<double> whole, row[6];
        gather(&towards, reference.data(), 1, index.strand);
        gather<double>(&whole, length.data(), 1, 1, index.strand);
        gather<double>(row, coil.data(), 6, 6, index.strand);
        wind(x, int(P), towards, whole, {row[0], row[1], row[2], row[3], row[4], row[5]}, moved);
    });
}

static Numbers shaken(Strands points, PerStrand length, Array<const double, -1, -1, 5> sines, PerStrand rise) {
    const size_t S = points.shape(0), P = points.shape(1), K = sines.shape(1);
    require(P >= 2, "shaken: expected strands of at least 2 points");
    require(K <= 8, "shaken: expected at most 8 sines");
    require(length.shape(0) == S && sines.shape(0) == S && rise.shape(0) == S, "shaken: expected a row for each strand");
    return for_blocks(points, [&](const BlockIndex<double> &index, const Vec3<double> *x, Vec3<double> *moved) {
        Lanes<double> whole, over, row[40];
        Sine own[8];
        gather<double>(&whole, length.data(), 1, 1, index.strand);
        gather<double>(&over, rise.data(), 1, 1, index.strand);
        gather<double>(row, sines.data(), int(5 * K), int(5 * K), index.strand);
        for (size_t k = 0; k < K; ++k) {
            const Lanes<double> *r = row + 5 * k;
            own[k] = {r[0], r[1], {r[2], r[3], r[4]}};
        }
        std::copy(x, x + P, moved);
        shake(moved, int(P), whole, own, int(K), over);
    });
}

static Numbers turned(Strands points, PerStrand length, Array<const double, -1, 6> turn) {
    const size_t S = points.shape(0), P = points.shape(1);
    require(P >= 2, "turned: expected strands of at least 2 points");
    require(length.shape(0) == S && turn.shape(0) == S, "turned: expected a row for each strand");
    return for_blocks(points, [&](const BlockIndex<double> &index, const Vec3<double> *x, Vec3<double> *moved) {
        Lanes<double> whole, row[6];
        gather<double>(&whole, length.data(), 1, 1, index.strand);
        gather<double>(row, turn.data(), 6, 6, index.strand);
        turn_segments(x, int(P), whole, {{row[0], row[1], row[2]}, row[3], row[4], row[5]}, moved);
    });
}

static Numbers drawn_in(Strands points, PerStrand length, Strands middles, PerStrand middle_length,
                        Array<const int64_t, -1> lock, Array<const double, -1, 4> pull) {
    const size_t S = points.shape(0), P = points.shape(1), M = middles.shape(0);
    require(P >= 2 && middles.shape(1) >= 2, "drawn_in: expected strands of at least 2 points");
    require(length.shape(0) == S && lock.shape(0) == S && pull.shape(0) == S, "drawn_in: expected a row for each strand");
    require(middle_length.shape(0) == M, "drawn_in: expected a length for each middle");
    const int64_t *of = lock.data();
    require(std::all_of(of, of + S, [&](int64_t l) { return l >= 0 && size_t(l) < M; }), "drawn_in: no such lock");
    auto out = new_array<double>({S, P, size_t(3)});
    nb::gil_scoped_release release;
    const Middles all{middles.data(), middle_length.data(), int(middles.shape(1))};
#pragma omp parallel for schedule(static, 64) num_threads(threads_for(S))
    for (ptrdiff_t i = 0; i < ptrdiff_t(S); ++i) {
        const double *row = pull.data() + 4 * i;
        draw_in(points.data() + i * 3 * P, int(P), length.data()[i], all, of[i], {row[0], row[1], row[2], row[3]},
                out.data() + i * 3 * P);
    }
    return out;
}

static Numbers shortened(Strands points, PerStrand length, int count) {
    const size_t S = points.shape(0), P = points.shape(1);
    require(P >= 2 && count >= 2, "shortened: expected strands and a count of at least 2 points");
    require(length.shape(0) == S, "shortened: expected a length for each strand");
    auto out = new_array<double>({S, size_t(count), size_t(3)});
    nb::gil_scoped_release release;
#pragma omp parallel for schedule(static, 64) num_threads(threads_for(S))
    for (ptrdiff_t i = 0; i < ptrdiff_t(S); ++i)
        cut_to(points.data() + i * 3 * P, int(P), length.data()[i], count, out.data() + i * 3 * count);
    return out;
}

static Numbers first_outside(Strands points, PerStrand margin, Array<const double, 4> shape, bool ball, double hang) {
    const size_t S = points.shape(0), P = points.shape(1);
    require(margin.shape(0) == S, "first_outside: expected a margin for each strand");
    auto out = new_array<double>({S});
    const double *n = shape.data();
    const Cut cut{{n[0], n[1], n[2]}, n[3], ball, hang};
    nb::gil_scoped_release release;
#pragma omp parallel for schedule(static, 64) num_threads(threads_for(S))
    for (ptrdiff_t i = 0; i < ptrdiff_t(S); ++i)
        out.data()[i] = first_outside(points.data() + i * 3 * P, int(P), margin.data()[i], cut);
    return out;
}

static std::tuple<Numbers, Numbers> outside(const DistanceField &field, Strands points, PerStrand clearance, int rounds) {
    const size_t S = points.shape(0), P = points.shape(1);
    require(clearance.shape(0) == P, "outside: expected a clearance for each point of a strand");
    auto deepest = new_array<double>({S});
    const double *keep = clearance.data();
    auto moved = for_blocks(points, [&](const BlockIndex<double> &index, const Vec3<double> *x, Vec3<double> *out) {
        Lanes<double> worst{};
        for (size_t j = 0; j < P; ++j) {
            out[j] = x[j];
            for (int round = 0; round < rounds && std::isfinite(keep[j]); ++round) {
                Lanes<double> d;
                Vec3<double> n;
                sample<double>(field, out[j], d, n);
                const Lanes<double> depth = maximum<double>(keep[j] - d, Lanes<double>{});
                if (!any<double>(depth > 0)) break;
                out[j] = out[j] + (depth * inverse_root<double>(dot(n, n) + 1e-300)) * n;
                worst = maximum<double>(worst, depth);
            }
        }
        scatter(&worst, deepest.data(), 1, index);
    });
    return {moved, deepest};
}

/// Where rays first meet the skin when they come from `reach` before their origin: sphere tracing.
static Numbers traced(const DistanceField &field, Array<const double, 3> origin, Vectors rays, double reach, int steps) {
    const size_t N = rays.shape(0);
    auto out = new_array<double>({N, size_t(3)});
    const Vec3<double> center = broadcast<double>(origin.data());
    nb::gil_scoped_release release;
    const int blocks = block_count<double>(int(N));
#pragma omp parallel num_threads(threads_for(N))
    {
        Vec3<double> ray{}, x, gradient;
#pragma omp for schedule(static, 256)
        for (int b = 0; b < blocks; ++b) {
            const BlockIndex<double> index(b, int(N));
            gather(&ray, rays.data(), 1, index.strand);
            Lanes<double> far = splat(reach), d;
            for (int step = 0; step < steps; ++step) {
                sample<double>(field, center + far * ray, d, gradient);
                far -= d;
            }
            x = center + far * ray;
            scatter(&x, out.data(), 1, index);
        }
    }
    return out;
}

static Terrain make_terrain(const DistanceField &wall, Array<const double, 3> center, Array<const double, 3, 3> axes,
                            Array<const float, -1, -1, 4> grid, double step) {
    const size_t n = grid.shape(0);
    require(step > 0, "Terrain: expected a positive step");
    require(n >= 2 && n < 16384 && grid.shape(1) == n, "Terrain: expected a square grid of 2 to 16383 nodes a side");
    Terrain terrain{&wall, {}, {}, {grid.data(), grid.data() + grid.size()}, int(n), step};
    for (int k = 0; k < 3; ++k) {
        terrain.center[k] = center.data()[k];
        for (int i = 0; i < 3; ++i) terrain.axes[k][i] = axes.data()[3 * k + i];
    }
    return terrain;
}

static Numbers grown(const Terrain &terrain, Vectors roots, Vectors first, Array<const double, -1, 10> growth, Strands noise,
                     int count) {
    const size_t S = roots.shape(0), T = noise.shape(1), K = size_t(count);
    require(first.shape(0) == S && growth.shape(0) == S && noise.shape(0) == S, "grown: expected a row for each strand");
    require(count >= 2 && T * Grower::kStretch + 1 >= K, "grown: expected at least 2 points, and noise for all steps");
    auto out = new_array<double>({S, K, size_t(3)});
    nb::gil_scoped_release release;
    const int blocks = block_count<float>(int(S));
#pragma omp parallel num_threads(threads_for(S))
    {
        Arena arena((K + T) * sizeof(Vec3<float>));
        Vec3<float> *x = arena.take<Vec3<float>>(K), *wander = arena.take<Vec3<float>>(T), t{};
#pragma omp for schedule(dynamic, 16)
        for (int b = 0; b < blocks; ++b) {
            const BlockIndex<float> index(b, int(S));
            Lanes<float> row[10];
            gather(x, roots.data(), 1, index.strand);
            gather(&t, first.data(), 1, index.strand);
            gather<float>(row, growth.data(), 10, 10, index.strand);
            gather(wander, noise.data(), int(T), index.strand);
            const Growth how{row[0], row[1], row[2], row[3], {row[4], row[5], row[6]}, {row[7], row[8]}, row[9]};
            Grower(terrain, how).grow(x, int(K), t, wander);
            scatter(x, out.data(), int(K), index);
        }
    }
    return out;
}

void bind_groom(nb::module_ &m) {
    m.def("hashed", &hash_all, nb::arg("index"), nb::arg("word"));
    m.def("normal", &normal_all, nb::arg("index"), nb::arg("word"), nb::arg("second"));
    m.def("resampled", &resampled, nb::arg("points"), nb::arg("count"));
    m.def("coiled", &coiled, nb::arg("points"), nb::arg("reference"), nb::arg("length"), nb::arg("coil"));
    m.def("shaken", &shaken, nb::arg("points"), nb::arg("length"), nb::arg("sines"), nb::arg("rise"));
    m.def("turned", &turned, nb::arg("points"), nb::arg("length"), nb::arg("turn"));
    m.def("drawn_in", &drawn_in, nb::arg("points"), nb::arg("length"), nb::arg("middles"), nb::arg("middle_length"),
          nb::arg("lock"), nb::arg("pull"));
    m.def("shortened", &shortened, nb::arg("points"), nb::arg("length"), nb::arg("count"));
    m.def("first_outside", nb::overload_cast<Strands, PerStrand, Array<const double, 4>, bool, double>(&first_outside), nb::arg("points"), nb::arg("margin"), nb::arg("shape"), nb::arg("ball"),
          nb::arg("hang"));
    m.def("outside", &outside, nb::arg("field"), nb::arg("points"), nb::arg("clearance"), nb::arg("rounds"));
    m.def("traced", &traced, nb::arg("field"), nb::arg("origin"), nb::arg("rays"), nb::arg("reach"), nb::arg("steps"));
    nb::class_<Terrain>(m, "Terrain")
        .def("__init__",
             [](Terrain *self, const DistanceField &wall, Array<const double, 3> center, Array<const double, 3, 3> axes,
                Array<const float, -1, -1, 4> grid, double step) {
                 new (self) Terrain(make_terrain(wall, center, axes, grid, step));
             },
             nb::arg("wall"), nb::arg("center"), nb::arg("axes"), nb::arg("grid"), nb::arg("step"), nb::keep_alive<1, 2>())
        .def("grown", &grown, nb::arg("roots"), nb::arg("first"), nb::arg("growth"), nb::arg("noise"),
             nb::arg("count"));
}

} // namespace ringlet
