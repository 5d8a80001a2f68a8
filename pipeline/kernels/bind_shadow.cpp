// Python's view of the shadow maps.
#include "bindings.hpp"

#include "shadows.hpp"

#include <nanobind/stl/shared_ptr.h>

namespace ringlet {

using Doubles = Array<const double, 3>;
using Directions = Array<const float, -1, 3>;

static void make_shadows(Shadows *shadows, Directions directions) {
    std::vector<std::array<float, 3>> held;
    for (size_t l = 0; l < directions.shape(0); ++l) {
        const float *d = directions.data() + 3 * l;
        require(std::abs(d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - 1) < 1e-4f, "Shadows: expected unit directions");
        held.push_back({d[0], d[1], d[2]});
    }
    new (shadows) Shadows(std::move(held));
}

static void begin(Shadows &shadows, Doubles lower, Doubles upper, double spacing, double width, double share, double told) {
    Bounds bounds{};
    bounds.spacing = float(spacing), bounds.width = float(width), bounds.share = float(share), bounds.told = float(told);
    require(spacing > 0 && std::isfinite(spacing), "Shadows.begin: expected a positive spacing");
    require(width > 0 && std::isfinite(width), "Shadows.begin: expected a positive width");
    require(share > 0 && share <= 1, "Shadows.begin: expected a share of 0 .. 1");
    require(told >= 0 && told <= 1, "Shadows.begin: expected told of 0 .. 1");
    for (int k = 0; k < 3; ++k) {
        bounds.lower[k] = lower.data()[k], bounds.upper[k] = upper.data()[k];
        const double size = bounds.upper[k] - bounds.lower[k];
        require(size >= 0 && size < 2000 * spacing, "Shadows.begin: expected bounds of 0 .. 2000 spacings");
    }
    shadows.begin(bounds);
}

static void add(Shadows &shadows, Array<const float, -1, -1, 3> points, Array<const float, -1, -1> widths) {
    const size_t S = points.shape(0), P = points.shape(1);
    require(shadows.maps.size() == shadows.directions.size(), "Shadows.add: before begin");
    require(widths.shape(0) == S && widths.shape(1) == P, "Shadows.add: widths do not have the shape of points");
    require(shadows.casters.P == 0 || shadows.casters.P == int(P), "Shadows.add: strands differ in their number of points");
    shadows.add(points.data(), widths.data(), S, int(P));
}

static void finish(Shadows &shadows, Array<const float, -1, -1, -1> hair, Doubles origin, double spacing, const DistanceField *field,
                   Array<const double, 4, 4> pose) {
    require(spacing > 0, "Shadows.finish: expected a positive spacing");
    require(shadows.maps.size() == shadows.directions.size(), "Shadows.finish: before begin");
    if (shadows.maps.empty()) return;
    const int n[3] = {int(hair.shape(0)), int(hair.shape(1)), int(hair.shape(2))};
    const Pose to_world = Pose::of(pose.data());
    nb::gil_scoped_release release;
    HairVoxels voxels(hair.data(), n, float(spacing), threads());
    for (int k = 0; k < 3; ++k) voxels.origin[k] = float(origin.data()[k] - shadows.maps[0].centre[k]);
    shadows.finish(voxels, field, to_world, threads());
}

static nb::ndarray<nb::numpy, float> reached(const Shadows &shadows, int light, Array<const float, -1, 3> points, float own) {
    require(light >= 0 && light < int(shadows.directions.size()), "Shadows.reach: no such light");
    const ShadowMap &map = shadows.maps[light];
    require(shadows.finished, "Shadows.reach: finish the shadows first");
    const size_t N = points.shape(0);
    auto result = new_array<float>({N, size_t(3)});
    float *out = result.data();
    for (size_t first = 0; first < N; first += 16) {
        Floats x[3];
        for (size_t k = 0; k < 16; ++k)
            for (int c = 0; c < 3; ++c) x[c][k] = float(points.data()[3 * std::min(first + k, N - 1) + c] - map.centre[c]);
        const Reach found = reach(map, {x[0], x[1], x[2]}, own);
        for (size_t k = 0; k < 16 && first + k < N; ++k)
            out[3 * (first + k)] = found.n[k], out[3 * (first + k) + 1] = found.behind[k], out[3 * (first + k) + 2] = found.visible[k];
    }
    return result;
}

static nb::ndarray<nb::numpy, float> lit_parts(const Shadows &shadows, int light, Array<const float, -1, 3> axis, Array<const float, -1, 2, 3> ways,
                                              Array<const float, -1, 3> roots, Array<const float, -1> places) {
    require(light >= 0 && light < int(shadows.directions.size()), "Shadows.lit: no such light");
    require(shadows.finished && !shadows.blockers[light].empty(), "Shadows.lit: finish strands that are told apart first");
    const size_t N = axis.shape(0);
    require(ways.shape(0) == N && roots.shape(0) == N && places.shape(0) == N, "Shadows.lit: arrays differ in length");
    auto result = new_array<float>({N});
    float *out = result.data();
    for (size_t first = 0; first < N; first += 16) {
        Floats x[3], way[2][3], place;
        Words strand;
        for (size_t k = 0; k < 16; ++k) {
            const size_t i = std::min(first + k, N - 1);
            for (int c = 0; c < 3; ++c) {
                x[c][k] = float(axis.data()[3 * i + c] - shadows.maps[light].centre[c]);
                for (int side = 0; side < 2; ++side) way[side][c][k] = ways.data()[6 * i + 3 * side + c];
            }
            strand[k] = Casters::name(roots.data() + 3 * i), place[k] = places.data()[i];
        }
        const Around around{{x[0], x[1], x[2]}, {{way[0][0], way[0][1], way[0][2]}, {way[1][0], way[1][1], way[1][2]}}, strand, place, Ints{} - 1};
        const Floats lit = shadows.blockers[light].lit(shadows.maps[light], around);
        for (size_t k = 0; k < 16 && first + k < N; ++k) out[first + k] = lit[k];
    }
    return result;
}

static nb::tuple map_of(nb::handle self, int light) {
    Shadows &shadows = nb::cast<Shadows &>(self);
    require(light >= 0 && light < int(shadows.directions.size()), "Shadows.map: no such light");
    ShadowMap &map = shadows.maps[light];
    require(shadows.finished, "Shadows.map: finish the shadows first");
    const size_t nu = map.n[0], nv = map.n[1];
    using View = nb::ndarray<nb::numpy, float>;
    nb::ndarray<nb::numpy, uint16_t> layers(map.layers.bits.get(), {nu, nv, size_t(ShadowMap::kLayers)}, self);
    return nb::make_tuple(View(map.surface.data(), {nu, nv, size_t(2)}, self), layers, View(map.solid.data(), {nu, nv}, self));
}

void bind_shadow(nb::module_ &m) {
    nb::class_<Shadows>(m, "Shadows")
        .def("__init__", &make_shadows, nb::arg("directions"))
        .def("begin", &begin, nb::arg("lower"), nb::arg("upper"), nb::arg("spacing"), nb::arg("width"), nb::arg("share") = 1.0,
             nb::arg("told") = 0.0)
        .def("add", &add, nb::arg("points"), nb::arg("widths"))
        .def("finish", &finish, nb::arg("hair"), nb::arg("origin"), nb::arg("spacing"), nb::arg("field").none(), nb::arg("pose"))
        .def("map", &map_of, nb::arg("light"))
        .def("reach", &reached, nb::arg("light"), nb::arg("points"), nb::arg("own") = 0.0f)
        .def("lit", &lit_parts, nb::arg("light"), nb::arg("axis"), nb::arg("ways"), nb::arg("roots"), nb::arg("places"));
}

} // namespace ringlet
