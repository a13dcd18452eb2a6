#include "port/stm32f4/rom.h"

#include <stdint.h>

#include "port/embedded/crc32.h"

extern const uint8_t image_start[];
extern const uint8_t image_rom_bytes[]; /* its address is a number of bytes */

/* Volatile, because what the compiler sees here is not what the build leaves here. */
__attribute__((section(".rom_crc"), used)) static const volatile uint32_t rom_crc = UINT32_MAX;

bool rom_is_intact(void)
{
    return crc32_update(0u, image_start, (uint32_t)(uintptr_t)image_rom_bytes) == rom_crc;
}
