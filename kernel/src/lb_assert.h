/* Preconditions and invariants inside the kernel. Private.
 *
 * With -DLB_DEBUG a condition that is not met calls LB_ASSERT_HANDLER, a function of the user's that does not return,
 * or traps. Without LB_DEBUG conditions are compiled, but not evaluated: the object has no code for them. */
#ifndef LB_ASSERT_H
#define LB_ASSERT_H

#ifndef LB_DEBUG
#define LB_ASSERT(condition) ((void)sizeof(!(condition)))
#elif defined(LB_ASSERT_HANDLER)
void LB_ASSERT_HANDLER(const char *condition, const char *file, int line);
#define LB_ASSERT(condition) ((condition) ? (void)0 : LB_ASSERT_HANDLER(#condition, __FILE__, __LINE__))
#elif defined(__GNUC__) || defined(__clang__)
#define LB_ASSERT(condition) ((condition) ? (void)0 : __builtin_trap())
#else
#error "with this compiler LB_DEBUG needs -DLB_ASSERT_HANDLER=function"
#endif

#endif
