// Python's view of fibre tables, lights and shading.
#include "bindings.hpp"

#include "shade.hpp"
#include "surface.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>

#include <cmath>
#include <optional>
#include <memory>

namespace ringlet {

using Triples = Array<const float, -1, 3>;
using Triple = Array<const float, 3>;
using Point = Array<const double, 3>;
using Records = Array<const float, -1, -1, -1, 8>;
using Strands = Array<const float, -1, -1, 3>;
using Radiance = nb::ndarray<nb::numpy, float>;

/// The tables with the arrays that they point into.
struct HeldTables : FibreTables {
    Records lobe_array;
    Array<const float, -1, -1, 8> sum_array;
    Array<const float, -1, -1, 4> pigment_array;
    std::optional<Array<const float, -1, -1, 2 * Across::kPlaces>> across_array;
};

static void make_tables(HeldTables *held, Records lobes, Array<const float, -1, -1, 8> sums, Array<const float, -1, -1, 4> pigment,
                        Array<const float, 4> variance, Array<const float, 4> tilt, float absorption_max) {
    for (int axis = 0; axis < 3; ++axis) require(lobes.shape(axis) >= 2, "FibreTables: expected 2 or more entries along each axis");
    require(sums.shape(0) == lobes.shape(0) && sums.shape(1) == lobes.shape(1), "FibreTables: sums do not fit lobes");
    require(pigment.shape(0) >= 2 && pigment.shape(1) >= 2, "FibreTables: expected a pigment of 2 or more entries along each axis");
    require(absorption_max > 0, "FibreTables: expected a positive absorption_max");
    FibreTables tables{};
    tables.lobes = lobes.data(), tables.sums = sums.data(), tables.absorption_max = absorption_max;
    tables.pigment = pigment.data(), tables.K = int(pigment.shape(0)), tables.J = int(pigment.shape(1));
    tables.A = int(lobes.shape(0)), tables.T = int(lobes.shape(1)), tables.H = int(lobes.shape(2));
    for (int p = 0; p < 4; ++p) {
        require(variance.data()[p] > 0, "FibreTables: expected positive variances");
        tables.variance[p] = variance.data()[p];
        tables.tilt_cosine[p] = std::cos(tilt.data()[p]), tables.tilt_sine[p] = std::sin(tilt.data()[p]);
    }
    new (held) HeldTables{tables, lobes, sums, pigment, std::nullopt};
}

static void vary_across(HeldTables &tables, Array<const float, -1, -1, 2 * Across::kPlaces> across, float eta, float scale) {
    require(across.shape(0) == size_t(tables.A) && across.shape(1) == size_t(tables.T), "FibreTables: across does not fit lobes");
    require(eta > 1 && scale > 0, "FibreTables: expected eta > 1 and a positive scale");
    tables.across_array = across, tables.across = across.data();
    tables.eta = eta, tables.scale = scale;
}

/// The light with the arrays that it points into.
struct HeldLight : Illumination {
    Triples direction_array, irradiance_array;
    Triple sky_array;
    Array<const float, -1, -1, -1, 16> surrounding_array;
    Array<const float, -1, -1, -1, 4> open_array;
    std::shared_ptr<Shadows> held_shadows;
};

static void make_light(HeldLight *held, Triples directions, Triples irradiance, Triple sky, std::shared_ptr<Shadows> shadows,
                       Array<const float, -1, -1, -1, 16> surroundings, Array<const float, -1, -1, -1, 4> open) {
    Illumination light{};
    light.lights = int(directions.shape(0));
    require(irradiance.shape(0) == directions.shape(0), "Illumination: irradiance does not fit directions");
    require(shadows->maps.size() == directions.shape(0), "Illumination: shadows do not fit directions");
    require(shadows->finished, "Illumination: finish the shadows first");
    for (int axis = 0; axis < 3; ++axis) {
        light.n[axis] = 2 * int(surroundings.shape(axis));
        require(light.n[axis] >= 4, "Illumination: expected 2 or more surroundings along each axis");
        require(open.shape(axis) == surroundings.shape(axis), "Illumination: open does not fit surroundings");
    }
    light.directions = directions.data(), light.irradiance = irradiance.data(), light.sky = sky.data();
    light.surroundings = surroundings.data(), light.open = open.data(), light.shadows = shadows.get();
    new (held) HeldLight{light, directions, irradiance, sky, surroundings, open, shadows};
}

static Radiance shade_strands(Strands points, Triples variation, Array<const uint32_t, -1> key, Point eye,
                              const HeldLight &light, const HeldTables &tables,
                              std::optional<Array<const uint32_t, -1>> which) {
    const size_t S = points.shape(0), P = points.shape(1);
    require(P >= 2, "shade: expected 2 or more points");
    require(variation.shape(0) == S && key.shape(0) == S, "shade: variation and key do not fit points");
    const size_t count = which ? which->shape(0) : S * P;
    for (size_t i = 0; which && i < count; ++i) require(which->data()[i] < S * P, "shade: which has a point beyond the last one");
    auto radiance = new_array<float>({count, size_t(3)});
    const StrandPoints strands{points.data(), variation.data(), key.data(), which ? which->data() : nullptr, int(P)};
    float *out = radiance.data();
    nb::gil_scoped_release release;
    FibreShader(light, tables, eye.data()).shade(strands, count, out, threads());
    return radiance;
}

/// The surface with the arrays that it points into.
struct HeldSurface {
    Triples points, normals, albedo;
    Array<const float, -1> curvature;
};

static void make_surface(HeldSurface *held, Triples points, Triples normals, Triples albedo,
                         Array<const float, -1> curvature) {
    require(normals.shape(0) == points.shape(0) && albedo.shape(0) == points.shape(0) && curvature.shape(0) == points.shape(0),
            "Surface: points, normals, albedo and curvature differ in shape");
    new (held) HeldSurface{points, normals, albedo, curvature};
}

static Radiance shade_head(const HeldSurface &surface, Point eye, const HeldLight &light, const DistanceField *field,
                           Array<const double, 4, 4> pose, Triple loss) {
    const size_t N = surface.points.shape(0);
    auto radiance = new_array<float>({N, size_t(3)});
    const double *e = eye.data();
    const SurfacePoints points{surface.points.data(), surface.normals.data(), surface.albedo.data(),
                               surface.curvature.data(), {e[0], e[1], e[2]}};
    const Occluder head{field, Rigid<float>(Pose::of(pose.data()).inverse())};
    float *out = radiance.data();
    nb::gil_scoped_release release;
    shade_surface(points, N, light, head, loss.data(), out, threads());
    return radiance;
}

void bind_shade(nb::module_ &m) {
    nb::class_<HeldTables>(m, "FibreTables")
        .def("__init__", &make_tables, nb::arg("lobes"), nb::arg("sums"), nb::arg("pigment"), nb::arg("variance"),
             nb::arg("tilt"), nb::arg("absorption_max"))
        .def("vary_across", &vary_across, nb::arg("across"), nb::arg("eta"), nb::arg("scale"))
        .def_rw("reciprocal", &HeldTables::reciprocal);
    nb::class_<HeldLight>(m, "Illumination")
        .def("__init__", &make_light, nb::arg("directions"), nb::arg("irradiance"), nb::arg("sky"), nb::arg("shadows"),
             nb::arg("surroundings"), nb::arg("everywhere"))
        .def_rw("origin", &HeldLight::origin)
        .def_rw("spacing", &HeldLight::spacing)
        .def_rw("glints", &HeldLight::glints);
    nb::class_<HeldSurface>(m, "Surface")
        .def("__init__", &make_surface, nb::arg("points"), nb::arg("normals"), nb::arg("albedo"), nb::arg("curvature"));
    nb::class_<PointShader>(m, "PointShader");
    nb::class_<FibreShader, PointShader>(m, "FibreShader")
        .def("__init__", [](FibreShader *self, const HeldLight &light, const HeldTables &tables, Point eye) {
                 new (self) FibreShader(light, tables, eye.data());
             },
             nb::arg("light"), nb::arg("tables"), nb::arg("eye"), nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>());
    m.def("shade", &shade_strands, nb::arg("points"), nb::arg("variation"), nb::arg("key"), nb::arg("eye"),
          nb::arg("light"), nb::arg("tables"),
          nb::arg("which") = nb::none());
    m.def("shade_surface", &shade_head, nb::arg("surface"), nb::arg("eye"), nb::arg("light"), nb::arg("field").none(),
          nb::arg("pose"), nb::arg("loss"));
}

} // namespace ringlet
