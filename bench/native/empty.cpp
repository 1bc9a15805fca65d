// A call that does nothing, of the same signature as SlidingDFT.push, on an object like it.
#include <nanobind/nanobind.h>

namespace nb = nanobind;

namespace {
struct Nothing {
    void push(nb::handle) {}
};
} // namespace

NB_MODULE(_empty, m) { nb::class_<Nothing>(m, "Nothing").def(nb::init<>()).def("push", &Nothing::push); }
