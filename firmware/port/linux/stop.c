#define _POSIX_C_SOURCE 200809L

#include "port/linux/stop.h"

#include <signal.h>
#include <stddef.h>

#include <sys/signalfd.h>

int stop_descriptor(void)
{
    sigset_t signals;

    if ((sigemptyset(&signals) != 0) || (sigaddset(&signals, SIGINT) != 0) || (sigaddset(&signals, SIGTERM) != 0) ||
        (sigprocmask(SIG_BLOCK, &signals, NULL) != 0) || (signal(SIGPIPE, SIG_IGN) == SIG_ERR)) {
        return -1;
    }
    return signalfd(-1, &signals, SFD_CLOEXEC);
}
