// Python's view of the distance to a mesh.
#include "bindings.hpp"

#include "mesh_distance.hpp"

#include <nanobind/stl/tuple.h>

#include <tuple>

namespace ringlet {

using Points = Array<const double, -1, 3>;

static std::vector<Vec> vectors(Points points) {
    std::vector<Vec> found(points.shape(0));
    for (size_t i = 0; i < found.size(); ++i) {
        const double *p = points.data() + 3 * i;
        require(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]), "MeshDistance: a point is not finite");
        found[i] = {p[0], p[1], p[2]};
    }
    return found;
}

static void make_distance(MeshDistance &distance, Points points, Array<const int32_t, -1, 3> triangles,
                          Array<const double, 3> origin, double spacing, std::tuple<int, int, int> shape) {
    std::tie(distance.n[0], distance.n[1], distance.n[2]) = shape;
    for (int axis = 0; axis < 3; ++axis) {
        require(distance.n[axis] >= 2, "MeshDistance: expected at least 2 nodes along each axis");
        distance.origin[axis] = origin.data()[axis];
    }
    require(spacing > 0 && std::isfinite(spacing), "MeshDistance: expected a positive spacing");
    require(triangles.shape(0) > 0, "MeshDistance: expected triangles");
    distance.spacing = spacing;
    distance.mesh.points = vectors(points);
    for (size_t t = 0; t < triangles.shape(0); ++t) {
        const int32_t *corner = triangles.data() + 3 * t;
        for (int k = 0; k < 3; ++k)
            require(corner[k] >= 0 && size_t(corner[k]) < points.shape(0), "MeshDistance: a triangle names no point");
        distance.mesh.triangles.push_back({{corner[0], corner[1], corner[2]}});
    }
    nb::gil_scoped_release release;
    distance.measure(threads());
    require(distance.owner[0] >= 0, "MeshDistance: the mesh lies outside the grid");
}

static nb::ndarray<nb::numpy, float> values_of(const MeshDistance &distance) {
    auto array = new_array<float>({size_t(distance.n[0]), size_t(distance.n[1]), size_t(distance.n[2])});
    std::copy(distance.values.begin(), distance.values.end(), array.data());
    return array;
}

static nb::ndarray<nb::numpy, float> drift_of(const MeshDistance &distance, Points next) {
    require(next.shape(0) == distance.mesh.points.size(), "drift: expected as many points as the mesh has");
    auto array = new_array<float>({size_t(3), size_t(distance.n[0]), size_t(distance.n[1]), size_t(distance.n[2])});
    const std::vector<Vec> points = vectors(next);
    distance.drift(points, array.data(), threads());
    return array;
}

static std::tuple<nb::ndarray<nb::numpy, int32_t>, nb::ndarray<nb::numpy, float>> feet_of(const MeshDistance &distance,
                                                                                           Points points) {
    const std::vector<Vec> queries = vectors(points);
    const ptrdiff_t N = ptrdiff_t(queries.size());
    auto triangle = new_array<int32_t>({size_t(N)});
    auto weights = new_array<float>({size_t(N), size_t(3)});
#pragma omp parallel for num_threads(threads())
    for (ptrdiff_t i = 0; i < N; ++i) {
        double weight[3] = {0, 0, 0};
        triangle.data()[i] = distance.closest(queries[i], weight);
        for (int k = 0; k < 3; ++k) weights.data()[3 * i + k] = float(weight[k]);
    }
    return {triangle, weights};
}

void bind_mesh(nb::module_ &m) {
    nb::class_<MeshDistance>(m, "MeshDistance")
        .def("__init__",
             [](MeshDistance *self, Points points, Array<const int32_t, -1, 3> triangles, Array<const double, 3> origin,
                double spacing, std::tuple<int, int, int> shape) {
                 make_distance(*new (self) MeshDistance, points, triangles, origin, spacing, shape);
             },
             nb::arg("points"), nb::arg("triangles"), nb::arg("origin"), nb::arg("spacing"), nb::arg("shape"))
        .def_prop_ro("values", &values_of, nb::rv_policy::automatic)
        .def("drift", &drift_of, nb::arg("moved"))
        .def("feet", &feet_of, nb::arg("points"));
}

} // namespace ringlet
