// Arrays of Python as pointers of C, for the bindings of the module _native.
#ifndef LIVEBODE_NATIVE_ARRAY_H
#define LIVEBODE_NATIVE_ARRAY_H

#include <nanobind/nanobind.h>

#include <cstring>
#include <initializer_list>

#include "livebode/lines.h"
#include "native_claim.h"

namespace native {

namespace nb = nanobind;

enum Access { READ = 0, WRITE = PyBUF_WRITABLE };

// A contiguous array of a type and shape, or None where that is permitted. One that is written is this thread's until
// the end of the scope.
class Array {
  public:
    Array(nb::handle object, const char *formats, std::initializer_list<size_t> shape, Access access = READ,
          bool is_optional = false)
    {
        if (is_optional && object.is_none()) return;
        if (PyObject_GetBuffer(object.ptr(), &buffer_, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | access) != 0)
            throw nb::python_error();
        held_ = true;
        bool fits = buffer_.format && std::strlen(buffer_.format) <= 2 && is_one_of(formats, buffer_.format) &&
                    buffer_.ndim == static_cast<int>(shape.size());
        const Py_ssize_t *length = buffer_.shape;
        for (const size_t wanted : shape) fits = fits && *length++ == static_cast<Py_ssize_t>(wanted);
        const bool changes = access == WRITE && buffer_.len > 0;
        if (fits && changes) claimed_ = Changing::take(buffer_.buf);
        if (fits && claimed_ == changes) return;
        PyBuffer_Release(&buffer_); // a constructor that throws has no destructor
        if (!fits) throw nb::value_error("an array has another type or shape");
        throw std::runtime_error("another thread changes this state; give each thread its own");
    }
    ~Array()
    {
        if (claimed_) Changing::give(buffer_.buf);
        if (held_) PyBuffer_Release(&buffer_);
    }
    Array(const Array &) = delete;
    Array &operator=(const Array &) = delete;

    template <typename T> T *data() const { return static_cast<T *>(held_ ? buffer_.buf : nullptr); }
    operator double *() const { return data<double>(); }
    operator uint8_t *() const { return data<uint8_t>(); }
    operator int64_t *() const { return data<int64_t>(); }

  private:
    Py_buffer buffer_{};
    bool held_ = false, claimed_ = false;

    // `formats` are separated by spaces.
    static bool is_one_of(const char *formats, const char *format)
    {
        const size_t length = std::strlen(format);
        for (const char *at = formats; (at = std::strstr(at, format)); at += length)
            if ((at == formats || at[-1] == ' ') && (at[length] == ' ' || at[length] == '\0')) return true;
        return false;
    }
};

inline const char *const REAL = "d", *const COMPLEX = "Zd", *const FLAG = "?", *const BYTE = "B",
                         *const INTEGER = "l q";

inline size_t length_of(nb::handle array, size_t axis) { return nb::cast<size_t>(array.attr("shape")[nb::int_(axis)]); }

inline void expect(lb_status status)
{
    if (status != LB_OK) throw nb::value_error("a stage refused its arguments");
}

// Numbers from which other threads may run meanwhile: about 0.1 ms. For less the change of threads costs more.
inline constexpr size_t long_work = 500'000;

template <typename Work> void call(size_t size, Work work)
{
    lb_status status = LB_OK;
    if (size < long_work) {
        status = work();
    } else {
        nb::gil_scoped_release release;
        status = work();
    }
    expect(status);
}

} // namespace native

#endif
