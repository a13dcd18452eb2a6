/* The checksum of the image in flash, put there by the build (rom_crc.py). */
#ifndef LEVER_PORT_STM32F4_ROM_H
#define LEVER_PORT_STM32F4_ROM_H

#include "port/embedded/rom_test.h"

/* The test of all of the image, not begun. */
rom_test_t rom_test_of_image(void);

#endif
