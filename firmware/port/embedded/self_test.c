#include "port/embedded/self_test.h"

#include <stddef.h>
#include <string.h>

#include "port/embedded/crc32.h"
#include "port/embedded/golden.h"

enum { INPUTS = sizeof(golden_input) / sizeof(golden_input[0]), FRAME_BYTES = 8 };

/* Alignment cut short, so that a few samples reach the learning of the parameters; golden.py has the same. */
static lever_t *start(lever_memory_t *memory, lever_config_t *config, uint8_t estimator)
{
    lever_config_default(config);
    config->estimator = estimator;
    config->settings.align_time = GOLDEN_ALIGN_TIME;
    return lever_init(memory, config);
}

/* Of a word as four bytes, the lowest first, whatever this machine's order is. */
static uint32_t crc_of_word(uint32_t crc, uint32_t word)
{
    const uint8_t bytes[4] = {(uint8_t)word, (uint8_t)(word >> 8), (uint8_t)(word >> 16), (uint8_t)(word >> 24)};

    return crc32_update(crc, bytes, sizeof bytes);
}

static uint32_t crc_of_frame(uint32_t crc, const lever_frame_t *frame)
{
    return crc32_update(crc_of_word(crc, frame->id), frame->data, frame->length);
}

/* Up to nis it consists of words. */
static uint32_t crc_of_estimate(uint32_t crc, const lever_estimate_t *estimate)
{
    const uint8_t *const bytes = (const uint8_t *)estimate;
    uint32_t result = crc;

    for (size_t at = 0u; at < offsetof(lever_estimate_t, nis_size); at += sizeof(uint32_t)) {
        uint32_t word = 0u;
        /* cppcheck-suppress misra-c2012-21.15 ; D2 */
        (void)memcpy(&word, &bytes[at], sizeof word);
        result = crc_of_word(result, word);
    }
    return result;
}

static uint32_t crc_of_run(lever_t *lever)
{
    uint32_t crc = 0u;
    lever_frame_t frame;
    lever_estimate_t estimate;

    for (uint32_t i = 0u; i < (uint32_t)INPUTS; i++) {
        frame.id = golden_id[i % 2u];
        frame.length = FRAME_BYTES;
        (void)memcpy(frame.data, golden_input[i], FRAME_BYTES);
        if (lever_on_frame(lever, &frame) == LEVER_FRAME_SAMPLE) {
            (void)lever_step(lever);
            while (lever_next_frame(lever, &frame)) {
                crc = crc_of_frame(crc, &frame);
            }
        }
    }
    lever_estimate(lever, &estimate);
    return crc_of_estimate(crc, &estimate);
}

bool self_test(lever_memory_t *memory)
{
    lever_config_t config; /* as long as the instance */
    bool good = true;

    for (uint8_t estimator = 0u; estimator < (uint8_t)LEVER_ESTIMATOR_COUNT; estimator++) {
        lever_t *lever = start(memory, &config, estimator);
        good = (lever != NULL) && (crc_of_run(lever) == golden_crc[estimator]) && good;
    }
    return good;
}
