// Python's view of the density grid, the sweeps and the sky.
#include "bindings.hpp"

#include "density.hpp"
#include "sky.hpp"
#include "sweep.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>

#include <array>
#include <cstring>
#include <optional>

namespace ringlet {

using Floats1 = Array<const float, 3>;
using Vectors = Array<const float, -1, 3>;
using Volume = Array<const float, -1, -1, -1>;
using Volumes = Array<const float, -1, -1, -1, -1>;
using Doubles3 = Array<const double, 3>;

static void check_directions(const Vectors &directions, const char *message) {
    for (size_t i = 0; i < directions.shape(0); ++i) {
        const float *d = directions.data() + 3 * i;
        require(std::abs(d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - 1) < 1e-4f, message);
    }
}

static void make_grid(DensityGrid *grid, std::array<int, 3> shape, Doubles3 origin, double spacing, double width) {
    for (int extent : shape) require(extent >= 4 && extent <= 1024, "DensityGrid: expected 4 .. 1024 voxels along each axis");
    require(spacing > 0 && std::isfinite(spacing), "DensityGrid: expected a positive spacing");
    require(width > 0 && std::isfinite(width), "DensityGrid: expected a positive width");
    const double *o = origin.data();
    new (grid) DensityGrid{shape, {o[0], o[1], o[2]}, spacing, spacing * width / 4096, {}};
}

static void add(DensityGrid &grid, Array<const float, -1, -1, 3> points, Array<const float, -1, -1> widths) {
    const size_t S = points.shape(0), P = points.shape(1);
    require(widths.shape(0) == S && widths.shape(1) == P, "DensityGrid.add: widths do not have the shape of points");
    // A grid for each thread costs memory: eight fill it as fast as memory takes it
    const int count = std::min(threads(), 8);
    if (int(grid.counts.size()) < count) grid.counts.resize(count);
    nb::gil_scoped_release release;
#pragma omp parallel for schedule(static, 1) num_threads(count)
    for (int thread = 0; thread < count; ++thread) {
        auto &counts = grid.counts[thread];
        counts.resize(grid.voxels());
        for (size_t s = S * thread / count; s < S * (thread + 1) / count; ++s)
            add_strand(grid, counts.data(), points.data() + s * P * 3, widths.data() + s * P, int(P));
    }
}

static nb::ndarray<nb::numpy, float> density(const DensityGrid &grid) {
    const auto n = grid.shape;
    auto values = new_array<float>({size_t(n[0]), size_t(n[1]), size_t(n[2])});
    float *data = values.data();
    nb::gil_scoped_release release;
    read_density(grid, data, threads());
    blur(data, n.data(), threads());
    return values;
}

static nb::ndarray<nb::numpy, float> optical_depth(Volumes density, double spacing, Vectors directions) {
    const size_t N = directions.shape(0), sources = density.shape(0);
    require(sources == N || sources == 1, "optical_depth: expected one density, or one for each direction");
    require(spacing > 0, "optical_depth: expected a positive spacing");
    check_directions(directions, "optical_depth: expected unit directions");
    const int n[3] = {int(density.shape(1)), int(density.shape(2)), int(density.shape(3))};
    const size_t voxels = density.shape(1) * density.shape(2) * density.shape(3);
    auto depth = new_array<float>({N, density.shape(1), density.shape(2), density.shape(3)});
    float *out = depth.data();
    nb::gil_scoped_release release;
    std::vector<SweptVoxels> swept;
    for (size_t k = 0; k < sources; ++k) swept.emplace_back(density.data() + k * voxels, n, threads());
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads())
    for (size_t i = 0; i < N; ++i) {
        const float *direction = directions.data() + 3 * i;
        const Rows rows(n, dominant(direction) == 2);
        std::vector<float> found(rows.size());
        sweep<1>({&swept[sources == 1 ? 0 : i]}, spacing, direction,
                 [&](size_t at, const Floats (&tau)[1]) { std::memcpy(found.data() + at, tau, sizeof tau); });
        for (int x = 0; x < n[0]; ++x) rows.each(x, [&](size_t at, size_t voxel) { out[i * voxels + voxel] = found[at]; });
    }
    return depth;
}

