// The C kernel as a Python class. Argument checks with messages are in Python (_arguments.py); arguments in
// the usual form take the fast path without them.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "livebode/sdft.h"
#include "native_belt.h"
#include "native_claim.h"
#include "native_fit.h"
#include "native_lines.h"
#include "native_matrix.h"
#include "native_periods.h"
#include "native_repeating.h"
#include "native_table.h"

namespace nb = nanobind;

namespace {

const char *words(lb_status status)
{
    switch (status) {
    case LB_ERROR_INSTRUCTION_SET: return "this machine or this build does not have the instruction set asked for";
    case LB_ERROR_SIZE: return "window × bins needs more memory than this machine can address";
    case LB_ERROR_HOP: return "hop is not a multiple of that of the SlidingDFT; leave it out for the same";
    case LB_ERROR_SNAPSHOT_LENGTH: return "the snapshot is cut off; take it anew";
    case LB_ERROR_SNAPSHOT_MAGIC: return "these bytes are no snapshot of a SlidingDFT of this version and byte order";
    case LB_ERROR_SNAPSHOT_CONFIG:
        return "the snapshot is of another window, bins, channels, dtype, variant or hop; restore it into its like";
    case LB_ERROR_SNAPSHOT_CRC: return "the snapshot is damaged: its checksum does not fit; take it anew";
    default: return "the kernel refused its arguments";
    }
}

void expect(lb_status status)
{
    if (status != LB_OK) throw nb::value_error(words(status));
}

// A Python buffer, released at the end of the scope.
struct View {
    Py_buffer buffer{};
    bool held = false;
    bool open(PyObject *object, int flags)
    {
        held = PyObject_GetBuffer(object, &buffer, flags) == 0;
        if (!held) PyErr_Clear();
        return held;
    }
    bool has_format(const char *format) const { return buffer.format && std::strcmp(buffer.format, format) == 0; }
    ~View()
    {
        if (held) PyBuffer_Release(&buffer);
    }
    View() = default;
    View(const View &) = delete;
    View &operator=(const View &) = delete;
};

// Arguments of the kernel: strides in elements.
struct Samples {
    const void *data;
    ptrdiff_t channel_stride, sample_stride;
    size_t length;
};

class Engine {
  public:
    Engine(uint32_t window, const std::vector<uint32_t> &bins, uint32_t channels, bool is_double, int variant,
           double damping, int set, uint32_t hop)
        : window_(window), channels_(channels), bins_(bins.size()), hop_(hop), is_double_(is_double)
    {
        const lb_config config = {window,
                                  channels,
                                  static_cast<uint32_t>(bins.size()),
                                  bins.data(),
                                  static_cast<lb_variant>(variant),
                                  damping,
                                  static_cast<lb_instruction_set>(set),
                                  LB_TABLE_ROWS,
                                  hop};
        size_t bytes = 0;
        expect(is_double ? lb_sdft64_size(&config, &bytes) : lb_sdft32_size(&config, &bytes));
        memory_.reset(new unsigned char[bytes]);
        lb_status status = LB_OK;
        {
            nb::gil_scoped_release release;
            status = is_double ? lb_sdft64_init(memory_.get(), bytes, &config, &dft64_)
                               : lb_sdft32_init(memory_.get(), bytes, &config, &dft32_);
        }
        expect(status);
        arguments_ = nb::module_::import_("livebode.kernel._arguments");
    }

    uint32_t window() const { return window_; }
    uint32_t channels() const { return channels_; }

    uint64_t count()
    {
        const native::Claim mine(used_, refusal);
        uint64_t count = 0;
        expect(is_double_ ? lb_sdft64_count(dft64_, &count) : lb_sdft32_count(dft32_, &count));
        return count;
    }

    int instruction_set() const
    {
        lb_instruction_set set = LB_BEST;
        expect(is_double_ ? lb_sdft64_instruction_set(dft64_, &set) : lb_sdft32_instruction_set(dft32_, &set));
        return set;
    }

