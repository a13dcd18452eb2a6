/* The SLCAN codec: lines both ways, and the peer's answer to every command in every state, after LAWICEL's manuals of
 * the CAN232 and CANUSB; its acceptance filter after the data sheet of the SJA1000. */
#include <stdio.h>
#include <string.h>

#include "port/slcan/slcan.h"
#include "unity.h"

enum { SINK_BYTES = 512, MOST_FRAMES = 8 };

/* A sink with room for so many bytes. */
typedef struct fake_sink {
    char text[SINK_BYTES];
    uint32_t length;
    uint32_t room;
} fake_sink_t;

static fake_sink_t fake;
static slcan_t slcan;
static slcan_frame_t taken[MOST_FRAMES];
static uint32_t frames;

static bool fake_put(void *self, const char *text, uint32_t length)
{
    fake_sink_t *sink = self;
    const bool has_room = (sink->length + length) <= sink->room;

    if (has_room) {
        (void)memcpy(&sink->text[sink->length], text, length);
        sink->length += length;
    }
    return has_room;
}

void setUp(void)
{
    static const slcan_identity_t identity = {.version = "1234", .serial = "A1Z9"};
    const slcan_sink_t sink = {.self = &fake, .put = fake_put};

    (void)memset(&fake, 0, sizeof fake);
    fake.room = SINK_BYTES - 1u;
    slcan_init(&slcan, &sink, &identity);
    frames = 0u;
}

void tearDown(void)
{
}

/* Gives bytes to the peer, which must answer exactly so; frames go to `taken`. */
static void say(const char *text, const char *answer)
{
    fake.length = 0u;
    for (const char *c = text; *c != '\0'; c++) {
        TEST_ASSERT_LESS_THAN_UINT32(MOST_FRAMES, frames);
        if (slcan_take(&slcan, (uint8_t)*c, &taken[frames])) {
            frames++;
        }
    }
    fake.text[fake.length] = '\0';
    TEST_ASSERT_EQUAL_STRING_MESSAGE(answer, fake.text, text);
}

/* Sends a frame to the host, who must get exactly so. */
static void hear(const slcan_frame_t *frame, uint32_t time_ms, const char *line)
{
    fake.length = 0u;
    TEST_ASSERT_TRUE(slcan_send(&slcan, frame, time_ms));
    fake.text[fake.length] = '\0';
    TEST_ASSERT_EQUAL_STRING(line, fake.text);
}

/* --- states ------------------------------------------------------------------------------------------------------ */

static void test_the_channel_is_opened_and_closed_once(void)
{
    say("C\r", "\a");
    say("O\r", "\r");
    TEST_ASSERT_EQUAL_UINT8(SLCAN_CHANNEL_OPEN, slcan.channel);
    say("O\r", "\a");
    say("L\r", "\a");
    TEST_ASSERT_EQUAL_UINT8(SLCAN_CHANNEL_OPEN, slcan.channel);
    say("C\r", "\r");
    say("C\r", "\a");
    say("L\r", "\r");
    TEST_ASSERT_EQUAL_UINT8(SLCAN_CHANNEL_LISTEN, slcan.channel);
    say("O\r", "\a");
    TEST_ASSERT_EQUAL_UINT8(SLCAN_CHANNEL_LISTEN, slcan.channel);
}

static void test_what_python_can_opens_with_opens(void)
{
    say("C\rS8\r\rO\rO\r", "\a\r\r\r\a");
    TEST_ASSERT_EQUAL_UINT8(SLCAN_CHANNEL_OPEN, slcan.channel);
    say("C\rS8\r\rO\rO\r", "\r\r\r\r\a"); /* a second one, after a host that was killed */
}

static void test_what_slcand_and_the_kernel_open_with_opens(void)
{
    say("C\rS8\rO\r", "\a\r\r");
    say("C\rS6\rL\r", "\r\r\r");
}

