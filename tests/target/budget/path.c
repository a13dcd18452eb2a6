/* What trace.py has the Unicorn engine call at each block, as a function in Python would take fifty times as long. */
#include <stdint.h>

#define PATH_ROOM (1u << 20)

void path_note(void *engine, uint64_t address, uint32_t bytes, void *user);

uint64_t path[PATH_ROOM]; /* address, and 2^32 times the bytes */
uint32_t path_count;      /* may be more than PATH_ROOM: then the rest is lost */

void path_note(void *engine, uint64_t address, uint32_t bytes, void *user)
{
    (void)engine;
    (void)user;
    if (path_count < PATH_ROOM) {
        path[path_count] = ((uint64_t)bytes << 32) | address;
    }
    path_count++;
}