    void push(nb::handle x)
    {
        if (PyFloat_CheckExact(x.ptr()) && channels_ == 1) {
            const native::Claim mine(used_, refusal);
            const double value = PyFloat_AsDouble(x.ptr());
            if (is_double_) {
                lb_sdft64_queue(dft64_, &value);
            } else {
                const float narrow = static_cast<float>(value);
                lb_sdft32_queue(dft32_, &narrow);
            }
            return;
        }
        push_any(x);
    }

    nb::object process(nb::handle x, nb::handle hop, nb::handle out, nb::handle phase)
    {
        const size_t step = hop_of(hop);
        return run(x, step, out, phase_of(phase));
    }

    void advance(nb::handle x) { run(x, 0, nb::none(), LB_PHASE_WINDOW); }

    nb::object spectrum(nb::handle phase)
    {
        nb::object result = arguments_.attr("empty_spectrum")(bins_, channels_, is_double_);
        const lb_phase reference = phase_of(phase);
        View view;
        if (!view.open(result.ptr(), PyBUF_WRITABLE | PyBUF_C_CONTIGUOUS)) throw nb::python_error();
        const native::Claim mine(used_, refusal);
        if (is_double_)
            expect(lb_sdft64_read(dft64_, reference, static_cast<double *>(view.buffer.buf)));
        else
            expect(lb_sdft32_read(dft32_, reference, static_cast<float *>(view.buffer.buf)));
        return result;
    }

    nb::bytes snapshot()
    {
        const native::Claim mine(used_, refusal);
        size_t bytes = 0;
        expect(is_double_ ? lb_sdft64_snapshot_size(dft64_, &bytes) : lb_sdft32_snapshot_size(dft32_, &bytes));
        PyObject *result = PyBytes_FromStringAndSize(nullptr, static_cast<Py_ssize_t>(bytes));
        if (!result) throw nb::python_error();
        nb::bytes owner = nb::steal<nb::bytes>(result);
        void *data = PyBytes_AsString(result);
        expect(is_double_ ? lb_sdft64_snapshot(dft64_, data, bytes) : lb_sdft32_snapshot(dft32_, data, bytes));
        return owner;
    }

    void restore(nb::bytes snapshot)
    {
        const native::Claim mine(used_, refusal);
        expect(is_double_ ? lb_sdft64_restore(dft64_, snapshot.data(), snapshot.size())
                          : lb_sdft32_restore(dft32_, snapshot.data(), snapshot.size()));
    }

    void reset()
    {
        const native::Claim mine(used_, refusal);
        expect(is_double_ ? lb_sdft64_reset(dft64_) : lb_sdft32_reset(dft32_));
    }

  private:
    // Bins × samples from which other threads may run meanwhile.
    static constexpr size_t long_work = 50'000;
    static constexpr const char *refusal =
        "this SlidingDFT is processing a block in another thread; give each thread its own";

    uint32_t window_, channels_;
    size_t bins_, hop_;
    bool is_double_;
    native::Flag used_;
    std::unique_ptr<unsigned char[]> memory_;
    lb_sdft64 *dft64_ = nullptr;
    lb_sdft32 *dft32_ = nullptr;
    nb::object arguments_; // livebode.kernel._arguments

    size_t real_bytes() const { return is_double_ ? sizeof(double) : sizeof(float); }
    const char *real_format() const { return is_double_ ? "d" : "f"; }
    const char *complex_format() const { return is_double_ ? "Zd" : "Zf"; }

    void push_any(nb::handle x)
    {
        if (push_floats(x)) return;
        nb::object array = arguments_.attr("as_sample")(x, channels_, is_double_);
        View view;
        if (!view.open(array.ptr(), PyBUF_C_CONTIGUOUS)) throw nb::python_error();
        const native::Claim mine(used_, refusal);
        if (is_double_)
            expect(lb_sdft64_queue(dft64_, static_cast<const double *>(view.buffer.buf)));
        else
            expect(lb_sdft32_queue(dft32_, static_cast<const float *>(view.buffer.buf)));
    }