static void test_bit_rates_are_set_while_closed(void)
{
    char command[] = "S0\r";

    TEST_ASSERT_EQUAL_UINT8(8u, slcan.bit_rate);
    for (char rate = '0'; rate <= '8'; rate++) {
        command[1] = rate;
        say(command, "\r");
        TEST_ASSERT_EQUAL_UINT8(rate - '0', slcan.bit_rate);
    }
    say("S9\r", "\a");
    say("S\r", "\a");
    say("S81\r", "\a");
    say("SA\r", "\a");
    TEST_ASSERT_EQUAL_UINT8(8u, slcan.bit_rate);
    say("s031C\r", "\r");
    TEST_ASSERT_EQUAL_HEX16(0x031Cu, slcan.bit_timing);
    say("s031\r", "\a");
    say("s031CC\r", "\a");
    say("s03xC\r", "\a");
    TEST_ASSERT_EQUAL_HEX16(0x031Cu, slcan.bit_timing);
    say("S3\r", "\r");
    TEST_ASSERT_EQUAL_HEX16(0u, slcan.bit_timing);
    say("O\rS4\rs031C\r", "\r\a\a");
    TEST_ASSERT_EQUAL_UINT8(3u, slcan.bit_rate);
}

static void test_version_and_serial_number_in_every_state(void)
{
    say("V\r", "V1234\r");
    say("v\r", "v1234\r");
    say("N\r", "NA1Z9\r");
    say("O\rV\rN\rC\r", "\rV1234\rNA1Z9\r\r");
    say("L\rV\rN\r", "\rV1234\rNA1Z9\r");
    say("V1\r", "\a");
    say("N1\r", "\a");
}

static void test_empty_lines_are_good(void)
{
    say("\r\r\r", "\r\r\r");
    say("O\r\r", "\r\r");
}

static void test_a_terminals_line_feeds_are_skipped(void)
{
    say("\r\nV\r\nO\r\nt1230\r\n", "\rV1234\r\rz\r");
    TEST_ASSERT_EQUAL_UINT32(1u, frames);
}

/* --- frames from the host ---------------------------------------------------------------------------------------- */

static void test_frames_of_every_kind_arrive(void)
{
    static const uint8_t data[8] = {0x01u, 0x23u, 0x45u, 0x67u, 0x89u, 0xABu, 0xCDu, 0xEFu};

    say("O\r", "\r");
    say("t7FF80123456789ABCDEF\r", "z\r");
    say("T1FFFFFFF80123456789abcdef\r", "Z\r");
    say("r0005\r", "z\r");
    say("R000000018\r", "Z\r");
    say("t1101aB\r", "z\r");
    TEST_ASSERT_EQUAL_UINT32(5u, frames);
    TEST_ASSERT_EQUAL_HEX32(0x7FFu, taken[0].frame.id);
    TEST_ASSERT_FALSE(taken[0].extended || taken[0].remote);
    TEST_ASSERT_EQUAL_UINT8(8u, taken[0].frame.length);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(data, taken[0].frame.data, 8);
    TEST_ASSERT_EQUAL_HEX32(0x1FFFFFFFu, taken[1].frame.id);
    TEST_ASSERT_TRUE(taken[1].extended && !taken[1].remote);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(data, taken[1].frame.data, 8);
    TEST_ASSERT_TRUE(taken[2].remote && !taken[2].extended);
    TEST_ASSERT_EQUAL_HEX32(0u, taken[2].frame.id);
    TEST_ASSERT_EQUAL_UINT8(5u, taken[2].frame.length);
    TEST_ASSERT_TRUE(taken[3].remote && taken[3].extended);
    TEST_ASSERT_EQUAL_HEX32(1u, taken[3].frame.id);
    TEST_ASSERT_EQUAL_HEX8(0xABu, taken[4].frame.data[0]);
    TEST_ASSERT_EQUAL_UINT32(5u, slcan.counts.frames_in);
    TEST_ASSERT_EQUAL_UINT32(0u, slcan.counts.refused);
}

