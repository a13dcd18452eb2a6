#include "port/stm32f4/rom.h"

#include "port/stm32f4/image.h"

/* Volatile, because what the compiler sees here is not what the build leaves here. */
__attribute__((section(".rom_crc"), used)) static const volatile uint32_t rom_crc = UINT32_MAX;

rom_test_t rom_test_of_image(void)
{
    /* cppcheck-suppress misra-c2012-11.4 ; D8 */
    const rom_test_t test = {.bytes = image_start, .size = (uint32_t)(uintptr_t)image_rom_bytes, .expected = rom_crc};

    return test;
}
