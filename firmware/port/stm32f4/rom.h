/* The checksum of the image in flash, put there by the build (rom_crc.py). */
#ifndef LEVER_PORT_STM32F4_ROM_H
#define LEVER_PORT_STM32F4_ROM_H

#include <stdbool.h>

/* Whether the flash holds what was built. About 11 instructions a byte. */
bool rom_is_intact(void);

#endif