static void test_malformed_frames_are_refused(void)
{
    static const char *const malformed[] = {"t\r", "t110\r", "t1101\r", "t11011\r", "t1101122\r", "t8000\r", "t1109\r",
        "t110A\r", "t11g0\r", "t1101g1\r", "t11011g\r", "t 1100\r", "t-110\r", "t11082233445566778\r",
        "t110811223344556677889\r", "T1100\r", "T200000000\r", "T0000000\r", "T000000009\r", "r110\r", "r11011\r",
        "r1109\r", "r8000\r", "R110\r", "R200000000\r", "R00000000100\r", "x1100\r", "d1100\r", "t1101223344\r"};

    say("O\r", "\r");
    for (size_t i = 0u; i < (sizeof malformed / sizeof malformed[0]); i++) {
        say(malformed[i], "\a");
    }
    TEST_ASSERT_EQUAL_UINT32(0u, frames);
    TEST_ASSERT_EQUAL_UINT32(sizeof malformed / sizeof malformed[0], slcan.counts.refused);
    say("t1100\r", "z\r");
    TEST_ASSERT_EQUAL_UINT32(1u, frames);
}

static void test_nobody_sends_on_a_closed_channel_or_one_that_listens(void)
{
    say("t1100\r", "\a");
    say("L\r", "\r");
    say("t1100\rT000000010\rr1100\rR000000010\r", "\a\a\a\a");
    TEST_ASSERT_EQUAL_UINT32(0u, frames);
}

static void test_unknown_commands_are_refused(void)
{
    static const char *const unknown[] = {"X1\r", "P\r", "A\r", "Q1\r", "W2\r", "U1\r", "Y2\r", "o\r", "c\r", "?\r",
        " O\r", "O \r", "OO\r", "CC\r", "L1\r", "F0\r", "\x80\r", "\x01x\r"};

    for (size_t i = 0u; i < (sizeof unknown / sizeof unknown[0]); i++) {
        say(unknown[i], "\a");
    }
    say("O\r", "\r");
    for (size_t i = 0u; i < (sizeof unknown / sizeof unknown[0]); i++) {
        say(unknown[i], "\a");
    }
}

static void test_a_line_too_long_is_refused_once_and_over_with_its_end(void)
{
    char text[400];

    (void)memset(text, '1', sizeof text);
    text[0] = 't';
    text[398] = '\r';
    text[399] = '\0';
    say("O\r", "\r");
    say(text, "\a");
    say("t1100\r", "z\r");
    TEST_ASSERT_EQUAL_UINT32(1u, frames);
    say("T0000000181122334455667788\r", "Z\r");    /* the longest */
    say("T00000001811223344556677881234\r", "\a"); /* with the time stamp that a host does not send */
    say("T000000018112233445566778812345\r", "\a");
}

static void test_a_bell_ends_a_line_and_is_refused(void)
{
    say("O\a", "\a");
    TEST_ASSERT_EQUAL_UINT8(SLCAN_CHANNEL_CLOSED, slcan.channel);
    say("O\r", "\r");
}

static void test_hanging_up_forgets_a_half_line_and_closes(void)
{
    say("O\rt11", "\r");
    slcan_hang_up(&slcan);
    TEST_ASSERT_EQUAL_UINT8(SLCAN_CHANNEL_CLOSED, slcan.channel);
    say("V\r", "V1234\r");
}

/* --- frames to the host ------------------------------------------------------------------------------------------ */

static void test_frames_are_heard_on_an_open_channel_only(void)
{
    const slcan_frame_t standard = {.frame = {.id = 0x210u, .length = 3u, .data = {0x0Au, 0xB0u, 0xFFu}}};
    const slcan_frame_t extended = {.frame = {.id = 0x1ABCDEFu, .length = 1u, .data = {0x5Au}}, .extended = true};
    const slcan_frame_t remote = {.frame = {.id = 0x7u, .length = 8u}, .remote = true};
    const slcan_frame_t extended_remote = {.frame = {.id = 0x7u}, .remote = true, .extended = true};

    hear(&standard, 0u, "");
    say("O\r", "\r");
    hear(&standard, 0u, "t21030AB0FF\r");
    hear(&extended, 0u, "T01ABCDEF15A\r");
    hear(&remote, 0u, "r0078\r");
    hear(&extended_remote, 0u, "R000000070\r");
    say("C\rL\r", "\r\r");
    hear(&standard, 0u, "t21030AB0FF\r");
    say("C\r", "\r");
    hear(&standard, 0u, "");
    TEST_ASSERT_EQUAL_UINT32(5u, slcan.counts.frames_out);
}

