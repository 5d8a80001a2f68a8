// Python's view of the step: state, settings, `advance` and its report.
#include "bindings.hpp"

#include "together.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include <array>
#include <map>
#include <optional>
#include <string>
#include <tuple>

namespace ringlet {

using Doubles = nb::ndarray<nb::numpy, double>;
using Reals = nb::ndarray<nb::numpy, nb::c_contig, nb::device::cpu>;
using Flags = nb::ndarray<nb::numpy, uint8_t, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;

/// Python's state: it holds the caller's arrays.
struct State {
    Reals points, velocity, tension;
    Flags contact;
    Reals directors, twist;

    size_t S() const { return points.shape(0); }
    size_t P() const { return points.shape(1); }
    bool single() const { return points.dtype() == nb::dtype<float>(); }

    template <class Real> StateArrays<Real> arrays() const {
        return {static_cast<Real *>(points.data()), static_cast<Real *>(velocity.data()),
                static_cast<Real *>(tension.data()), contact.data(), static_cast<Real *>(directors.data()),
                static_cast<Real *>(twist.data())};
    }
};

static bool is_points(const Reals &a) { return a.ndim() == 3 && a.shape(2) == 3; }

static State make_state(Reals points, Reals velocity, Reals tension, Flags contact, Reals directors, Reals twist) {
    require(is_points(points) && is_points(velocity), "State: expected points and velocity (S, P, 3)");
    const size_t S = points.shape(0), P = points.shape(1);
    require(velocity.shape(0) == S && velocity.shape(1) == P, "State: velocity has another shape than points");
    require(tension.ndim() == 2 && tension.shape(0) == S && tension.shape(1) + 1 == P,
            "State: expected tension (S, P-1)");
    require(contact.shape(0) == S && contact.shape(1) == P, "State: expected contact (S, P)");
    require(is_points(directors) && directors.shape(0) == S && directors.shape(1) + 1 == P,
            "State: expected directors (S, P-1, 3)");
    require(twist.ndim() == 2 && twist.shape(0) == S && twist.shape(1) + 2 == P, "State: expected twist (S, P-2)");
    require(points.dtype() == nb::dtype<float>() || points.dtype() == nb::dtype<double>(),
            "State: expected float32 or float64");
    for (const Reals *array : {&velocity, &tension, &directors, &twist})
        require(array->dtype() == points.dtype(), "State: arrays of numbers must have one precision");
    return {points, velocity, tension, contact, directors, twist};
}

/// A state without velocity; directors (S, P-1, 3) may be null.
template <class Real> static State resting(const Reals &points, const Real *directors) {
    const size_t S = points.shape(0), P = points.shape(1);
    auto x = new_array<Real>({S, P, size_t(3)}), v = new_array<Real>({S, P, size_t(3)});
    auto T = new_array<Real>({S, P - 1});
    auto contact = new_array<uint8_t>({S, P});
    auto m = new_array<Real>({S, P - 1, size_t(3)}), twist = new_array<Real>({S, P - 2});
    std::copy_n(static_cast<const Real *>(points.data()), S * P * 3, x.data());
    if (directors) std::copy_n(directors, S * (P - 1) * 3, m.data());
    else untwisted_directors(x.data(), int(S), int(P), m.data());
    return {Reals(x), Reals(v), Reals(T), Flags(contact), Reals(m), Reals(twist)};
}

static State at_rest(const Reals &points, const std::optional<Reals> &directors) {
    require(is_points(points) && points.shape(1) >= 2, "at_rest: expected points (S, P, 3)");
    require(!directors || (is_points(*directors) && directors->shape(0) == points.shape(0) &&
                           directors->shape(1) + 1 == points.shape(1) && directors->dtype() == points.dtype()),
            "at_rest: expected directors (S, P-1, 3) in the precision of the points");
    const void *m = directors ? directors->data() : nullptr;
    if (points.dtype() == nb::dtype<float>()) return resting<float>(points, static_cast<const float *>(m));
    require(points.dtype() == nb::dtype<double>(), "at_rest: expected float32 or float64");
    return resting<double>(points, static_cast<const double *>(m));
}

static void check_settings(const StepSettings &s) {
    require(s.dt > 0 && std::isfinite(s.dt), "settings: dt must be positive");
    require(s.theta >= 0.5 && s.theta <= 1, "settings: theta must be from 0.5 to 1");
    require(s.look_ahead >= 0 && s.look_ahead <= 1, "settings: look_ahead must be from 0 to 1");
    require(s.tolerance > 0, "settings: tolerance must be positive");
    require(s.damping >= 0 && s.friction >= 0, "settings: damping and friction must not be negative");
    require(s.drag >= 0 && s.drag_speed >= 0 && s.drag_along >= 0, "settings: drag must not be negative");
}

static void check_fits(const State &state, const RestShape &rest) {
    require(int(state.S()) == rest.S && int(state.P()) == rest.P,
            "state and rest shape have different numbers of strands or points");
}

static void check_drive(const Drive &drive, const RestShape &rest, const DistanceField *field) {
    require(drive.roots.empty() || drive.roots.size() == (size_t(drive.steps) + 1) * rest.S * 12,
            "Drive: roots are for another number of strands");
    require(!drive.deformation || (field && field->values.size() == drive.deformation->after.values.size()),
            "Drive: a deformation needs the field that it begins with");
}

template <class Real>
static Report advance_as(const State &state, const RestShape &rest, const DistanceField *field, const Drive &drive,
                         const StepSettings &settings, const Neighbours *neighbours) {
    if (!neighbours) return advance(state.arrays<Real>(), rest, field, drive, settings, threads());
    Together<Real> strands(state.arrays<Real>(), rest, drive, settings, neighbours->hold());
    const auto force = neighbours->start(Real(), settings.theta * settings.dt);
    return strands.advance(field, *force, threads());
}

static Report advance_state(State &state, const RestShape &rest, const DistanceField *field, const Drive &drive,
                            const StepSettings &settings, const Neighbours *neighbours) {
    check_fits(state, rest);
    check_settings(settings);
    check_drive(drive, rest, field);
    require(!neighbours || neighbours->fits(rest.S, rest.P), "neighbours: made for another rest shape");
    nb::gil_scoped_release release;
    double seconds = 0;
    Report report;
    {
        const Clock clock(seconds);
        report = state.single() ? advance_as<float>(state, rest, field, drive, settings, neighbours)
                                : advance_as<double>(state, rest, field, drive, settings, neighbours);
    }
    report.seconds = seconds;
    return report;
}

template <class Real>
static Doubles neighbour_acceleration_as(const State &state, const RestShape &rest, const Neighbours &neighbours,
                                         const Pose &head, double theta_dt) {
    auto values = new_array<double>({state.S(), state.P(), size_t(3)});
    neighbour_acceleration(state.arrays<Real>(), rest, *neighbours.start(Real(), theta_dt), head, values.data(),
                           threads());
    return values;
}

static Doubles neighbour_acceleration_of(const State &state, const RestShape &rest, const Neighbours &neighbours,
                                         Array<const double, 4, 4> head, const StepSettings &settings) {
    check_fits(state, rest);
    require(neighbours.fits(rest.S, rest.P), "neighbours: made for another rest shape");
    const double theta_dt = settings.theta * settings.dt;
    const Pose pose = Pose::of(head.data());
    return state.single() ? neighbour_acceleration_as<float>(state, rest, neighbours, pose, theta_dt)
                          : neighbour_acceleration_as<double>(state, rest, neighbours, pose, theta_dt);
}

/// Bending, torsion, kinetic and gravity energy of a block of strands; the load counts as gravity.
static void block_energies(const Block<double> &b, const Motion<double> &at, const StepSettings &settings,
                           Edges<double> &edges, Lanes<double> (&energy)[4]) {
    const Vec3<double> g = broadcast<double>(settings.gravity);
    edges.set(at.x, b.P);
    if (settings.torsion == Torsion::kirchhoff) {
        const RodEnergy<double> rod = add_rod(b, at.m, at.twist, edges);
        energy[0] = rod.bending, energy[1] = rod.twisting;
    } else {
        energy[0] = add_bending(b, edges);
        energy[1] = add_torsion(settings.torsion, b, at.m, edges);
    }
    energy[2] = energy[3] = Lanes<double>{};
    for (int i = 0; i < b.P; ++i) {
        energy[2] += 0.5 * b.mu[i] * b.m0 * dot(at.v[i], at.v[i]);
        energy[3] -= b.m0 * dot(b.mu[i] * g + b.load[i], at.x[i]);
    }
}

template <class Real>
static Doubles energies_of(const State &state, const RestShape &rest, const StepSettings &settings) {
    const int P = rest.P;
    auto values = new_array<double>({size_t(rest.S), 4});
    Arena arena(sizeof(Lanes<double>) * 96 * (P + 8));
    Block<double> block(arena, P);
    Motion<double> at(arena, P);
    Edges<double> edges(arena, P);
    for (int k = 0; k < block_count<double>(rest.S); ++k) {
        const BlockIndex<double> index(k, rest.S);
        const StateArrays<Real> arrays = state.arrays<Real>();
        Lanes<double> energy[4];
        read(block, rest, index);
        gather(at.x, arrays.points, P, index.strand);
        gather(at.v, arrays.velocity, P, index.strand);
        gather(at.m, arrays.directors, P - 1, index.strand);
        gather<double>(at.twist + 1, arrays.twist, P - 2, P - 2, index.strand);
        block_energies(block, at, settings, edges, energy);
        scatter<double>(energy, values.data(), 4, index);
    }
    return values;
}

static Doubles energies(const State &state, const RestShape &rest, const StepSettings &settings) {
    check_fits(state, rest);
    return state.single() ? energies_of<float>(state, rest, settings) : energies_of<double>(state, rest, settings);
}

static Relaxation relaxation_named(const std::string &name) {
    require(name == "newton" || name == "sweep", "relaxation: expected \"newton\" or \"sweep\"");
    return name == "newton" ? Relaxation::newton : Relaxation::sweep;
}

static const std::map<std::string, Torsion> kTorsions = {
    {"none", Torsion::none}, {"frenet", Torsion::frenet}, {"rotor", Torsion::rotor}, {"kirchhoff", Torsion::kirchhoff}};

static std::string torsion_name(const StepSettings &settings) {
    for (const auto &[name, torsion] : kTorsions)
        if (torsion == settings.torsion) return name;
    return {};
}

static void set_torsion(StepSettings &settings, const std::string &name) {
    require(kTorsions.contains(name), "torsion: expected \"kirchhoff\", \"rotor\", \"frenet\" or \"none\"");
    settings.torsion = kTorsions.at(name);
}

static std::tuple<Doubles, int> relax(Array<const double, -1, -1, 3> points, const RestShape &rest,
                                      const std::string &method, double tolerance) {
    require(int(points.shape(0)) == rest.S && int(points.shape(1)) == rest.P,
            "points: expected (S, P, 3) of the rest shape");
    const bool newton = relaxation_named(method) == Relaxation::newton;
    const int P = rest.P;
    auto relaxed = new_array<double>({size_t(rest.S), size_t(P), 3});
    Arena arena(sizeof(Lanes<double>) * 96 * (P + 8));
    Block<double> block(arena, P);
    Contacts<double> contacts(arena, P);
    Lengths<double> lengths(arena, P);
    auto *x = arena.take<Vec3<double>>(P);
    int slowest = 0;
    for (int k = 0; k < block_count<double>(rest.S); ++k) {
        const BlockIndex<double> index(k, rest.S);
        read(block, rest, index);
        gather(x, points.data(), P, index.strand);
        for (int round = 0; round < (newton ? 50 : kSweepRounds); ++round) {
            Mask<double> busy = lengths.strain(block, x) > tolerance;
            if (!any<double>(busy)) break;
            if (newton) lengths.newton(block, contacts, busy, x);
            else lengths.sweep(block, contacts, busy, x);
            slowest = std::max(slowest, round + 1);
        }
        scatter(x, relaxed.data(), P, index);
    }
    return {relaxed, slowest};
}

static void bind_settings(nb::module_ &m) {
    nb::class_<StepSettings> cls(m, "StepSettings");
    cls.def(nb::init<>())
        .def_rw("dt", &StepSettings::dt)
        .def_rw("theta", &StepSettings::theta)
        .def_rw("look_ahead", &StepSettings::look_ahead)
        .def_rw("damping", &StepSettings::damping)
        .def_rw("tolerance", &StepSettings::tolerance)
        .def_rw("friction", &StepSettings::friction)
        .def_rw("drag", &StepSettings::drag)
        .def_rw("drag_speed", &StepSettings::drag_speed)
        .def_rw("drag_along", &StepSettings::drag_along)
        .def_prop_rw("torsion", &torsion_name, &set_torsion);
    cls.def_prop_rw(
        "gravity", [](const StepSettings &s) { return std::tuple(s.gravity[0], s.gravity[1], s.gravity[2]); },
        [](StepSettings &s, std::tuple<double, double, double> g) {
            std::tie(s.gravity[0], s.gravity[1], s.gravity[2]) = g;
        });
    cls.def_prop_rw(
        "relaxation", [](const StepSettings &s) { return s.relaxation == Relaxation::newton ? "newton" : "sweep"; },
        [](StepSettings &s, const std::string &name) { s.relaxation = relaxation_named(name); });
    cls.def_prop_rw(
        "integrator", [](const StepSettings &s) { return s.is_explicit ? "explicit" : "implicit"; },
        [](StepSettings &s, const std::string &name) {
            require(name == "explicit" || name == "implicit", "integrator: expected \"implicit\" or \"explicit\"");
            s.is_explicit = name == "explicit";
        });
}

static void bind_values(nb::module_ &m) {
    nb::class_<State>(m, "State")
        .def("__init__", [](State *self, Reals points, Reals velocity, Reals tension, Flags contact, Reals directors,
                            Reals twist) {
            new (self) State(make_state(points, velocity, tension, contact, directors, twist));
        }, nb::arg("points").noconvert(), nb::arg("velocity").noconvert(), nb::arg("tension").noconvert(),
             nb::arg("contact").noconvert(), nb::arg("directors").noconvert(), nb::arg("twist").noconvert())
        .def_prop_ro("points", [](State &state) { return state.points; }, nb::rv_policy::automatic)
        .def_prop_ro("velocity", [](State &state) { return state.velocity; }, nb::rv_policy::automatic)
        .def_prop_ro("tension", [](State &state) { return state.tension; }, nb::rv_policy::automatic)
        .def_prop_ro("contact", [](State &state) { return state.contact; }, nb::rv_policy::automatic)
        .def_prop_ro("directors", [](State &state) { return state.directors; }, nb::rv_policy::automatic)
        .def_prop_ro("twist", [](State &state) { return state.twist; }, nb::rv_policy::automatic);
    nb::class_<Report>(m, "Report")
        .def_ro("strain", &Report::strain)
        .def_ro("depth", &Report::depth)
        .def_ro("rounds", &Report::rounds)
        .def_ro("rounds_max", &Report::rounds_max)
        .def_ro("contacts", &Report::contacts)
        .def_ro("solves", &Report::solves)
        .def_ro("halvings", &Report::halvings)
        .def_ro("bad_strand", &Report::bad_strand)
        .def_ro("seconds", &Report::seconds)
        .def_ro("neighbour_seconds", &Report::neighbour_seconds);
}

void bind_step(nb::module_ &m) {
    bind_values(m);
    bind_settings(m);
    m.def("at_rest", &at_rest, nb::arg("points"), nb::arg("directors") = nb::none());
    m.def("advance", &advance_state, nb::arg("state"), nb::arg("rest"), nb::arg("field").none(), nb::arg("drive"),
          nb::arg("settings"), nb::arg("neighbours") = nb::none());
    m.def("neighbour_acceleration", &neighbour_acceleration_of, nb::arg("state"), nb::arg("rest"),
          nb::arg("neighbours"), nb::arg("head"), nb::arg("settings"));
    m.def("energies", &energies, nb::arg("state"), nb::arg("rest"), nb::arg("settings"));
    m.def("relax", &relax, nb::arg("points"), nb::arg("rest"), nb::arg("method"), nb::arg("tolerance"));
}

} // namespace ringlet