    // A tuple or list of as many floats as channels: the usual form of a sample of several signals.
    bool push_floats(nb::handle x)
    {
        constexpr Py_ssize_t most = 16;
        const bool is_list = PyList_CheckExact(x.ptr());
        if (!is_list && !PyTuple_CheckExact(x.ptr())) return false;
#ifdef Py_GIL_DISABLED
        if (is_list) return false; // another thread could remove an item meanwhile
#endif
        const Py_ssize_t length = is_list ? PyList_Size(x.ptr()) : PyTuple_Size(x.ptr());
        if (length != static_cast<Py_ssize_t>(channels_) || length > most) return false;
        double values[most];
        float narrow[most];
        for (Py_ssize_t i = 0; i < length; ++i) {
            PyObject *item = is_list ? PyList_GetItem(x.ptr(), i) : PyTuple_GetItem(x.ptr(), i);
            if (!PyFloat_CheckExact(item)) return false;
            values[i] = PyFloat_AsDouble(item);
            narrow[i] = static_cast<float>(values[i]);
        }
        const native::Claim mine(used_, refusal);
        expect(is_double_ ? lb_sdft64_queue(dft64_, values) : lb_sdft32_queue(dft32_, narrow));
        return true;
    }

    size_t hop_of(nb::handle hop) const
    {
        if (hop.is_none()) return hop_ ? hop_ : 1;
        if (PyLong_CheckExact(hop.ptr())) {
            const Py_ssize_t value = PyLong_AsSsize_t(hop.ptr());
            if (value > 0) return static_cast<size_t>(value);
            PyErr_Clear();
        }
        return nb::cast<size_t>(arguments_.attr("as_hop")(hop));
    }

    lb_phase phase_of(nb::handle phase) const
    {
        if (PyUnicode_Check(phase.ptr())) {
            if (PyUnicode_CompareWithASCIIString(phase.ptr(), "window") == 0) return LB_PHASE_WINDOW;
            if (PyUnicode_CompareWithASCIIString(phase.ptr(), "fixed") == 0) return LB_PHASE_FIXED;
        }
        arguments_.attr("refuse_phase")(phase);
        return LB_PHASE_WINDOW; // not reached
    }

    bool fits(const View &view) const
    {
        const Py_buffer &b = view.buffer;
        const auto item = static_cast<Py_ssize_t>(real_bytes());
        if (!view.has_format(real_format()) || reinterpret_cast<uintptr_t>(b.buf) % real_bytes() != 0) return false;
        for (int i = 0; i < b.ndim; ++i)
            if (b.strides[i] % item != 0) return false;
        return (b.ndim == 1 && channels_ == 1) || (b.ndim == 2 && b.shape[0] == static_cast<Py_ssize_t>(channels_));
    }

    Samples samples_of(const View &view) const
    {
        const Py_buffer &b = view.buffer;
        const auto item = static_cast<Py_ssize_t>(real_bytes());
        const int last = b.ndim - 1;
        return {b.buf, b.ndim == 2 ? b.strides[0] / item : 0, b.strides[last] / item,
                static_cast<size_t>(b.shape[last])};
    }

    nb::object run(nb::handle x, size_t hop, nb::handle out, lb_phase phase)
    {
        nb::object converted; // outlives its view
        View direct, indirect;
        const bool usual = direct.open(x.ptr(), PyBUF_STRIDES | PyBUF_FORMAT) && fits(direct);
        if (!usual) {
            converted = arguments_.attr("as_samples")(x, channels_, is_double_);
            if (!indirect.open(converted.ptr(), PyBUF_STRIDES | PyBUF_FORMAT) || !fits(indirect))
                throw std::runtime_error("samples could not be converted");
        }
        const View &input = usual ? direct : indirect;
        const Samples samples = samples_of(input);
        const native::Claim mine(used_, refusal);
        if (hop == 0) {
            compute(samples, 0, phase, nullptr, 0);
            return nb::none();
        }
        size_t rows = 0;
        expect(is_double_ ? lb_sdft64_rows(dft64_, samples.length, hop, &rows)
                          : lb_sdft32_rows(dft32_, samples.length, hop, &rows));
        const bool flat = input.buffer.ndim == 1;
        nb::object result =
            out.is_none() ? arguments_.attr("empty_rows")(channels_, rows, bins_, flat, is_double_) : nb::borrow(out);
        View output;
        if (!output.open(result.ptr(), PyBUF_WRITABLE | PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) ||
            !takes(output, rows, flat) || overlap(output.buffer, samples))
            arguments_.attr("refuse_out")(out, channels_, rows, bins_, flat, is_double_);
        compute(samples, hop, phase, output.buffer.buf, rows);
        return result;
    }

