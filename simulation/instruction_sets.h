/* Functions that the build contains for several instruction sets, with the same bits. Private. */
#ifndef LB_INSTRUCTION_SETS_H
#define LB_INSTRUCTION_SETS_H

#ifdef LB_SET
#define LB_JOIN(name, set) name##_##set
#define LB_EXPANDED(name, set) LB_JOIN(name, set)
#define LB_FOR_SET(name) LB_EXPANDED(name, LB_SET)
#else
#define LB_FOR_SET(name) name
#endif

#endif
