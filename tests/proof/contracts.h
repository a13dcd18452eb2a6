/* Included before each source of the harness settings_text: what it assumes, and settings_value proves. */
#include <string.h>

/*@ requires valid_string(text);
    assigns text[0 .. strlen(text) - 1] \from text[0 ..];
    assigns \result \from text, indirect:text[0 ..];
    ensures \subset(\result, text + (0 .. \old(strlen(text)))); */
static char *trim(char *text);