    bool takes(const View &view, size_t rows, bool flat) const
    {
        const Py_buffer &b = view.buffer;
        const Py_ssize_t *shape = b.shape + (flat ? 0 : 1);
        return view.has_format(complex_format()) && b.ndim == (flat ? 2 : 3) &&
               (flat || b.shape[0] == static_cast<Py_ssize_t>(channels_)) &&
               shape[0] == static_cast<Py_ssize_t>(rows) && shape[1] == static_cast<Py_ssize_t>(bins_) &&
               reinterpret_cast<uintptr_t>(b.buf) % real_bytes() == 0;
    }

    // Whether the output overlaps the input, by the ends of both.
    bool overlap(const Py_buffer &out, const Samples &in) const
    {
        if (in.length == 0 || out.len == 0) return false;
        const auto item = static_cast<ptrdiff_t>(real_bytes());
        const ptrdiff_t spans[2] = {in.channel_stride * static_cast<ptrdiff_t>(channels_ - 1) * item,
                                    in.sample_stride * static_cast<ptrdiff_t>(in.length - 1) * item};
        const char *low = static_cast<const char *>(in.data), *high = low + item;
        for (const ptrdiff_t span : spans) (span < 0 ? low : high) += span;
        const char *first = static_cast<const char *>(out.buf), *end = first + out.len;
        return first < high && low < end;
    }

    void compute(const Samples &in, size_t hop, lb_phase phase, void *out, size_t rows)
    {
        lb_status status = LB_OK;
        if (in.length * channels_ * (bins_ + 8) < long_work) {
            status = call(in, hop, phase, out, rows);
        } else {
            nb::gil_scoped_release release;
            status = call(in, hop, phase, out, rows);
        }
        expect(status);
    }

    lb_status call(const Samples &in, size_t hop, lb_phase phase, void *out, size_t rows)
    {
        return is_double_ ? lb_sdft64_process(dft64_, static_cast<const double *>(in.data), in.channel_stride,
                                              in.sample_stride, in.length, hop, phase, static_cast<double *>(out), rows)
                          : lb_sdft32_process(dft32_, static_cast<const float *>(in.data), in.channel_stride,
                                              in.sample_stride, in.length, hop, phase, static_cast<float *>(out), rows);
    }
};

} // namespace

NB_MODULE(_native, m)
{
    // A command ends without a last search for cycles (livebode.cli.start): what remains is no leak.
    nb::set_leak_warnings(false);
    m.def("best_instruction_set", [] { return static_cast<int>(lb_best_instruction_set()); });
    bind_lines(m);
    bind_matrix(m);
    bind_periods(m);
    bind_fit(m);
    bind_repeating(m);
    bind_belt(m);
    bind_table(m);
    nb::class_<Engine>(m, "Engine")
        .def(nb::init<uint32_t, const std::vector<uint32_t> &, uint32_t, bool, int, double, int, uint32_t>())
        .def_prop_ro("window", &Engine::window)
        .def_prop_ro("channels", &Engine::channels)
        .def_prop_ro("count", &Engine::count)
        .def("_instruction_set", &Engine::instruction_set)
        .def("push", &Engine::push)
        .def("process", &Engine::process, nb::arg("x").none(), nb::arg("hop") = nb::none(), nb::arg("out") = nb::none(),
             nb::arg("phase").none() = "window")
        .def("advance", &Engine::advance)
        .def("spectrum", &Engine::spectrum, nb::arg("phase").none() = "window")
        .def("snapshot", &Engine::snapshot)
        .def("restore", &Engine::restore)
        .def("reset", &Engine::reset);
}
