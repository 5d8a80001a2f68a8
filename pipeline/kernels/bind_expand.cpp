// Python's view of the expansion: bound strands, the guides' motion, `expand`.
#include "bindings.hpp"

#include "expand.hpp"

#include <nanobind/stl/optional.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace ringlet {

using FloatPoints = Array<const float, -1, -1, 3>;
using Keys = Array<const uint32_t, -1>;
using Roots = Array<const float, -1, 3>;
using Factors = Array<const float, -1>;

/// Python's strands: they hold the caller's arrays.
struct HeldStrands {
    Keys parent;
    Array<const float, -1, 3> root;
    Array<const uint32_t, -1, -1> guide;
    Array<const float, -1, -1> weight;
    Keys key;
    Factors scale, phase;
    uint32_t last_parent, last_guide;
    std::vector<uint16_t> order;

    BoundStrands view() const {
        return {int(guide.shape(0)), int(guide.shape(1)), parent.data(), root.data(),  guide.data(),
                weight.data(),       key.data(),          scale.data(),  phase.data(), &order};
    }
};

static uint32_t greatest(const uint32_t *from, size_t count) { return count ? *std::max_element(from, from + count) : 0; }

static HeldStrands hold(Keys parent, Array<const float, -1, 3> root, Array<const uint32_t, -1, -1> guide,
                        Array<const float, -1, -1> weight, Keys key, Factors scale, Factors phase) {
    const size_t N = parent.shape(0), k = guide.shape(1);
    require(N < size_t(1) << 31, "BoundStrands: expected fewer than 2^31 strands");
    require(k >= 1 && k <= kGuidesMax, "BoundStrands: expected 1 to 8 guides for each strand");
    require(root.shape(0) == N && guide.shape(0) == N && weight.shape(0) == N && key.shape(0) == N &&
                scale.shape(0) == N && phase.shape(0) == N,
            "BoundStrands: expected arrays of one length N");
    require(weight.shape(1) == k, "BoundStrands: guide and weight have different shapes");
    for (size_t i = 0; i < N; ++i)
        require(weight.data()[i * k] > 0, "BoundStrands: the first guide of a strand must have a positive weight");
    return {parent, root, guide, weight, key, scale, phase, greatest(parent.data(), N), greatest(guide.data(), N * k),
            in_patches(root.data(), N, threads())};
}

/// Python's moment: how the guides have turned, and where the skin has carried the roots.
struct Moment {
    GuideMotion motion;
    std::optional<Roots> roots;
};

static GuideMotion make_motion(FloatPoints rest, FloatPoints points, Array<const double, 4, 4> pose) {
    require(rest.shape(0) == points.shape(0) && rest.shape(1) == points.shape(1),
            "GuideMotion: rest and points have different shapes");
    require(rest.shape(1) >= 3, "GuideMotion: expected guides of at least 3 points");
    require(rest.size() < size_t(1) << 31, "GuideMotion: expected fewer than 2^31 numbers");
    nb::gil_scoped_release release;
    return guide_motion(rest.data(), points.data(), int(rest.shape(0)), int(rest.shape(1)), Pose::of(pose.data()), threads());
}

static nb::ndarray<nb::numpy, float> rotations(const Moment &moment) {
    const GuideMotion &motion = moment.motion;
    auto array = new_array<float>({size_t(motion.G), size_t(motion.Q - 1), size_t(4)});
    std::copy(motion.rotations.begin(), motion.rotations.end(), array.data());
    return array;
}

static ExpandStyle make_style(float skin, float clump, float frizz) {
    require(std::isfinite(skin) && std::isfinite(clump) && std::isfinite(frizz), "ExpandStyle: not finite");
    return {skin, clump, frizz};
}

static void expand(FloatPoints rest, const HeldStrands &strands, const Moment &moment, const DistanceField *field,
                   const ExpandStyle &style, int64_t begin, Array<float, -1, -1, 3> out) {
    const GuideMotion &motion = moment.motion;
    const size_t n = out.shape(0), P = rest.shape(1);
    if (n == 0) return;
    require(P >= 2 && out.shape(1) == P, "expand: out and rest have different numbers of points");
    require(begin >= 0 && size_t(begin) + n <= strands.parent.shape(0), "expand: strands beyond the last one");
    require(strands.last_parent < rest.shape(0), "expand: a parent beyond the groom");
    require(strands.last_guide < size_t(motion.G), "expand: a guide beyond the last one");
    require(!moment.roots || moment.roots->shape(0) == strands.parent.shape(0), "expand: expected a root for each strand");
    nb::gil_scoped_release release;
    const float *place = moment.roots ? moment.roots->data() : nullptr;
    const BoundStrands bound = strands.view();
    Expand{rest.data(), int(P), bound, motion, field, place, style}.run(int(begin), int(n), out.data(), threads());
}

void bind_expand(nb::module_ &m) {
    nb::class_<HeldStrands>(m, "BoundStrands")
        .def("__init__",
             [](HeldStrands *self, Keys parent, Array<const float, -1, 3> root, Array<const uint32_t, -1, -1> guide,
                Array<const float, -1, -1> weight, Keys key, Factors scale, Factors phase) {
                 new (self) HeldStrands(hold(parent, root, guide, weight, key, scale, phase));
             },
             nb::arg("parent"), nb::arg("root"), nb::arg("guide"), nb::arg("weight"), nb::arg("key"), nb::arg("scale"),
             nb::arg("phase"));
    nb::class_<Moment>(m, "GuideMotion")
        .def("__init__",
             [](Moment *self, FloatPoints rest, FloatPoints points, Array<const double, 4, 4> pose,
                std::optional<Roots> roots) {
                 new (self) Moment{make_motion(rest, points, pose), roots};
             },
             nb::arg("rest"), nb::arg("points"), nb::arg("pose"), nb::arg("roots") = nb::none())
        .def_prop_ro("rotations", &rotations, nb::rv_policy::automatic);
    nb::class_<ExpandStyle>(m, "ExpandStyle")
        .def("__init__",
             [](ExpandStyle *self, float skin, float clump, float frizz) {
                 new (self) ExpandStyle(make_style(skin, clump, frizz));
             },
             nb::arg("skin"), nb::arg("clump"), nb::arg("frizz"))
        .def_rw("skin", &ExpandStyle::skin)
        .def_rw("clump", &ExpandStyle::clump)
        .def_rw("frizz", &ExpandStyle::frizz);
    m.def("expand", &expand, nb::arg("rest"), nb::arg("strands"), nb::arg("motion"), nb::arg("field").none(),
          nb::arg("style"), nb::arg("begin"), nb::arg("out"));
}

} // namespace ringlet
