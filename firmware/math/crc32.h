/* CRC-32 of IEEE 802.3 (zlib's crc32), bit by bit: for what is not asked for often.
 *
 * From CRC32_START on, for each byte or word, lowest byte first: crc = crc32_shift(crc ^ value, its bits). The CRC is the
 * complement of the last. Of "123456789" it is 0xCBF43926.
 */
#ifndef MATH_CRC32_H
#define MATH_CRC32_H

#include <stdint.h>

#define CRC32_START UINT32_MAX

static inline uint32_t crc32_shift(uint32_t crc, uint32_t bits)
{
    uint32_t shifted = crc;
    for (uint32_t bit = 0u; bit < bits; bit++) {
        shifted = (shifted >> 1u) ^ (((shifted & 1u) != 0u) ? 0xEDB88320u : 0u);
    }
    return shifted;
}

#endif