static void test_time_stamps_are_milliseconds_of_a_minute(void)
{
    const slcan_frame_t frame = {.frame = {.id = 0x210u, .length = 1u, .data = {0x11u}}};

    say("Z1\rO\r", "\r\r");
    hear(&frame, 0u, "t2101110000\r");
    hear(&frame, 59999u, "t210111EA5F\r");
    hear(&frame, 60000u, "t2101110000\r");
    hear(&frame, 4294967295u, "t210111B8BF\r"); /* 47295 */
    say("Z0\r", "\a");
    say("C\rZ2\rZ\rZ0\rO\r", "\r\a\a\r\r");
    hear(&frame, 5u, "t210111\r");
}

static void test_what_finds_no_room_is_dropped_counted_and_told(void)
{
    const slcan_frame_t frame = {.frame = {.id = 0x210u, .length = 8u}};

    say("O\r", "\r");
    fake.length = 0u;
    fake.room = 21u;
    TEST_ASSERT_FALSE(slcan_send(&slcan, &frame, 0u));
    TEST_ASSERT_EQUAL_UINT32(0u, fake.length);
    fake.room = 22u;
    TEST_ASSERT_TRUE(slcan_send(&slcan, &frame, 0u));
    TEST_ASSERT_FALSE(slcan_send(&slcan, &frame, 0u));
    TEST_ASSERT_EQUAL_UINT32(2u, slcan.counts.dropped);
    fake.room = 0u;
    say("F\r", "");     /* the answer is lost, and what it told of is not */
    say("t1100\r", ""); /* the frame is taken though its acknowledgement is lost */
    TEST_ASSERT_EQUAL_UINT32(1u, frames);
    TEST_ASSERT_EQUAL_UINT32(4u, slcan.counts.dropped);
    fake.room = SINK_BYTES - 1u;
    say("F\r", "F09\r");
    say("F\r", "F00\r");
}

static void test_status_flags_are_read_on_an_open_channel_and_cleared(void)
{
    slcan.status = SLCAN_STATUS_BUS_ERROR | SLCAN_STATUS_ERROR_PASSIVE | SLCAN_STATUS_ERROR_WARNING;
    say("F\r", "\a");
    say("O\rF\r", "\rFA4\r");
    say("F\r", "F00\r");
}

/* --- acceptance filter: SJA1000 data sheet, 6.4.15, dual filter -------------------------------------------------- */

static bool is_heard(uint32_t id, bool extended, bool remote, uint8_t length, uint8_t first)
{
    const slcan_frame_t frame = {
        .frame = {.id = id, .length = length, .data = {first}}, .extended = extended, .remote = remote};
    const uint32_t before = slcan.counts.frames_out;

    TEST_ASSERT_TRUE(slcan_send(&slcan, &frame, 0u));
    fake.length = 0u;
    return slcan.counts.frames_out != before;
}

static void test_the_filter_lets_through_what_the_manual_says(void)
{
    /* the CANUSB manual's example: 0x300 to 0x3FF */
    say("M00006000\rm00001FF0\rO\r", "\r\r\r");
    for (uint32_t id = 1u; id < 0x800u; id++) {
        TEST_ASSERT_EQUAL(((id & 0x700u) == 0x300u), is_heard(id, false, false, 8u, 0u));
    }
    TEST_ASSERT_TRUE(is_heard(0x3FFu, false, true, 0u, 0u));
}

