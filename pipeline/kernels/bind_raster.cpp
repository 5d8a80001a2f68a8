// Python's view of the raster.
#include "bindings.hpp"

#include "layer_shaders.hpp"
#include "raster.hpp"

#include <array>
#include <optional>

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>

namespace ringlet {

using Points = Array<const float, -1, -1, 3>;
using Widths = Array<const float, -1, -1>;
using Picture = Array<float, -1, -1, 3>;

/// What lies behind the hair, with the arrays that it points into.
struct HeldBackdrop : Backdrop {
    Widths depth_array;
    Array<const uint8_t, -1, -1, 3> sample_array;
    Array<const float, 256> decode_array;
};

static void make_backdrop(HeldBackdrop *held, Widths depth, Array<const uint8_t, -1, -1, 3> samples,
                          Array<const float, 256> decode, int per_side) {
    require(per_side >= 1 && per_side <= 8, "Backdrop: expected 1 to 8 samples a side");
    require(samples.shape(0) == depth.shape(0) && samples.shape(1) == depth.shape(1), "Backdrop: samples do not fit depth");
    new (held) HeldBackdrop{{depth.data(), samples.data(), decode.data(), per_side}, depth, samples, decode};
}

static void make_raster(Raster *raster, std::array<int, 2> size, float layers) {
    require(size[0] >= 1 && size[1] >= 1 && size[0] <= 1 << 15 && size[1] <= 1 << 15, "Raster: expected a size of 1 to 32768");
    require(layers > 0, "Raster: expected a positive number of layers");
    new (raster) Raster(size[0], size[1], layers);
}

static void begin(Raster &raster, Array<const double, 4, 4> matrix, double scale, std::array<double, 2> planes) {
    require(planes[0] > 0 && planes[1] > planes[0] && std::isfinite(planes[1]), "Raster.begin: expected 0 < near < far");
    require(scale > 0 && std::isfinite(scale), "Raster.begin: expected a positive scale");
    View view{{}, raster.view.W, raster.view.H, float(scale), float(planes[0]), float(planes[1])};
    for (int i = 0; i < 16; ++i) view.M[i / 4][i % 4] = float(matrix.data()[i]);
    raster.begin(view);
}

static void fits(const Raster &raster, const HeldBackdrop &back) {
    require(back.depth_array.shape(0) == size_t(raster.view.H) * back.n && back.depth_array.shape(1) == size_t(raster.view.W) * back.n,
            "Raster: the backdrop has another size");
}

static void fits(Points points, Widths widths) {
    require(points.shape(1) >= 2 && points.shape(1) < 1 << 15, "Raster: expected 2 to 32767 points");
    require(widths.shape(0) == points.shape(0) && widths.shape(1) == points.shape(1), "Raster: widths do not fit points");
    require(points.shape(0) * points.shape(1) < size_t(1) << 31, "Raster: expected fewer than 2^31 points a chunk");
}

static void count(Raster &raster, Points points, Widths widths, size_t first) {
    fits(points, widths);
    require(raster.view.scale > 0, "Raster.count: before begin");
    nb::gil_scoped_release release;
    raster.counted.add(raster.view, points.data(), widths.data(), int(points.shape(0)), int(points.shape(1)), first, std::min(threads(), 8));
}

static void cut_off(Raster &raster, const HeldBackdrop &back) {
    fits(raster, back);
    require(raster.view.scale > 0, "Raster.cut_off: before begin");
    nb::gil_scoped_release release;
    raster.cut_off(back, threads());
}

static void add(Raster &raster, Points points, Widths widths, Array<const float, -1, 3> variation, Array<const uint32_t, -1> key) {
    fits(points, widths);
    const size_t S = points.shape(0), P = points.shape(1);
    require(variation.shape(0) == S && key.shape(0) == S, "Raster.add: variation and key do not fit points");
    require(!raster.bins.cut.empty(), "Raster.add: before cut_off");
    require(raster.bins.batches.empty() || raster.bins.P == int(P), "Raster.add: another number of points than before");
    require(raster.bins.batches.size() + S / Bins::strands_per_batch(int(P)) < 1u << (32 - Batch::kBits), "Raster.add: too many strands");
    nb::gil_scoped_release release;
    raster.bins.add(raster.view, {points.data(), widths.data(), variation.data(), key.data(), int(S), int(P)}, threads());
}

static int compose(Raster &raster, const HeldBackdrop &back, const PointShader &shader, Picture picture,
                   std::optional<Array<uint32_t, -1, -1>> names) {
    fits(raster, back);
    require(!raster.bins.cut.empty(), "Raster.compose: before cut_off");
    require(picture.shape(0) == size_t(raster.view.H) && picture.shape(1) == size_t(raster.view.W), "Raster.compose: the picture has another size");
    require(!names || (names->shape(0) == picture.shape(0) && names->shape(1) == picture.shape(1)), "Raster.compose: names have another size");
    const Pictures pictures{picture.data(), names ? names->data() : nullptr};
    nb::gil_scoped_release release;
    return raster.compose(back, shader, pictures, threads());
}

static void make_distances(DistanceShader *shader, Array<const double, 3> eye, Array<const double, 3> ahead) {
    new (shader) DistanceShader;
    std::copy(eye.data(), eye.data() + 3, shader->eye);
    std::copy(ahead.data(), ahead.data() + 3, shader->ahead);
}

void bind_raster(nb::module_ &m) {
    nb::class_<DistanceShader, PointShader>(m, "DistanceShader").def("__init__", &make_distances, nb::arg("eye"), nb::arg("ahead"));
    nb::class_<TangentShader, PointShader>(m, "TangentShader").def(nb::init<>());
    nb::class_<HeldBackdrop>(m, "Backdrop")
        .def("__init__", &make_backdrop, nb::arg("depth"), nb::arg("samples"), nb::arg("decode"), nb::arg("per_side"));
    nb::class_<Raster>(m, "Raster")
        .def("__init__", &make_raster, nb::arg("size"), nb::arg("layers"))
        .def("begin", &begin, nb::arg("matrix"), nb::arg("scale"), nb::arg("planes"))
        .def("count", &count, nb::arg("points"), nb::arg("widths"), nb::arg("first"))
        .def("cut_off", &cut_off, nb::arg("backdrop"))
        .def("add", &add, nb::arg("points"), nb::arg("widths"), nb::arg("variation"), nb::arg("key"))
        .def("compose", &compose, nb::arg("backdrop"), nb::arg("shader"), nb::arg("picture"), nb::arg("names") = nb::none())
        .def_ro("shaded", &Raster::shaded);
}

} // namespace ringlet
