/* Symbols of image.ld: what they name begins, or ends, at their address. */
#ifndef LEVER_PORT_STM32F4_IMAGE_H
#define LEVER_PORT_STM32F4_IMAGE_H

#include <stdint.h>

extern const uint8_t image_start[];     /* flash, with the vectors */
extern const uint8_t image_rom_bytes[]; /* its address is a number of bytes */

extern volatile uint32_t image_ram[]; /* the stack is at the bottom */
extern volatile uint32_t image_ram_used_end[];
extern volatile uint32_t image_ram_end[];
extern uint32_t image_stack_top[];

extern const uint32_t image_data_in_flash[]; /* initial values of what follows */
extern uint32_t image_data[];
extern uint32_t image_data_end[];
extern uint32_t image_bss[];
extern uint32_t image_bss_end[];

#endif
