// Python's view of the statics: rest strains that hold the groom.
#include "bindings.hpp"

#include "sag_free.hpp"

namespace ringlet {

using Doubles = nb::ndarray<nb::numpy, double>;
using Vectors = Array<const double, -1, -1, 3>;

static SagFree solve(const RestShape &rest, Vectors load, Vectors normal, double margin, double max_factor,
                     double lean_above) {
    const size_t S = size_t(rest.S), P = size_t(rest.P);
    require(load.shape(0) == S && load.shape(1) == P, "load: expected (S, P, 3) of the rest shape");
    require(normal.shape(0) == S && normal.shape(1) == P, "normal: expected (S, P, 3) of the rest shape");
    require(margin >= 1, "margin: expected at least 1");
    require(max_factor >= 1, "max_factor: expected at least 1");
    require(lean_above >= 1, "lean_above: expected at least 1");
    auto positive = [](const std::vector<double> &values) {
        return std::all_of(values.begin(), values.end(), [](double v) { return v > 0; });
    };
    require(positive(rest.bending) && positive(rest.bending_2) && positive(rest.twisting),
            "sag_free: bending and twisting must be positive");
    nb::gil_scoped_release release;
    return sag_free({rest, load.data(), normal.data(), margin, max_factor, lean_above}, threads());
}

/// A view of one array of the result: columns beyond the first extent.
template <auto Member> static Doubles view(SagFree &found) {
    auto &values = found.*Member;
    const size_t S = found.factor.size(), shape[2] = {S, values.size() / std::max<size_t>(S, 1)};
    return Doubles(values.data(), shape[1] == 1 ? 1 : 2, shape, nb::find(found));
}

void bind_statics(nb::module_ &m) {
    nb::class_<SagFree>(m, "SagFree")
        .def_prop_ro("strain", [](SagFree &found) {
            const size_t S = found.factor.size(), joints = found.strain.size() / std::max<size_t>(3 * S, 1);
            return Doubles(found.strain.data(), {S, joints, 3}, nb::find(found));
        })
        .def_prop_ro("tension", &view<&SagFree::tension>)
        .def_prop_ro("reaction", &view<&SagFree::reaction>)
        .def_prop_ro("critical", &view<&SagFree::critical>)
        .def_prop_ro("needed", &view<&SagFree::needed>)
        .def_prop_ro("factor", &view<&SagFree::factor>);
    m.def("sag_free", &solve, nb::arg("rest"), nb::arg("load"), nb::arg("normal"),
          nb::arg("margin"), nb::arg("max_factor"), nb::arg("lean_above"));
}

} // namespace ringlet