static void test_the_filter_of_one_identifier_and_first_byte(void)
{
    /* filter 1: 0x210 as data frame whose first byte is 0x5A; filter 2: 0x7FF as remote frame */
    say("M4205FFFA\rm00000000\rO\r", "\r\r\r");
    TEST_ASSERT_TRUE(is_heard(0x210u, false, false, 2u, 0x5Au));
    TEST_ASSERT_FALSE(is_heard(0x210u, false, false, 2u, 0x5Bu));
    TEST_ASSERT_FALSE(is_heard(0x210u, false, false, 2u, 0x6Au));
    TEST_ASSERT_FALSE(is_heard(0x211u, false, false, 2u, 0x5Au));
    TEST_ASSERT_TRUE(is_heard(0x210u, false, false, 0u, 0u)); /* no data byte that could differ */
    TEST_ASSERT_TRUE(is_heard(0x7FFu, false, true, 4u, 0u));
    TEST_ASSERT_FALSE(is_heard(0x7FFu, false, false, 4u, 0u));
}

static void test_the_filter_of_extended_identifiers_sees_their_upper_half(void)
{
    say("M12345678\rm00000000\rO\r", "\r\r\r");
    TEST_ASSERT_TRUE(is_heard((0x1234u << 13) | 0x1555u, true, false, 0u, 0u));
    TEST_ASSERT_TRUE(is_heard((0x5678u << 13) | 0x1u, true, true, 0u, 0u));
    TEST_ASSERT_FALSE(is_heard(0x1235u << 13, true, false, 0u, 0u));
    say("M0\r", "\a");
    say("C\rM0\rm123456789\rM1234567g\r", "\r\a\a\a");
    TEST_ASSERT_EQUAL_HEX32(0x12345678u, slcan.acceptance_code);
}

/* --- lines ------------------------------------------------------------------------------------------------------- */

static bool read_line(const char *text, slcan_frame_t *frame)
{
    slcan_line_t line = {.length = 0u};

    for (const char *c = text; *c != '\0'; c++) {
        TEST_ASSERT_EQUAL_INT(SLCAN_GOES_ON, slcan_line_take(&line, (uint8_t)*c));
    }
    TEST_ASSERT_EQUAL_INT(SLCAN_CR, slcan_line_take(&line, '\r'));
    return slcan_read_frame(&line, true, frame);
}

static void test_a_host_reads_frames_with_and_without_time(void)
{
    slcan_frame_t frame;

    TEST_ASSERT_TRUE(read_line("t1102AABB", &frame));
    TEST_ASSERT_TRUE(read_line("t1102AABBEA5F", &frame));
    TEST_ASSERT_EQUAL_HEX32(0x110u, frame.frame.id);
    TEST_ASSERT_EQUAL_UINT8(2u, frame.frame.length);
    TEST_ASSERT_EQUAL_HEX8(0xBBu, frame.frame.data[1]);
    TEST_ASSERT_TRUE(read_line("r11020001", &frame));
    TEST_ASSERT_TRUE(read_line("T0000011081122334455667788ABCD", &frame));
    TEST_ASSERT_FALSE(read_line("t1102AABBEA5", &frame));
    TEST_ASSERT_FALSE(read_line("t1102AABBEA5G", &frame));
    TEST_ASSERT_FALSE(read_line("t1102AABBEA5F0", &frame));
    TEST_ASSERT_FALSE(read_line("z", &frame));
    TEST_ASSERT_FALSE(read_line("", &frame));
}

