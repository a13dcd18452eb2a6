#define _GNU_SOURCE /* CLOCK_BOOTTIME */

#include "port/linux/clock.h"

#include <time.h>

static uint64_t now_ns(void)
{
    struct timespec now = {.tv_sec = 0};

    (void)clock_gettime(CLOCK_BOOTTIME, &now);
    return ((uint64_t)now.tv_sec * 1000000000u) + (uint64_t)now.tv_nsec;
}

uint32_t clock_now_us(void *self)
{
    (void)self;
    return (uint32_t)(now_ns() / 1000u);
}

uint32_t clock_now_ms(void)
{
    return (uint32_t)(now_ns() / 1000000u);
}
