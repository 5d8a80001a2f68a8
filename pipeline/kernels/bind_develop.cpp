// Python's view of developing samples into pixels.
#include "bindings.hpp"

#include "develop.hpp"

namespace ringlet {

static nb::ndarray<nb::numpy, float> average_samples(Array<const uint8_t, -1, -1, 3> samples, int per_side,
                                                     Array<const float, 256> decode) {
    require(per_side >= 1, "average: expected per_side >= 1");
    require(samples.shape(0) % per_side == 0 && samples.shape(1) % per_side == 0,
            "average: samples are not a multiple of per_side");
    const size_t H = samples.shape(0) / per_side, W = samples.shape(1) / per_side;
    auto pixels = new_array<float>({H, W, size_t(3)});
    float *out = pixels.data();
    nb::gil_scoped_release release;
    average(samples.data(), out, H, W, per_side, decode.data(), threads());
    return pixels;
}

template <class Picture> static void turn_picture_over(Picture picture) {
    const size_t H = picture.shape(0), row = H ? picture.size() / H : 0;
    auto *values = picture.data();
    nb::gil_scoped_release release;
    turn_over(values, H, row, threads());
}

template <class Code>
static nb::ndarray<nb::numpy, Code> develop_pixels(Array<const float, -1, -1, 3> linear, Array<const Code, -1> encode,
                                                   float scale) {
    require(encode.shape(0) >= 1 && encode.shape(0) < size_t(1) << 24, "develop: expected 1 to 2^24 entries in encode");
    require(scale >= 0, "develop: expected a scale >= 0");
    auto pixels = new_array<Code>({linear.shape(0), linear.shape(1), size_t(3)});
    const ToneCurve<Code> tone{encode.data(), int(encode.shape(0)), scale};
    Code *out = pixels.data();
    nb::gil_scoped_release release;
    develop(linear.data(), out, linear.size(), tone, threads());
    return pixels;
}

void bind_develop(nb::module_ &m) {
    m.def("average", &average_samples, nb::arg("samples"), nb::arg("per_side"), nb::arg("decode"));
    m.def("turn_over", &turn_picture_over<Array<uint8_t, -1, -1, 3>>, nb::arg("picture").noconvert());
    m.def("turn_over", &turn_picture_over<Array<float, -1, -1>>, nb::arg("picture").noconvert());
    m.def("develop", &develop_pixels<uint8_t>, nb::arg("linear"), nb::arg("encode").noconvert(), nb::arg("scale"));
    m.def("develop", &develop_pixels<uint16_t>, nb::arg("linear"), nb::arg("encode").noconvert(), nb::arg("scale"));
}

} // namespace ringlet
