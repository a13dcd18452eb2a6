/* The few calls of Arm semihosting that the image needs: its arguments, a file to write, an end. */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdint.h>

/* The command line into `text`, ended by 0. */
void semihosting_arguments(char *text, uint32_t bytes);

/* A file of the host, new or emptied; a handle for semihosting_write(). Ends the program when it cannot be opened. */
uint32_t semihosting_create(const char *path);
void semihosting_write(uint32_t handle, const void *data, uint32_t bytes);

/* Ends QEMU: status 0 when there is no message, else prints it and ends with 1. */
void semihosting_exit(const char *message);

#endif
