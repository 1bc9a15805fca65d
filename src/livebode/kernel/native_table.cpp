// Rows of text as columns of numbers and back, and integers in runs, for livebode.kernel._table and _runs. The tuples
// that are read here have the order of the classes there.
#include "native_table.h"

#include <nanobind/nanobind.h>

#include <deque>
#include <vector>

#include "livebode/table.h"
#include "native_array.h"

namespace nb = nanobind;

namespace {

using namespace native;

// Bytes of Python: of a bytes object, or an array of them.
struct Bytes {
    Array array;
    size_t length;
    explicit Bytes(nb::handle object) : array(object, BYTE, {nb::len(object)}), length(nb::len(object)) {}
};

nb::tuple read_rows(nb::handle powers, nb::tuple layout, nb::handle text, size_t begin, nb::handle out, size_t rows)
{
    const Array table(powers, "Q L", {LB_POWERS, 2});
    const Bytes kinds(layout[0]), empty(layout[1]), bytes(text);
    const size_t wanted = length_of(out, 0), rows_max = length_of(out, 1);
    const Array columns(out, REAL, {wanted, rows_max}, WRITE);
    const uint8_t *kind = kinds.array;
    size_t filled = 0;
    for (size_t i = 0; i < kinds.length; ++i) filled += kind[i] != LB_CELL_SKIPPED;
    if (filled != wanted || begin > bytes.length || rows > rows_max)
        throw nb::value_error("an array has another type or shape");
    const lb_table_layout set = {table.data<uint64_t>(),
                                 kinds.length,
                                 kind,
                                 empty.array,
                                 empty.length,
                                 nb::cast<size_t>(layout[2]),
                                 nb::cast<uint8_t>(layout[3]),
                                 nb::cast<uint8_t>(layout[4]),
                                 nb::cast<uint8_t>(layout[5]),
                                 nb::cast<bool>(layout[6])};
    const uint8_t *from = bytes.array;
    size_t used = 0;
    call(bytes.length - begin,
         [&] { return lb_table_read(&set, from + begin, bytes.length - begin, rows_max, columns, &rows, &used); });
    return nb::make_tuple(rows, begin + used);
}

size_t write_rows(nb::handle powers, nb::tuple columns, nb::tuple words, nb::handle out)
{
    const Array table(powers, "Q L", {LB_POWERS, 2});
    const size_t rows = columns.size() ? length_of(columns[0], 0) : 0;
    std::deque<Array> held;
    std::vector<lb_table_column> cells;
    const Bytes is_words(words[0]), text(words[1]);
    if (is_words.length != columns.size()) throw nb::value_error("an array has another type or shape");
    for (size_t i = 0; i < columns.size(); ++i) {
        const bool is_real = nb::cast<nb::str>(nb::object(columns[i].attr("dtype").attr("kind"))).equal(nb::str("f"));
        const double *numbers = nullptr;
        const int64_t *integers = nullptr;
        if (is_real)
            numbers = held.emplace_back(columns[i], REAL, std::initializer_list<size_t>{rows});
        else
            integers = held.emplace_back(columns[i], INTEGER, std::initializer_list<size_t>{rows});
        const bool is_word = static_cast<const uint8_t *>(is_words.array)[i] != 0;
        cells.push_back({numbers, is_word ? nullptr : integers, is_word ? integers : nullptr});
    }
    const size_t count = length_of(words[2], 0) - 1;
    const Array ends(words[2], INTEGER, {count + 1});
    const lb_table_words every = {text.array, ends, count};
    const size_t room = length_of(out, 0);
    const Array into(out, BYTE, {room}, WRITE);
    size_t length = 0;
    call(rows * columns.size() * LB_NUMBER_BYTES, [&] {
        return lb_table_write(table.data<uint64_t>(), cells.data(), cells.size(), &every, rows, into, room, &length);
    });
    return length;
}

// Whether the bytes have so many integers.
bool decode_runs(nb::handle data, unsigned width, nb::handle out)
{
    const Bytes bytes(data);
    const size_t count = length_of(out, 0);
    const Array integers(out, sizeof(long) == sizeof(uint32_t) ? "I L" : "I", {count}, WRITE);
    lb_status status = LB_OK;
    call(count, [&] {
        status = lb_runs_decode(bytes.array, bytes.length, width, count, integers.data<uint32_t>());
        return LB_OK;
    });
    return status == LB_OK;
}

} // namespace

void bind_table(nb::module_ &m)
{
    m.def("read_rows", &read_rows);
    m.def("write_rows", &write_rows);
    m.def("decode_runs", &decode_runs);
}
