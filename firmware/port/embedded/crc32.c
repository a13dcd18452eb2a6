#include "port/embedded/crc32.h"

/* Half a byte at a time: 64 bytes of table are a fair price for twice the speed of none. */
static uint32_t next_half(uint32_t crc, uint32_t half)
{
    static const uint32_t table[16] = {0x00000000u, 0x1DB71064u, 0x3B6E20C8u, 0x26D930ACu, 0x76DC4190u, 0x6B6B51F4u,
        0x4DB26158u, 0x5005713Cu, 0xEDB88320u, 0xF00F9344u, 0xD6D6A3E8u, 0xCB61B38Cu, 0x9B64C2B0u, 0x86D3D2D4u,
        0xA00AE278u, 0xBDBDF21Cu};

    return (crc >> 4) ^ table[(crc ^ half) & 0x0Fu];
}

uint32_t crc32_update(uint32_t crc, const void *bytes, uint32_t count)
{
    const uint8_t *byte = bytes; /* cppcheck-suppress misra-c2012-11.5 ; D4 */
    uint32_t inverted = ~crc;

    for (uint32_t i = 0u; i < count; i++) {
        inverted = next_half(next_half(inverted, byte[i]), (uint32_t)byte[i] >> 4);
    }
    return ~inverted;
}
