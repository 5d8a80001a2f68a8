// Python's view of what moves the strands: the distance to the head, how the head deforms, and the drive.
#include "bindings.hpp"

#include "advance.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/tuple.h>

#include <memory>
#include <optional>
#include <tuple>

namespace ringlet {

using Doubles = nb::ndarray<nb::numpy, double>;
using Matrices = Array<const double, -1, 4, 4>;
using RootPoses = Array<const double, -1, -1, 3, 4>;
using Blends = Array<const double, -1>;

static DistanceField make_field(Array<const float, -1, -1, -1> values, Array<const double, 3> origin, double spacing) {
    DistanceField field;
    for (int axis = 0; axis < 3; ++axis) {
        field.n[axis] = int(values.shape(axis));
        field.origin[axis] = origin.data()[axis];
        require(field.n[axis] >= 2, "DistanceField: expected at least 2 nodes along each axis");
    }
    require(values.size() < size_t(1) << 31, "DistanceField: expected fewer than 2^31 nodes");
    require(spacing > 0 && std::isfinite(spacing), "DistanceField: expected a positive spacing");
    field.spacing = spacing;
    field.values.assign(values.data(), values.data() + values.size());
    require(std::all_of(field.values.begin(), field.values.end(), [](float v) { return std::isfinite(v); }),
            "DistanceField: a value is not finite");
    field.measure_slope();
    field.measure_bricks();
    return field;
}

static std::tuple<Doubles, Doubles> distance(const DistanceField &field, Array<const double, -1, 3> points) {
    const int N = int(points.shape(0));
    auto values = new_array<double>({size_t(N)}), normals = new_array<double>({size_t(N), 3});
    nb::gil_scoped_release release;
    const int blocks = block_count<double>(N);
#pragma omp parallel for schedule(static, 256) num_threads(threads()) if (blocks > 4096)
    for (int b = 0; b < blocks; ++b) {
        BlockIndex<double> index(b, N);
        Vec3<double> x, gradient;
        Lanes<double> phi;
        gather(&x, points.data(), 1, index.strand);
        sample<double>(field, x, phi, gradient);
        gradient = (1 / square_root<double>(dot(gradient, gradient) + 1e-300)) * gradient;
        scatter(&phi, values.data(), 1, index);
        scatter(&gradient, normals.data(), 1, index);
    }
    return {values, normals};
}

static Deformation make_deformation(const DistanceField &before, Array<const float, -1, -1, -1> after,
                                    Array<const float, 3, -1, -1, -1> drift) {
    const Array<const double, 3> origin(before.origin, {3});
    Deformation deformation{make_field(after, origin, before.spacing), {}, 0};
    for (int axis = 0; axis < 3; ++axis) {
        require(deformation.after.n[axis] == before.n[axis] && drift.shape(axis + 1) == after.shape(axis),
                "Deformation: expected after (nx, ny, nz) and drift (3, nx, ny, nz) on the nodes of before");
        deformation.drift[axis] = deformation.after;
        const float *from = drift.data() + axis * after.size();
        require(std::all_of(from, from + after.size(), [](float v) { return std::isfinite(v); }),
                "Deformation: a drift is not finite");
        deformation.drift[axis].values.assign(from, from + after.size());
    }
    deformation.measure_speed(before);
    return deformation;
}

static void set_skin(Drive &drive, std::optional<RootPoses> roots, std::shared_ptr<const Deformation> deformation,
                     std::optional<Blends> blend) {
    const size_t poses = size_t(drive.steps) + 1;
    require(!roots || roots->shape(0) == poses, "Drive: expected roots (n+1, S, 3, 4)");
    require(bool(deformation) == bool(blend), "Drive: a deformation needs blend, and blend a deformation");
    require(!blend || blend->shape(0) == poses, "Drive: expected blend (n+1,)");
    if (roots) drive.roots.assign(roots->data(), roots->data() + roots->size());
    if (blend) drive.blend.assign(blend->data(), blend->data() + blend->size());
    drive.deformation = std::move(deformation);
}

static Drive make_drive(Matrices head, Array<const double, -1, 3> wind, std::optional<Matrices> hand) {
    require(head.shape(0) >= 1 && head.shape(0) == wind.shape(0) + 1,
            "Drive: expected head (n+1, 4, 4) and wind (n, 3)");
    require(!hand || hand->shape(0) == head.shape(0), "Drive: expected hand (n+1, 4, 4)");
    Drive drive;
    drive.steps = int(wind.shape(0));
    drive.wind.assign(wind.data(), wind.data() + wind.size());
    for (size_t k = 0; k < head.shape(0); ++k) {
        drive.head.push_back(Pose::of(head.data() + 16 * k));
        drive.hand.push_back(Pose::of((hand ? hand->data() : head.data()) + 16 * k));
    }
    return drive;
}

void bind_drive(nb::module_ &m) {
    nb::class_<DistanceField>(m, "DistanceField")
        .def("__init__", [](DistanceField *self, Array<const float, -1, -1, -1> values, Array<const double, 3> origin,
                            double spacing) { new (self) DistanceField(make_field(values, origin, spacing)); },
             nb::arg("values"), nb::arg("origin"), nb::arg("spacing"));
    nb::class_<Deformation>(m, "Deformation")
        .def("__init__", [](Deformation *self, const DistanceField &before, Array<const float, -1, -1, -1> after,
                            Array<const float, 3, -1, -1, -1> drift) {
            new (self) Deformation(make_deformation(before, after, drift));
        }, nb::arg("before"), nb::arg("after"), nb::arg("drift"));
    nb::class_<Drive>(m, "Drive")
        .def("__init__", [](Drive *self, Matrices head, Array<const double, -1, 3> wind, std::optional<Matrices> hand,
                            std::optional<RootPoses> roots, std::shared_ptr<const Deformation> deformation,
                            std::optional<Blends> blend) {
            set_skin(*new (self) Drive(make_drive(head, wind, hand)), roots, deformation, blend);
        }, nb::arg("head"), nb::arg("wind"), nb::arg("hand") = nb::none(), nb::arg("roots") = nb::none(),
             nb::arg("deformation") = nb::none(), nb::arg("blend") = nb::none());
    m.def("distance", &distance, nb::arg("field"), nb::arg("points"));
}

} // namespace ringlet
