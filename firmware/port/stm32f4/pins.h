/* Pins that are given to a peripheral: RM0090 8.3.2 and 8.4. */
#ifndef LEVER_PORT_STM32F4_PINS_H
#define LEVER_PORT_STM32F4_PINS_H

#include <stdint.h>

#include "port/stm32f4/registers.h"

/* Replaces the `width` bits that belong to `pin`. */
static inline void pin_field(reg_t *reg, uint32_t pin, uint32_t width, uint32_t value)
{
    const uint32_t mask = FIELD((1u << width) - 1u, pin * width);

    *reg = (*reg & ~mask) | FIELD(value, pin * width);
}

/* Gives `pin` of a port, whose clock is on, to alternate function `function`: push-pull, high speed, with pull-up. */
static inline void pin_to_peripheral(gpio_t *port, uint32_t pin, uint32_t function)
{
    pin_field(&port->OSPEEDR, pin, 2u, 2u);
    pin_field(&port->PUPDR, pin, 2u, 1u);
    pin_field(&port->AFR[pin / 8u], pin % 8u, 4u, function);
    pin_field(&port->MODER, pin, 2u, 2u);
}

#endif
