/* Breaks one precondition or invariant of an object and calls the kernel, whose debug build must stop there. Built with
 * the kernel's private headers. The argument is the violation; exit code 0: nothing stopped. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "state.h"

#ifdef LB_ASSERT_HANDLER
void LB_ASSERT_HANDLER(const char *condition, const char *file, int line)
{
    const char *name = strrchr(file, '/');
    printf("%s: %s%s\n", name ? name + 1 : file, condition, line > 0 ? "" : " without a line");
    fflush(stdout);
    _Exit(42);
}
#endif

static void violate(const char *what, LB_DFT *t, real *samples, real *out)
{
    if (!strcmp(what, "index")) {
        t->index = t->window; /* beyond the delay line */
    } else if (!strcmp(what, "count")) {
        t->count += 1; /* not the index's sample */
    } else if (!strcmp(what, "blocks")) {
        t->blocks += 1; /* more sums than there is memory for */
    } else if (!strcmp(what, "table")) {
        t->half += 1; /* a row after the last one */
    } else if (!strcmp(what, "queued")) {
        t->queued = 1000; /* more than the queue takes */
    } else if (!strcmp(what, "radius")) {
        t->radius_window = 2; /* sums that grow */
    } else if (!strcmp(what, "overlap")) {
        out = samples + 3; /* rows over samples that are still to be read */
    }
    (void)LB(process)(t, samples, 8, 1, 8, 8, LB_PHASE_WINDOW, out, 1);
}

int main(int count, char **arguments)
{
    static const uint32_t bins[] = {1, 2, 3};
    const lb_config config = {.window = 8, .channels = 2, .bin_count = 3, .bins = bins};
    real samples[32] = {0}, out[2 * 3 * 2];
    size_t bytes;
    LB_DFT *t;
    if (count != 2 || LB(size)(&config, &bytes) != LB_OK) {
        return 1;
    }
    void *memory = malloc(bytes);
    if (!memory || LB(init)(memory, bytes, &config, &t) != LB_OK) {
        return 1;
    }
    violate(arguments[1], t, samples, out);
    free(memory);
    return 0;
}
