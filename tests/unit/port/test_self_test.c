/* The power-on self test as the host passes it, and its CRC against the check value. */
#include "test.h"
#include "port/embedded/crc32.h"
#include "port/embedded/self_test.h"

/* Check value of CRC-32/ISO-HDLC in the catalogue of parametrised CRC algorithms; in one piece or two. */
TEST(crc_has_its_check_value)
{
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926u, crc32_update(0u, "123456789", 9u));
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926u, crc32_update(crc32_update(0u, "1234", 4u), "56789", 5u));
    TEST_ASSERT_EQUAL_HEX32(0u, crc32_update(0u, "", 0u));
}

TEST(self_test_passes_here)
{
    lever_memory_t other;

    TEST_ASSERT_TRUE(self_test(&other));
    TEST_ASSERT_TRUE(self_test(&other)); /* whatever the memory holds */
}
