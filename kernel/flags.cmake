# Flags of the C of kernel/ and native/.
set(CMAKE_C_STANDARD 99)
set(CMAKE_C_EXTENSIONS OFF)
if(NOT CMAKE_SYSTEM_NAME STREQUAL "Generic")
    set(CMAKE_POSITION_INDEPENDENT_CODE ON)
endif()
set(CMAKE_C_VISIBILITY_PRESET hidden)

# One more object of the inner kernel per instruction set, chosen at run time, where the compiler has vectors.
set(instruction_sets)
if(CMAKE_C_COMPILER_ID MATCHES "GNU|Clang")
    # Products are rounded before they are added: the same bits on every machine. A root is an instruction, not a call
    # of libm.
    set(exact -ffp-contract=off -fno-fast-math -fno-math-errno)
    if(CMAKE_C_COMPILER_FRONTEND_VARIANT STREQUAL "MSVC")
        list(TRANSFORM exact PREPEND "/clang:") # clang-cl ignores them otherwise
    endif()
    add_compile_options(${exact})
    if(CMAKE_C_COMPILER_ID STREQUAL "GNU")
        # Copies of a few numbers stay loops: calling memcpy for them costs more.
        add_compile_options(-fno-tree-loop-distribute-patterns)
    endif()
    if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$" AND CMAKE_SIZEOF_VOID_P EQUAL 8)
        set(instruction_sets avx2 avx512)
        add_compile_definitions(LB_DISPATCH)
    endif()
endif()
# Debug builds check preconditions and invariants: src/lb_assert.h.
add_compile_definitions($<$<CONFIG:Debug>:LB_DEBUG>)
if(CMAKE_SYSTEM_NAME STREQUAL "Generic")
    # No operating system: a microcontroller, without vectors.
    add_compile_definitions(LB_SCALAR)
    add_compile_options(-ffreestanding -ffunction-sections -fdata-sections)
endif()
set(flags_avx2 -mavx2 -mno-fma)
set(flags_avx512 -mavx512f -mavx512vl)
