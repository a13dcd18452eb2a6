#include "port/embedded/rom_test.h"

#include "port/embedded/crc32.h"

void rom_test_step(rom_test_t *test, uint32_t bytes)
{
    const uint32_t left = test->size - test->at;
    const uint32_t count = (bytes < left) ? bytes : left;

    test->crc = crc32_update(test->crc, &test->bytes[test->at], count);
    test->at += count;
    if (test->at == test->size) {
        test->failed = test->failed || (test->crc != test->expected);
        test->passes++;
        test->at = 0u;
        test->crc = 0u;
    }
}
