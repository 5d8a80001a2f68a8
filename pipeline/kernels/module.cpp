// The extension module: which instruction sets the processor has, how many threads to use, and the rooms.
#include "bindings.hpp"

#include <omp.h>

#include <string>

namespace ringlet {

static int thread_count = 0; // 0: all processors

int threads() { return thread_count > 0 ? thread_count : omp_get_num_procs(); }

static int cpu_level() {
#if defined(__x86_64__)
    __builtin_cpu_init();
    if (__builtin_cpu_supports("x86-64-v4")) return 4;
    if (__builtin_cpu_supports("x86-64-v3")) return 3;
#endif
    return 0;
}

static void set_threads(int count) {
    require(count >= 0, "threads: expected 0 (all processors) or a positive number");
    thread_count = count;
}

void bind_density(nb::module_ &m);
void bind_shadow(nb::module_ &m);
void bind_develop(nb::module_ &m);
void bind_drive(nb::module_ &m);
void bind_energy(nb::module_ &m);
void bind_mesh(nb::module_ &m);
void bind_shade(nb::module_ &m);
void bind_expand(nb::module_ &m);
void bind_groom(nb::module_ &m);
void bind_parts(nb::module_ &m);
void bind_follow(nb::module_ &m);
void bind_partings(nb::module_ &m);
void bind_groom(nb::module_ &m);
void bind_parts(nb::module_ &m);
void bind_peak(nb::module_ &m);
void bind_raster(nb::module_ &m);
void bind_statics(nb::module_ &m);
void bind_neighbours(nb::module_ &m);
void bind_step(nb::module_ &m);
void bind_tubes(nb::module_ &m);

} // namespace ringlet

NB_MODULE(RINGLET_MODULE, m) {
    m.def("cpu_level", &ringlet::cpu_level, "x86-64 level of this processor: 4, 3 or 0 (neither).");
    m.def("set_threads", &ringlet::set_threads, nanobind::arg("count"),
          "Threads of every kernel from now on; 0 is all processors. No result depends on it.");
    m.def("threads", &ringlet::threads, "Threads that kernels use.");
    ringlet::bind_density(m);
    ringlet::bind_shadow(m);
    ringlet::bind_develop(m);
    ringlet::bind_drive(m);
    ringlet::bind_energy(m);
    ringlet::bind_shade(m);
    ringlet::bind_expand(m);
    ringlet::bind_groom(m);
    ringlet::bind_parts(m);
    ringlet::bind_mesh(m);
    ringlet::bind_follow(m);
    ringlet::bind_partings(m);
    ringlet::bind_peak(m);
    ringlet::bind_raster(m);
    ringlet::bind_statics(m);
    ringlet::bind_neighbours(m);
    ringlet::bind_step(m);
    ringlet::bind_tubes(m);
}
