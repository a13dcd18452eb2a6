#include "semihosting.h"

#include <stddef.h>
#include <string.h>

/* Numbers and arguments: "Semihosting for AArch32 and AArch64", section 5. */
enum operation { SYS_OPEN = 0x01, SYS_WRITE0 = 0x04, SYS_WRITE = 0x05, SYS_GET_CMDLINE = 0x15, SYS_EXIT = 0x18 };
#define MODE_WB 5u
#define STOPPED_APPLICATION_EXIT 0x20026u
#define STOPPED_RUN_TIME_ERROR 0x20023u

static uint32_t call(enum operation operation, const void *argument)
{
    register uint32_t r0 __asm("r0") = (uint32_t)operation;
    register const void *r1 __asm("r1") = argument;
    __asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void semihosting_arguments(char *text, uint32_t bytes)
{
    const uint32_t block[2] = {(uint32_t)text, bytes};
    if (call(SYS_GET_CMDLINE, block) != 0u) {
        semihosting_exit("arguments: too long");
    }
}

uint32_t semihosting_create(const char *path)
{
    const uint32_t block[3] = {(uint32_t)path, MODE_WB, (uint32_t)strlen(path)};
    const uint32_t handle = call(SYS_OPEN, block);
    if (handle == UINT32_MAX) {
        semihosting_exit("the file for the results cannot be opened");
    }
    return handle;
}

void semihosting_write(uint32_t handle, const void *data, uint32_t bytes)
{
    const uint32_t block[3] = {handle, (uint32_t)data, bytes};
    if (call(SYS_WRITE, block) != 0u) {
        semihosting_exit("the file for the results cannot be written");
    }
}

void semihosting_exit(const char *message)
{
    if (message != NULL) {
        (void)call(SYS_WRITE0, message);
        (void)call(SYS_WRITE0, "\n");
    }
    (void)call(SYS_EXIT, (const void *)((message == NULL) ? STOPPED_APPLICATION_EXIT : STOPPED_RUN_TIME_ERROR));
    for (;;) {
    }
}
