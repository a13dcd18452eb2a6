/* For User-Mode Linux on processors newer than it: preloaded into linux.uml by uml.py.
 *
 * UML keeps the extended processor state of its processes in buffers of a size fixed when it was built, and hands it back in
 * that size. The kernel takes it only whole (xstateregs_set, arch/x86/kernel/fpu/regset.c), which since AMX is more, and UML
 * panics at its first process. So the missing end is put behind it: what the process has there now. */
#define _GNU_SOURCE

#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/types.h>
#include <sys/uio.h>

typedef long ptrace_t(int request, pid_t pid, void *address, void *data);

enum { MOST = 65536 }; /* bytes of an extended state; AMX makes it 11 KiB */

static long set_whole_state(ptrace_t *real, pid_t pid, void *type, const struct iovec *given)
{
    static char state[MOST];
    struct iovec whole = {state, sizeof state};
    if (real(PTRACE_GETREGSET, pid, type, &whole) != 0) {
        return -1;
    }
    const size_t known = (given->iov_len < whole.iov_len) ? given->iov_len : whole.iov_len;
    (void)memcpy(state, given->iov_base, known);
    return real(PTRACE_SETREGSET, pid, type, &whole);
}

long ptrace(enum __ptrace_request request, ...)
{
    va_list arguments;
    va_start(arguments, request);
    const pid_t pid = va_arg(arguments, pid_t);
    void *address = va_arg(arguments, void *);
    void *data = va_arg(arguments, void *);
    va_end(arguments);

    static ptrace_t *real;
    if (real == NULL) {
        void *found = dlsym(RTLD_NEXT, "ptrace");
        (void)memcpy(&real, &found, sizeof real);
    }
    const int is_state = (request == PTRACE_SETREGSET) && ((size_t)address == NT_X86_XSTATE);
    return is_state ? set_whole_state(real, pid, address, data) : real((int)request, pid, address, data);
}
