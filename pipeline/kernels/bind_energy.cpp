// Python's view of the operators and energies of strands, and of their rest shape.
#include "bindings.hpp"

#include "energy.hpp"
#include "root.hpp"
#include "twist.hpp"
#include "operators.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include <optional>
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

using Vectors = Array<const double, -1, -1, 3>;

static void check_directors(const Points &points, const Vectors &directors) {
    require(points.shape(1) >= 3, "points: expected at least 3 points a strand");
    require(directors.shape(0) == points.shape(0) && directors.shape(1) + 1 == points.shape(1),
            "directors: expected (S, P-1, 3) for the points");
}

/// Energy of every strand, and its force. Without directors no root is clamped.
template <class Energy>
static std::tuple<Doubles, Doubles> energy_and_force(Energy energy, const Points &points, const RestShape &rest,
                                                     const std::optional<Vectors> &directors = std::nullopt) {
    check_fits(points, rest);
    if (directors) check_directors(points, *directors);
    const int P = rest.P;
    auto values = new_array<double>({size_t(rest.S)});
    auto forces = new_array<double>({size_t(rest.S), size_t(P), 3});
    Arena arena(sizeof(Lanes<double>) * 64 * (P + 8));
    Block<double> block(arena, P);
    Edges<double> edges(arena, P);
    auto *x = arena.take<Vec3<double>>(P), *f = arena.take<Vec3<double>>(P), *m = arena.take<Vec3<double>>(P);
    for (int k = 0; k < block_count<double>(rest.S); ++k) {
        BlockIndex<double> index(k, rest.S);
        read(block, rest, index);
        gather(x, points.data(), P, index.strand);
        if (directors) gather(m, directors->data(), P - 1, index.strand);
        else block.clamped = false;
        edges.set(x, P);
        for (int i = 0; i < P; ++i) f[i] = Vec3<double>{};
        Lanes<double> E = energy(block, m, edges);
        add_edge_forces(edges, P, f);
        scatter(&E, values.data(), 1, index);
        scatter(f, forces.data(), P, index);
    }
    return {values, forces};
}

using Twist = std::optional<Array<const double, -1, -1>>;

/// Directors without twist.
static Doubles untwisted(const Points &points) {
    const int S = int(points.shape(0)), P = int(points.shape(1));
    require(P >= 2, "points: expected at least 2 points a strand");
    auto directors = new_array<double>({size_t(S), size_t(P) - 1, 3});
    untwisted_directors(points.data(), S, P, directors.data());
    return directors;
}

/// Integrated strains (k1, k2, twist) of every joint.
static Doubles strains(const Points &points, const Vectors &directors) {
    check_directors(points, directors);
    const int S = int(points.shape(0)), P = int(points.shape(1));
    auto values = new_array<double>({size_t(S), size_t(P) - 2, 3});
    Arena arena(sizeof(Lanes<double>) * 20 * (P + 8));
    Edges<double> edges(arena, P);
    auto *x = arena.take<Vec3<double>>(P), *m = arena.take<Vec3<double>>(P), *strain = arena.take<Vec3<double>>(P);
    for (int k = 0; k < block_count<double>(S); ++k) {
        const BlockIndex<double> index(k, S);
        gather(x, points.data(), P, index.strand);
        gather(m, directors.data(), P - 1, index.strand);
        edges.set(x, P);
        for (int i = 1; i < P - 1; ++i) {
            const Joint<double> q(edges.d[i - 1], edges.d[i], m[i - 1], m[i], Lanes<double>{});
            strain[i] = {q.k1, q.k2, q.twist};
        }
        scatter(strain + 1, values.data(), P - 2, index);
    }
    return values;
}