static nb::ndarray<nb::numpy, float> body(const DistanceField &field, Array<const double, 4, 4> pose,
                                          std::array<int, 3> shape, Doubles3 origin, double spacing) {
    for (int extent : shape) require(extent > 0, "body_density: expected a positive shape");
    require(spacing > 0, "body_density: expected a positive spacing");
    auto values = new_array<float>({size_t(shape[0]), size_t(shape[1]), size_t(shape[2])});
    const double *o = origin.data();
    const GridFrame grid{{shape[0], shape[1], shape[2]}, {o[0], o[1], o[2]}, spacing};
    float *out = values.data();
    nb::gil_scoped_release release;
    body_density(field, Pose::of(pose.data()), grid, out, threads());
    return values;
}

static_assert(sizeof(Answer) == 17 * sizeof(float));

/// One answer for each direction, of mean 1 in each channel.
static void check_answers(const Array<const float, -1, 17> &answers, size_t directions) {
    require(answers.shape(0) == directions, "surroundings: answers do not fit directions");
    for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (size_t i = 0; i < directions; ++i) {
            const float answer = answers.data()[17 * i + c];
            require(answer >= 0, "surroundings: expected answers of 0 or more");
            sum += answer;
        }
        require(std::abs(sum - double(directions)) < 1e-4 * double(directions), "surroundings: expected answers of mean 1");
    }
}

static nb::tuple surroundings(Volume hair, std::optional<Volume> body, double spacing, Floats1 loss, Vectors directions,
                              Array<const float, -1, 17> answers) {
    int n[3];
    for (int axis = 0; axis < 3; ++axis) {
        require(!body || hair.shape(axis) == 2 * body->shape(axis), "surroundings: expected a body of half as many voxels");
        require(hair.shape(axis) % 2 == 0 && hair.shape(axis) >= 4, "surroundings: expected even extents, 4 or more");
        n[axis] = int(hair.shape(axis));
    }
    require(spacing > 0, "surroundings: expected a positive spacing");
    check_directions(directions, "surroundings: expected unit directions");
    check_answers(answers, directions.shape(0));
    auto records = new_array<float>({size_t(n[0] / 2), size_t(n[1] / 2), size_t(n[2] / 2), size_t(16)});
    auto open = new_array<float>({size_t(n[0] / 2), size_t(n[1] / 2), size_t(n[2] / 2), size_t(4)});
    float *out = records.data(), *plain = open.data();
    {
    nb::gil_scoped_release release;
    Sky sky{halve(hair.data(), n, threads()), body ? body->data() : nullptr, {n[0] / 2, n[1] / 2, n[2] / 2}, 2 * spacing, loss.data(),
            directions.data(), reinterpret_cast<const Answer *>(answers.data()), int(directions.shape(0))};
    write_transmittance(sky, out, plain, threads());
    add_normals(sky, out, threads());
    }
    return nb::make_tuple(records, open);
}

void bind_density(nb::module_ &m) {
    nb::class_<DensityGrid>(m, "DensityGrid")
        .def("__init__", &make_grid, nb::arg("shape"), nb::arg("origin"), nb::arg("spacing"), nb::arg("width"))
        .def("add", &add, nb::arg("points"), nb::arg("widths"))
        .def("density", &density)
        .def_ro("shape", &DensityGrid::shape)
        .def_ro("origin", &DensityGrid::origin)
        .def_ro("spacing", &DensityGrid::spacing);
    m.def("optical_depth", &optical_depth, nb::arg("density"), nb::arg("spacing"), nb::arg("directions"));
    m.def("body_density", &body, nb::arg("field"), nb::arg("pose"), nb::arg("shape"), nb::arg("origin"), nb::arg("spacing"));
    m.def("surroundings", &surroundings, nb::arg("hair"), nb::arg("body").none(), nb::arg("spacing"), nb::arg("loss"),
          nb::arg("directions"), nb::arg("answers"));
}

} // namespace ringlet
