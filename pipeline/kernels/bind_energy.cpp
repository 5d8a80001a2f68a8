// Python's view of the operators and energies of strands, and of their rest shape.
#include "bindings.hpp"

#include "energy.hpp"
#include "operators.hpp"

#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include <string>
#include <tuple>

namespace ringlet {

using Doubles = nb::ndarray<nb::numpy, double>;
using Points = Array<const double, -1, -1, 3>;

static Form form_named(const std::string &name) {
    require(name == "equal" || name == "general", "form: expected \"equal\" or \"general\"");
    return name == "equal" ? Form::equal : Form::general;
}

using Operator = void (*)(const double *, int, Form, double *);

/// Applies an operator of `lost` fewer values than points to every strand.
static Doubles apply(Operator op, const Points &points, const std::string &form, int lost, const char *too_few) {
    const int P = int(points.shape(1)), kept = P - lost;
    require(kept >= 1, too_few);
    const Form chosen = form_named(form);
    auto values = new_array<double>({points.shape(0), size_t(kept)});
    for (size_t s = 0; s < points.shape(0); ++s)
        op(points.data() + s * P * 3, P, chosen, values.data() + s * kept);
    return values;
}

static void check_fits(const Points &points, const RestShape &rest) {
    require(int(points.shape(0)) == rest.S && int(points.shape(1)) == rest.P,
            "points: expected (S, P, 3) of the rest shape");
}

using Energy = Lanes<double> (*)(const Block<double> &, Edges<double> &);

/// Energy of every strand, and its force.
static std::tuple<Doubles, Doubles> energy_and_force(Energy energy, const Points &points, const RestShape &rest) {
    check_fits(points, rest);
    const int P = rest.P;
    auto values = new_array<double>({size_t(rest.S)});
    auto forces = new_array<double>({size_t(rest.S), size_t(P), 3});
    Arena arena(sizeof(Lanes<double>) * 64 * (P + 8));
    Block<double> block(arena, P);
    Edges<double> edges(arena, P);
    auto *x = arena.take<Vec3<double>>(P), *f = arena.take<Vec3<double>>(P);
    for (int k = 0; k < block_count<double>(rest.S); ++k) {
        BlockIndex<double> index(k, rest.S);
        read(block, rest, index);
        gather(x, points.data(), P, index.strand);
        edges.set(x, P);
        for (int i = 0; i < P; ++i) f[i] = Vec3<double>{};
        Lanes<double> E = energy(block, edges);
        add_edge_forces(edges, P, f);
        scatter(&E, values.data(), 1, index);
        scatter(f, forces.data(), P, index);
    }
    return {values, forces};
}

static void check_rest(const RestShape &rest) {
    auto finite = [](const std::vector<double> &values) {
        return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
    };
    require(finite(rest.points) && finite(rest.bending) && finite(rest.twisting) && finite(rest.offset),
            "rest_shape: points, bending, twisting and offset must be finite");
    require(std::all_of(rest.length.begin(), rest.length.end(), [](double l) { return l > 0; }),
            "rest_shape: a segment has zero length");
    require(std::all_of(rest.mass.begin(), rest.mass.end(), [](double m) { return m > 0 && std::isfinite(m); }),
            "rest_shape: mass_per_length must be positive and finite");
    require(finite(rest.curvature) && finite(rest.torsion), "rest_shape: a strand folds back on itself");
}

template <class T, class Source> static std::vector<T> copied(const Source &array) {
    return std::vector<T>(array.data(), array.data() + array.size());
}

static RestShape rest_shape(Points points, Array<const double, -1> mass_per_length, Array<const double, -1> bending,
                            Array<const double, -1> twisting, Array<const uint8_t, -1, -1> held,
                            Array<const double, -1, -1> offset, double kappa_0) {
    const size_t S = points.shape(0), P = points.shape(1);
    require(P >= 8 && P <= 256, "points: expected 8 to 256 points a strand");
    require(mass_per_length.shape(0) == S && bending.shape(0) == S && twisting.shape(0) == S,
            "mass_per_length, bending, twisting: expected (S,)");
    require(held.shape(0) == S && held.shape(1) == P, "held: expected (S, P)");
    require(offset.shape(0) == S && offset.shape(1) == P, "offset: expected (S, P)");
    require(kappa_0 >= 0, "kappa_0: expected a curvature of at least 0");
    RestShape rest;
    rest.S = int(S), rest.P = int(P);
    rest.points = copied<double>(points), rest.offset = copied<double>(offset), rest.held = copied<uint8_t>(held);
    rest.bending = copied<double>(bending), rest.twisting = copied<double>(twisting);
    rest.length.resize(S * (P - 1)), rest.mass.resize(S * P);
    rest.curvature.resize(S * (P - 2)), rest.torsion.resize(S * (P - 4));
    rest.dihedral.resize(S * (P - 3)), rest.ratio.resize(S * (P - 3)), rest.weight.resize(S * (P - 3));
    for (int s = 0; s < rest.S; ++s) derive_strand(rest, s, mass_per_length.data()[s], kappa_0);
    check_rest(rest);
    return rest;
}

/// A view of one array of the rest shape, `lost` fewer than P wide (lost < 0: one value a strand).
template <auto Member, int lost> static auto view(RestShape &rest) {
    auto &values = rest.*Member;
    using T = typename std::remove_reference_t<decltype(values)>::value_type;
    const size_t shape[2] = {size_t(rest.S), size_t(rest.P - lost)};
    return nb::ndarray<nb::numpy, T>(values.data(), lost < 0 ? 1 : 2, shape, nb::find(rest));
}

template <auto Member, int lost> static void assign(RestShape &rest, nb::ndarray<const double, nb::c_contig> array) {
    auto &values = rest.*Member;
    require(array.size() == values.size(), "rest shape: an array of another size was assigned");
    std::copy(array.data(), array.data() + array.size(), values.begin());
}

template <auto Member, int lost> static void property(nb::class_<RestShape> &cls, const char *name) {
    cls.def_prop_rw(name, &view<Member, lost>, &assign<Member, lost>);
}

static void bind_rest(nb::module_ &m) {
    nb::class_<RestShape> cls(m, "RestShape");
    cls.def_prop_ro("points", [](RestShape &rest) {
        return Doubles(rest.points.data(), {size_t(rest.S), size_t(rest.P), 3}, nb::find(rest));
    });
    property<&RestShape::length, 1>(cls, "length");
    property<&RestShape::mass, 0>(cls, "mass");
    property<&RestShape::bending, -1>(cls, "bending");
    property<&RestShape::twisting, -1>(cls, "twisting");
    property<&RestShape::curvature, 2>(cls, "curvature");
    property<&RestShape::torsion, 4>(cls, "torsion");
    property<&RestShape::dihedral, 3>(cls, "dihedral");
    property<&RestShape::ratio, 3>(cls, "ratio");
    property<&RestShape::weight, 3>(cls, "weight");
    property<&RestShape::held, 0>(cls, "held");
    property<&RestShape::offset, 0>(cls, "offset");
    m.def("rest_shape", &rest_shape, nb::arg("points"), nb::arg("mass_per_length"), nb::arg("bending"),
          nb::arg("twisting"), nb::arg("held"), nb::arg("offset"), nb::arg("kappa_0") = 4.0);
}

void bind_energy(nb::module_ &m) {
    bind_rest(m);
    m.def("curvature", [](Points points, const std::string &form) {
        return apply(&curvature, points, form, 2, "points: curvature needs 3 points a strand");
    }, nb::arg("points"), nb::arg("form"));
    m.def("torsion", [](Points points, const std::string &form) {
        return apply(&torsion, points, form, 4, "points: torsion needs 5 points a strand");
    }, nb::arg("points"), nb::arg("form"));
    m.def("bending", [](Points points, const RestShape &rest) {
        return energy_and_force(&add_bending<double>, points, rest);
    }, nb::arg("points"), nb::arg("rest"));
    m.def("torsion_frenet", [](Points points, const RestShape &rest) {
        return energy_and_force(&add_frenet<double>, points, rest);
    }, nb::arg("points"), nb::arg("rest"));
    m.def("torsion_rotor", [](Points points, const RestShape &rest) {
        return energy_and_force(&add_rotor<double>, points, rest);
    }, nb::arg("points"), nb::arg("rest"));
}

} // namespace ringlet