/// Energy of "kirchhoff", its force on the points and its gradient by the turns of the directors.
static std::tuple<Doubles, Doubles, Doubles> rod_energy(const Points &points, const Vectors &directors,
                                                        const RestShape &rest, const Twist &twist) {
    check_fits(points, rest);
    check_directors(points, directors);
    const size_t S = points.shape(0), P = points.shape(1);
    require(!twist || (twist->shape(0) == S && twist->shape(1) + 2 == P), "twist: expected (S, P-2)");
    auto values = new_array<double>({S}), forces = new_array<double>({S, P, 3}), turning = new_array<double>({S, P - 1});
    Arena arena(sizeof(Lanes<double>) * 96 * (P + 8));
    Block<double> block(arena, rest.P);
    Motion<double> at(arena, rest.P);
    Edges<double> edges(arena, rest.P);
    auto *f = arena.take<Vec3<double>>(P);
    for (int k = 0; k < block_count<double>(rest.S); ++k) {
        const BlockIndex<double> index(k, rest.S);
        read(block, rest, index);
        gather(at.x, points.data(), rest.P, index.strand);
        gather(at.m, directors.data(), rest.P - 1, index.strand);
        if (twist) gather<double>(at.twist + 1, twist->data(), rest.P - 2, rest.P - 2, index.strand);
        edges.set(at.x, rest.P);
        for (size_t i = 0; i < P; ++i) f[i] = Vec3<double>{};
        const RodEnergy<double> rod = add_rod(block, at.m, at.twist, edges);
        add_edge_forces(edges, rest.P, f);
        const Lanes<double> energy = rod.bending + rod.twisting;
        scatter(&energy, values.data(), 1, index);
        scatter(f, forces.data(), rest.P, index);
        scatter(edges.D_theta, turning.data(), rest.P - 1, index);
    }
    return {values, forces, turning};
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
    require(finite(rest.directors) && finite(rest.strain), "rest_shape: directors must be finite");
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
    rest.root_weight.resize(S), rest.root_shift.resize(S * 2);
    for (int s = 0; s < rest.S; ++s) derive_strand(rest, s, mass_per_length.data()[s], kappa_0);
    const Doubles directors = untwisted(points);
    rest.bending_2 = rest.bending, rest.load.resize(S * P * 3);
    rest.directors = copied<double>(directors), rest.strain = copied<double>(strains(points, Vectors(directors)));
    check_rest(rest);
    return rest;
}

/// A view of one array of vectors of the rest shape, `lost` fewer than P a strand.
template <auto Member, int lost> static Doubles vectors(RestShape &rest) {
    return Doubles((rest.*Member).data(), {size_t(rest.S), size_t(rest.P - lost), 3}, nb::find(rest));
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
    cls.def_prop_ro("points", &vectors<&RestShape::points, 0>);
    cls.def_prop_rw("directors", &vectors<&RestShape::directors, 1>, &assign<&RestShape::directors, 1>);
    cls.def_prop_rw("strain", &vectors<&RestShape::strain, 2>, &assign<&RestShape::strain, 2>);
    cls.def_prop_rw("load", &vectors<&RestShape::load, 0>, &assign<&RestShape::load, 0>);
    property<&RestShape::bending_2, -1>(cls, "bending_2");
    property<&RestShape::length, 1>(cls, "length");
    property<&RestShape::mass, 0>(cls, "mass");
    property<&RestShape::bending, -1>(cls, "bending");
    property<&RestShape::twisting, -1>(cls, "twisting");
    property<&RestShape::curvature, 2>(cls, "curvature");
    property<&RestShape::torsion, 4>(cls, "torsion");
    property<&RestShape::dihedral, 3>(cls, "dihedral");
    property<&RestShape::ratio, 3>(cls, "ratio");
    property<&RestShape::weight, 3>(cls, "weight");
    property<&RestShape::root_weight, -1>(cls, "root_weight");
    cls.def_prop_rw("root_shift", [](RestShape &rest) {
        return Doubles(rest.root_shift.data(), {size_t(rest.S), 2}, nb::find(rest));
    }, &assign<&RestShape::root_shift, 0>);
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
        auto energy = [](auto &block, auto *, auto &edges) { return add_bending(block, edges); };
        return energy_and_force(energy, points, rest);
    }, nb::arg("points"), nb::arg("rest"));
    m.def("torsion_frenet", [](Points points, const RestShape &rest) {
        auto energy = [](auto &block, auto *, auto &edges) { return add_frenet(block, edges); };
        return energy_and_force(energy, points, rest);
    }, nb::arg("points"), nb::arg("rest"));
    m.def("torsion_rotor", [](Points points, const RestShape &rest, std::optional<Vectors> directors) {
        auto energy = [](auto &block, auto *m, auto &edges) { return add_torsion(Torsion::rotor, block, m, edges); };
        return energy_and_force(energy, points, rest, directors);
    }, nb::arg("points"), nb::arg("rest"), nb::arg("directors") = nb::none());
    m.def("kirchhoff", &rod_energy, nb::arg("points"), nb::arg("directors"), nb::arg("rest"),
          nb::arg("twist") = nb::none());
    m.def("untwisted_directors", &untwisted, nb::arg("points"));
    m.def("strains", &strains, nb::arg("points"), nb::arg("directors"));
}

} // namespace ringlet