static void test_what_is_written_is_read(void)
{
    uint32_t random = 1u;

    for (uint32_t i = 0u; i < 20000u; i++) {
        slcan_frame_t sent = {.extended = (i % 2u) != 0u, .remote = (i % 3u) == 0u};
        slcan_frame_t read;
        slcan_line_t line = {.length = 0u};
        char text[SLCAN_LINE_BYTES];

        sent.frame.length = (uint8_t)(i % 9u);
        random = (1664525u * random) + 1013904223u;
        sent.frame.id = random >> (sent.extended ? 3 : 21);
        for (uint32_t k = 0u; (k < sent.frame.length) && !sent.remote; k++) {
            random = (1664525u * random) + 1013904223u;
            sent.frame.data[k] = (uint8_t)(random >> 24);
        }
        const uint16_t stamp = ((i % 5u) == 0u) ? (uint16_t)(random % SLCAN_TIME_STAMPS) : (uint16_t)SLCAN_NO_TIME;
        const uint32_t length = slcan_write_frame(&sent, stamp, text);
        for (uint32_t k = 0u; k < (length - 1u); k++) {
            TEST_ASSERT_EQUAL_INT(SLCAN_GOES_ON, slcan_line_take(&line, (uint8_t)text[k]));
        }
        TEST_ASSERT_EQUAL_INT(SLCAN_CR, slcan_line_take(&line, (uint8_t)text[length - 1u]));
        TEST_ASSERT_TRUE(slcan_read_frame(&line, true, &read));
        TEST_ASSERT_EQUAL_HEX32(sent.frame.id, read.frame.id);
        TEST_ASSERT_EQUAL_UINT8(sent.frame.length, read.frame.length);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(sent.frame.data, read.frame.data, 8);
        TEST_ASSERT_EQUAL(sent.extended, read.extended);
        TEST_ASSERT_EQUAL(sent.remote, read.remote);
    }
}

static void test_numbers_out_of_range_are_cut_when_written(void)
{
    const slcan_frame_t standard = {.frame = {.id = 0xFFFFFFFFu, .length = 255u}};
    const slcan_frame_t extended = {.frame = {.id = 0xFFFFFFFFu, .length = 9u}, .extended = true};
    char text[SLCAN_LINE_BYTES + 1] = "";

    TEST_ASSERT_EQUAL_UINT32(22u, slcan_write_frame(&standard, SLCAN_NO_TIME, text));
    TEST_ASSERT_EQUAL_STRING_LEN("t7FF80000000000000000\r", text, 22);
    TEST_ASSERT_EQUAL_UINT32(SLCAN_LINE_BYTES, slcan_write_frame(&extended, 0u, text));
    TEST_ASSERT_EQUAL_STRING("T1FFFFFFF800000000000000000000\r", text);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_channel_is_opened_and_closed_once);
    RUN_TEST(test_what_python_can_opens_with_opens);
    RUN_TEST(test_what_slcand_and_the_kernel_open_with_opens);
    RUN_TEST(test_bit_rates_are_set_while_closed);
    RUN_TEST(test_version_and_serial_number_in_every_state);
    RUN_TEST(test_empty_lines_are_good);
    RUN_TEST(test_a_terminals_line_feeds_are_skipped);
    RUN_TEST(test_frames_of_every_kind_arrive);
    RUN_TEST(test_malformed_frames_are_refused);
    RUN_TEST(test_nobody_sends_on_a_closed_channel_or_one_that_listens);
    RUN_TEST(test_unknown_commands_are_refused);
    RUN_TEST(test_a_line_too_long_is_refused_once_and_over_with_its_end);
    RUN_TEST(test_a_bell_ends_a_line_and_is_refused);
    RUN_TEST(test_hanging_up_forgets_a_half_line_and_closes);
    RUN_TEST(test_frames_are_heard_on_an_open_channel_only);
    RUN_TEST(test_time_stamps_are_milliseconds_of_a_minute);
    RUN_TEST(test_what_finds_no_room_is_dropped_counted_and_told);
    RUN_TEST(test_status_flags_are_read_on_an_open_channel_and_cleared);
    RUN_TEST(test_the_filter_lets_through_what_the_manual_says);
    RUN_TEST(test_the_filter_of_one_identifier_and_first_byte);
    RUN_TEST(test_the_filter_of_extended_identifiers_sees_their_upper_half);
    RUN_TEST(test_a_host_reads_frames_with_and_without_time);
    RUN_TEST(test_what_is_written_is_read);
    RUN_TEST(test_numbers_out_of_range_are_cut_when_written);
    return UNITY_END();
}
