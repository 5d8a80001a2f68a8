// Python's view of tubes.
#include "bindings.hpp"

#include "tubes.hpp"

#include <memory>

namespace ringlet {

static nb::tuple tubes(Array<const float, -1, -1, 3> points, Array<const float, -1, -1> widths, Array<const bool, -1, -1> drawn,
                       int sides, Array<const double, 3> eye, double fine) {
    const size_t S = points.shape(0), P = points.shape(1);
    require(P >= 2, "tubes: expected 2 or more points");
    require(widths.shape(0) == S && widths.shape(1) == P, "tubes: widths do not fit points");
    require(drawn.shape(0) == S && drawn.shape(1) == P - 1, "tubes: drawn does not fit the segments");
    require(sides >= 3 && sides <= Tubes::kMostSides, "tubes: expected 3 to 32 sides");
    require(fine >= 0, "tubes: expected fine >= 0");
    require(S * P * size_t(sides) < size_t(1) << 31, "tubes: expected fewer than 2^31 corners");
    auto corners = new_array<float>({S, P, size_t(sides), size_t(3)});
    const TubeStrands strands{points.data(), widths.data(), reinterpret_cast<const uint8_t *>(drawn.data()), int(S), int(P)};
    float *out = corners.data();
    auto triangles = std::make_unique<Triangles>();
    {
        nb::gil_scoped_release release;
        *triangles = make_tubes(strands, sides, {eye.data(), fine}, out, threads());
    }
    const size_t shape[] = {triangles->size() / 3, 3};
    int32_t *data = triangles->data();
    nb::capsule owner(triangles.release(), [](void *held) noexcept { delete static_cast<Triangles *>(held); });
    return nb::make_tuple(corners, nb::ndarray<nb::numpy, int32_t>(data, 2, shape, owner));
}

void bind_tubes(nb::module_ &m) {
    m.def("tubes", &tubes, nb::arg("points"), nb::arg("widths"), nb::arg("drawn"), nb::arg("sides"), nb::arg("eye"),
          nb::arg("fine") = 0.0);
}

} // namespace ringlet
