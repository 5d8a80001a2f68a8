// Python's view of shapes of joined parts.
#include "bindings.hpp"

#include "block.hpp"
#include "parts.hpp"

#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>

#include <cmath>
#include <string>

namespace ringlet {

using Box = Array<const double, 2, 3>;
using Row3 = Array<const double, 3>;
using Turn = Array<const double, 3, 3>;

static Shape::Part part_of(const std::string &join, double blend, Box box) {
    require(join == "add" || join == "cut" || join == "clip", "Shape: join is \"add\", \"cut\" or \"clip\"");
    require(blend >= 0 && std::isfinite(blend), "Shape: expected a blend of 0 or more");
    Shape::Part part{};
    part.join = join == "add" ? Join::add : join == "cut" ? Join::cut : Join::clip;
    part.blend = blend;
    for (int k = 0; k < 3; ++k) part.low[k] = box.data()[k], part.high[k] = box.data()[3 + k];
    return part;
}

static void place(Shape::Part &part, Row3 center, Turn turn) {
    for (int i = 0; i < 3; ++i) {
        part.center[i] = center.data()[i];
        for (int k = 0; k < 3; ++k) part.turn[i][k] = turn.data()[3 * i + k];
    }
}

static void add_ellipsoid(Shape &shape, const std::string &join, double blend, Box box, Row3 center, Turn turn, Row3 radii) {
    Shape::Part part = part_of(join, blend, box);
    place(part, center, turn);
    for (int k = 0; k < 3; ++k) {
        require(radii.data()[k] > 0, "Shape: expected positive radii");
        part.radii[k] = radii.data()[k];
    }
    shape.add(std::move(part));
}

static void add_tube(Shape &shape, const std::string &join, double blend, Box box, Array<const double, -1> t,
                     Array<const double, 3, -1, 4> curve) {
    const size_t n = t.shape(0);
    require(n >= 1 && curve.shape(1) == n, "Shape: expected the curve and two derivatives at each parameter");
    Shape::Part part = part_of(join, blend, box);
    for (size_t i = 0; i < n; ++i) {
        TubeSample sample{t.data()[i], {}, {}, {}};
        for (size_t k = 0; k < 4; ++k) {
            sample.c[k] = curve.data()[4 * i + k];
            sample.v[k] = curve.data()[4 * (n + i) + k];
            sample.a[k] = curve.data()[4 * (2 * n + i) + k];
        }
        part.tube.push_back(sample);
    }
    shape.add(std::move(part));
}

static void add_group(Shape &shape, const std::string &join, double blend, Box box, Row3 center, Turn turn,
                      std::shared_ptr<Shape> group) {
    Shape::Part part = part_of(join, blend, box);
    place(part, center, turn);
    part.group = std::make_shared<const Shape>(*group);
    shape.add(std::move(part));
}

static nb::ndarray<nb::numpy, double> distance(const Shape &shape, Array<const double, -1, 3> points, double reach) {
    const int N = int(points.shape(0));
    auto values = new_array<double>({size_t(N)});
    const double *from = points.data();
    double *to = values.data();
    nb::gil_scoped_release release;
    const int blocks = block_count<double>(N);
#pragma omp parallel for schedule(dynamic, 16) num_threads(threads())
    for (int b = 0; b < blocks; ++b) {
        const BlockIndex<double> index(b, N);
        Vec3<double> p;
        gather(&p, from, 1, index.strand);
        const Lanes<double> d = shape.distance(p, reach);
        scatter(&d, to, 1, index);
    }
    return values;
}

void bind_parts(nb::module_ &m) {
    nb::class_<Shape>(m, "Shape")
        .def(nb::init<>())
        .def("ellipsoid", &add_ellipsoid, nb::arg("join"), nb::arg("blend"), nb::arg("box"), nb::arg("center"),
             nb::arg("turn"), nb::arg("radii"))
        .def("tube", &add_tube, nb::arg("join"), nb::arg("blend"), nb::arg("box"), nb::arg("t"), nb::arg("curve"))
        .def("group", &add_group, nb::arg("join"), nb::arg("blend"), nb::arg("box"), nb::arg("center"), nb::arg("turn"),
             nb::arg("group"))
        .def("distance", &distance, nb::arg("points"), nb::arg("reach"));
}

} // namespace ringlet
